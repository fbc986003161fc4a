"""Flights on a link that others use too: only the autopilot that was connected to is believed."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink

from mambo_extensions.mavlink.links import SimulatedLink
from mambo_extensions.mavlink.messages import send_record
from mambo_extensions.mavlink.pilot import Pilot
from mambo_extensions.mavlink.signing import sign
from mambo_extensions.mavlink.simulated import STARTS_M
from mambo_extensions.mavlink.sockets import Address, MavlinkSocket
from mambo_sil.errors import PilotError
from mambo_sil.flight.trajectories import Circle
from mambo_sil.life.phases import Phase
from mambo_sil.life.records import (
    COMPANION,
    PX4,
    STACKS,
    Answer,
    Battery,
    EstimatedState,
    Heartbeat,
    OnGround,
    Parameter,
    Record,
    Stack,
    Stream,
    Text,
)
from tests.support.links import controller, drone

KEY = bytes(range(32))


class SharedLink(SimulatedLink):
    """A simulated autopilot behind a router: what others send comes from the same address."""

    def __init__(self, stack: Stack) -> None:
        super().__init__(stack, drone())
        self.others: list[Callable[[float], list[bytes]]] = []
        """Return what another sender sends at a time."""

    def receive(self) -> list[Record]:
        """Let the others send, ten times a second, and a tick pass."""
        if round(100.0 * self.now_s()) % 10 == 0:
            for other in self.others:
                for data in other(self.now_s()):
                    self.autopilot.socket.write(data)
        return super().receive()


class Other:
    """A sender with ids of its own, whose clock is ahead."""

    def __init__(self, stack: Stack, system: int, component: int, ahead_s: float = 0.0) -> None:
        self._data: list[bytes] = []
        self.mav: Any = mavlink.MAVLink(self, system, component)
        self.stack, self.ahead_s, self.vehicle = stack, ahead_s, 2

    def write(self, data: bytes) -> None:
        """Keep what pymavlink sends."""
        self._data.append(bytes(data))

    def estimates(self, time_s: float) -> list[bytes]:
        """Return a state at rest, 3 m to the north, in the messages of both autopilots."""
        north = EstimatedState(
            time_s + self.ahead_s, np.array([3.0, 0.0, -1.0]), np.zeros(3), np.zeros(3), resets=0
        )
        for stream in (Stream.ATTITUDE_QUATERNION, Stream.LOCAL_POSITION_NED, Stream.ODOMETRY):
            send_record(self.mav, north, stream)
        data, self._data = self._data, []
        return data

    def everything(self, time_s: float) -> list[bytes]:
        """Return that, and all else that a pilot reads: disarmed, on the ground, empty, other parameters."""
        others: list[Record] = [
            Heartbeat(0, 0, self.stack.ident, self.vehicle, armed=False, mode=self.stack.land),
            *(Parameter(self.stack.hover_parameter, 0.9), Answer(176, accepted=True), OnGround(landed=True)),
            *(Battery(0.0), Text("I am another drone")),
        ]
        for record in others:
            send_record(self.mav, record)
        return self.estimates(time_s)


def fly_beside(link: SharedLink, happens: Callable[[], object] = lambda: None) -> tuple[Pilot, float]:
    """Fly a circle; return the pilot, and how far the drone was from its start; something happens in it."""
    away_m = [0.0]

    def watch(pilot: Pilot) -> None:
        away_m.append(float(np.abs(link.autopilot.true.position_m[:2, 0] - STARTS_M[:2]).max()))
        if pilot.life.phase is Phase.FLYING and pilot.life.course_time_s > 1.5:
            happens()

    pilot = Pilot(controller(), lambda: link, watch=watch)
    try:
        with pilot:
            pilot.take_off(1.0)
            pilot.fly(Circle(0.5, 1.0), 4.0)
            pilot.land()
    except PilotError:
        pass
    return pilot, max(away_m)


@pytest.mark.first_is_quick
@pytest.mark.parametrize("stack", STACKS.values(), ids=STACKS)
def test_another_drone_a_camera_and_a_clock_far_ahead_change_nothing(stack: Stack) -> None:
    """From the first heartbeat of the autopilot to the end: it flies by its own messages."""
    link = SharedLink(stack)
    second, vision = Other(stack, 2, 1), Other(stack, 1, 197)
    vision.vehicle, future = COMPANION, Other(stack, 3, 1, ahead_s=1e6)
    link.others = [
        lambda now_s: second.everything(now_s) if now_s > 0.1 else [],
        lambda now_s: vision.everything(now_s) if now_s > 0.1 else [],
        future.estimates,
    ]
    pilot, away_m = fly_beside(link)
    assert pilot.life.end is not None
    assert pilot.life.end.sentence == "landed: as planned"
    assert away_m < 1.1
    assert pilot.steering.hover_thrust == 0.5
    assert (pilot.steering.take_overs, pilot.steering.frame.jumps) == (1, 0)
    assert not link.autopilot.armed


@pytest.mark.first_is_quick
@pytest.mark.parametrize("stack", STACKS.values(), ids=STACKS)
def test_a_jump_by_forged_ids_lands_the_drone(stack: Stack) -> None:
    """An estimate of the autopilot's own ids, 3 m away, in flight: the autopilot lands where the drone is."""
    link, forger = SharedLink(stack), Other(stack, 1, 1)

    def forge() -> None:
        link.others = [forger.estimates]

    pilot, away_m = fly_beside(link, forge)
    assert pilot.life.end is not None
    assert pilot.life.end.sentence.startswith("landed: the estimate has jumped by 3.")
    assert away_m < 1.1
    assert link.autopilot.is_on_ground
    assert not link.autopilot.armed


@pytest.mark.long
def test_a_signed_link_flies_while_somebody_forges_ids() -> None:
    """Without the key nothing of it is heard, though system, component and address are right."""
    link, forger = SharedLink(PX4), Other(PX4, 1, 1)
    for one in (link.socket, link.autopilot.socket):
        sign(one.mav, KEY)
    link.others = [forger.everything]
    pilot, away_m = fly_beside(link)
    assert pilot.life.end is not None
    assert pilot.life.end.sentence == "landed: as planned"
    assert away_m < 1.1


@pytest.mark.long
@pytest.mark.parametrize("stack", STACKS.values(), ids=STACKS)
def test_an_autopilot_whose_port_changes_is_flown_on(stack: Stack) -> None:
    """A router is restarted: PX4's before the take-off, ArduCopter's in flight, silent for 1.2 s."""
    link, silent_from_s = SharedLink(stack), list[float]()
    autopilot = link.autopilot

    def restart(now_s: float = 1.0) -> list[bytes]:
        if now_s < 0.2:
            return []
        if not silent_from_s:
            silent_from_s.append(link.now_s())
            autopilot.socket.close()
            to = ("127.0.0.1", link.socket.port)
            autopilot.socket = MavlinkSocket(Address("127.0.0.1", 0), to, source=(1, 1))
        autopilot.silent = link.now_s() < silent_from_s[0] + 1.2
        return []

    if stack is PX4:
        link.others = [restart]
        pilot, away_m = fly_beside(link)
    else:
        pilot, away_m = fly_beside(link, restart)
    assert silent_from_s
    assert pilot.life.end is not None
    assert pilot.life.end.sentence == "landed: as planned"
    assert away_m < 1.6
    assert not math.isnan(pilot.steering.mean_thrust)
