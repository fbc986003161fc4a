"""A wire of two UDP sockets between a pilot and a simulated autopilot, which loses and delays what passes."""

import random
import socket
from dataclasses import dataclass

from mambo_extensions.mavlink.links import UdpLink
from mambo_extensions.mavlink.simulated import Condition, SimulatedAutopilot
from mambo_extensions.mavlink.sockets import Address
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.life.records import STACKS, Record


@dataclass
class Faults:
    """Shares of the datagrams of one direction that are lost, late or doubled, or followed by garbage."""

    lost: float = 0.0
    late: float = 0.0
    late_s: float = 0.03
    doubled: float = 0.0
    garbage: float = 0.0
    delay_s: float = 0.0
    """Delay of all datagrams."""
    jitter_s: float = 0.0
    """And the most by which each is later than that."""


class UdpWire:
    """Carries datagrams between an autopilot and a pilot by two sockets of the loopback."""

    def __init__(self, pilot_port: int, seed: int) -> None:
        self.to_pilot, self.to_autopilot = Faults(), Faults()
        self._random = random.Random(seed)
        self._at_autopilot, self._at_pilot = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in "ab")
        for one in (self._at_autopilot, self._at_pilot):
            one.bind(("127.0.0.1", 0))
            one.setblocking(False)
        self.address: tuple[str, int] = self._at_autopilot.getsockname()
        self._pilot, self._autopilot = ("127.0.0.1", pilot_port), ("127.0.0.1", 0)
        self._on_the_way: list[tuple[float, bytes, bool]] = []

    def carry(self, now_s: float) -> None:
        """Take what has come, and hand over what is due."""
        for one, faults, to_pilot in (
            (self._at_autopilot, self.to_pilot, True),
            (self._at_pilot, self.to_autopilot, False),
        ):
            while True:
                try:
                    data, sender = one.recvfrom(65535)
                except BlockingIOError:
                    break
                if to_pilot:
                    self._autopilot = sender
                self._take(data, faults, now_s, to_pilot=to_pilot)
        due = [each for each in self._on_the_way if each[0] <= now_s]
        self._on_the_way = [each for each in self._on_the_way if each[0] > now_s]
        for _, data, to_pilot in sorted(due, key=lambda each: each[0]):
            if to_pilot:
                self._at_pilot.sendto(data, self._pilot)
            else:
                self._at_autopilot.sendto(data, self._autopilot)

    def _take(self, data: bytes, faults: Faults, now_s: float, *, to_pilot: bool) -> None:
        chance = self._random.random
        if chance() < faults.lost:
            return
        arrives_s = now_s + faults.delay_s + (faults.late_s if chance() < faults.late else 0.0)
        if faults.jitter_s:
            arrives_s += faults.jitter_s * chance()
        self._on_the_way.append((arrives_s, data, to_pilot))
        if chance() < faults.doubled:
            self._on_the_way.append((arrives_s + 0.02, data, to_pilot))
        if chance() < faults.garbage:
            self._on_the_way.append((arrives_s, self._random.randbytes(40), to_pilot))
            self._on_the_way.append((arrives_s, data[: len(data) // 2], to_pilot))

    def close(self) -> None:
        """Close both sockets."""
        self._at_autopilot.close()
        self._at_pilot.close()


class WiredLink(UdpLink):
    """A simulated autopilot behind a wire."""

    def __init__(
        self, stack: str, drone: VehicleFile, condition: Condition | None = None, seed: int = 0
    ) -> None:
        super().__init__(Address("127.0.0.1", 0))
        self.wire = UdpWire(self.socket.port, seed)
        self.autopilot = SimulatedAutopilot(STACKS[stack], drone, self.wire.address, condition)

    def now_s(self) -> float:
        """Return the time of the simulated autopilot."""
        return self.autopilot.time_s

    def receive(self) -> list[Record]:
        """Let a tick pass, and return what has come over the wire."""
        self.autopilot.tick()
        self.wire.carry(self.now_s())
        return self._read(0.0)

    def close(self) -> None:
        """Close all sockets."""
        self.wire.close()
        self.autopilot.socket.close()
        super().close()
