"""The links of a pilot: to a real autopilot, in real time, and to a simulated one, in its own time."""

import time
from typing import Any

from mambo_extensions.mavlink.autopilot_source import AutopilotSource
from mambo_extensions.mavlink.messages import RecordReader
from mambo_extensions.mavlink.signing import sign
from mambo_extensions.mavlink.simulated import Condition, SimulatedAutopilot
from mambo_extensions.mavlink.sockets import Address, MavlinkSocket
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.life.records import Record, Stack

WAIT_S = 0.005
"""How long a loop waits for a message."""


class UdpLink:
    """An autopilot that sends to an address of this machine, in real time; `key` signs both directions."""

    def __init__(self, listen: Address, key: bytes | None = None) -> None:
        self.socket, self._peer, self._reader = MavlinkSocket(listen), AutopilotSource(), RecordReader()
        if key is not None:
            sign(self.socket.mav, key)

    @property
    def mav(self) -> Any:
        """Pymavlink's MAVLink object, which sends."""
        return self.socket.mav

    @property
    def hint(self) -> str:
        """Why nothing may be heard, to be added to a sentence."""
        return "; messages come that are not signed with the key" if self.socket.has_refused else ""

    def now_s(self) -> float:
        """Return the time of the pilot's clock."""
        return time.monotonic()

    def receive(self) -> list[Record]:
        """Return what has come; wait a moment for it."""
        return self._read(WAIT_S)

    def _read(self, wait_s: float) -> list[Record]:
        arrived, now_s = self.socket.receive(wait_s), self.now_s()
        counting = [one for one, address in arrived if self._peer.counts(one, address, now_s)]
        self.socket.peer = self._peer.address
        return [record for record in map(self._reader.read, counting) if record is not None]

    def close(self) -> None:
        """Close its socket."""
        self.socket.close()


class SimulatedLink(UdpLink):
    """A simulated autopilot behind a socket of the loopback, as fast as the machine computes."""

    def __init__(self, stack: Stack, drone: VehicleFile, condition: Condition | None = None) -> None:
        super().__init__(Address("127.0.0.1", 0))
        pilot = ("127.0.0.1", self.socket.port)
        self.autopilot = SimulatedAutopilot(stack, drone, pilot, condition)

    def now_s(self) -> float:
        """Return the time of the simulated autopilot."""
        return self.autopilot.time_s

    def receive(self) -> list[Record]:
        """Let a tick of the simulation pass, and return what has come."""
        self.autopilot.tick()
        return self._read(0.0)

    def close(self) -> None:
        """Close both sockets."""
        self.autopilot.socket.close()
        super().close()
