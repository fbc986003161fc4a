"""Every way in which a flight ends, over wires that lose, delay and reorder all: no drone stays armed."""

import math
import re
from collections.abc import Callable
from typing import Final

import numpy as np
import pytest

from mambo_sil.life.courses import Place
from mambo_sil.life.life_cycle import LifeCycle
from mambo_sil.life.phases import Phase
from mambo_sil.life.records import COMPANION, STACKS, Arm, Heartbeat, Stack
from mambo_sil.life.steering import Steering, Update
from tests.support.links import controller
from tests.support.lossy import LossyFlight, LossyWire

LOST, DELAYS_S = (0.2, 0.1, 0.3), (0.05, 0.025, 0.15)
"""Shares of the messages that are lost, and delays; each message is up to 30 ms later still."""


def flight(stack: Stack, lost: float, delay_s: float) -> LossyFlight:
    """Return a flight that is about to arm; a link that is slow before that is refused."""
    life = LifeCycle(Steering(controller(), list[Update]().append), 1.0)
    one = LossyFlight(life, stack, lambda way: LossyWire(lost, min(delay_s, 0.08), seed=way))
    one.pass_until(lambda: life.phase is Phase.ARMING)
    one.to_pilot.delay_s = one.to_autopilot.delay_s = delay_s
    return one


def told_to_arm(one: LossyFlight) -> None:
    """Let time pass until the autopilot has heard the order to arm."""
    one.pass_until(lambda: Arm(arm=True) in one.heard)


def flying(one: LossyFlight) -> None:
    """Let the drone take off, and fly for a second."""
    one.pass_until(lambda: one.life.phase is Phase.FLYING)
    one.wait(1.0)


def is_planned(one: LossyFlight) -> None:
    """Land as planned."""
    flying(one)
    one.life.land("as planned", good=True)


def does_not_arm(one: LossyFlight) -> None:
    """Refuse to arm."""
    one.autopilot.arms = False


def arms_at_the_last_moment(one: LossyFlight) -> None:
    """Arm when the pilot is about to give up."""
    one.autopilot.arms = False
    one.wait(14.9)
    one.autopilot.arms = True


def arms_unseen(one: LossyFlight) -> None:
    """Lose the heartbeats of the armed drone, which takes off if it climbs by set-points."""
    one.to_pilot.passes = lambda what: not (isinstance(what, Heartbeat) and what.armed)
    one.pass_until(lambda: one.life.phase is Phase.LANDING)
    one.to_pilot.passes = lambda what: True  # noqa: ARG005 - all does


def does_not_climb(one: LossyFlight) -> None:
    """Stay on the ground with motors that turn."""
    one.autopilot.climbs = False


def estimates_are_late(one: LossyFlight) -> None:
    """Delay what the autopilot sends by half a second more, from now on."""
    flying(one)
    one.to_pilot.delay_s += 0.5


def is_silent_for_a_while(one: LossyFlight) -> None:
    """Lose all in both directions for 1.5 s: PX4 leaves OFFBOARD."""
    flying(one)
    one.to_pilot.passes = one.to_autopilot.passes = lambda what: False  # noqa: ARG005 - nothing does
    one.wait(1.5)
    one.to_pilot.passes = one.to_autopilot.passes = lambda what: True  # noqa: ARG005 - all does


def is_silent_for_longer(one: LossyFlight) -> None:
    """Lose all for 5 s: the pilot has given up flying."""
    is_silent_for_a_while(one)
    one.to_pilot.passes = one.to_autopilot.passes = lambda what: False  # noqa: ARG005 - nothing does
    one.wait(5.0)
    one.to_pilot.passes = one.to_autopilot.passes = lambda what: True  # noqa: ARG005 - all does


def state_is_refused(one: LossyFlight) -> None:
    """Move the estimate out of the range of the controller, by a jump that is counted."""
    flying(one)
    one.autopilot.shift_m, one.autopilot.resets = 9e5, 1


def estimate_jumps(one: LossyFlight) -> None:
    """Move the estimate by 10 m, and count no reset."""
    flying(one)
    one.autopilot.shift_m = 10.0


def target_is_far(one: LossyFlight) -> None:
    """Fly to a target 25 m away."""
    flying(one)
    one.life.fly(Place(np.array([25.0, 0.0, -1.0])))


def wind_rises(one: LossyFlight) -> None:
    """Be pushed away by more than the controller learns, however far."""
    flying(one)
    one.life.farthest_m = math.inf
    one.autopilot.push_m_s2 = 8.0
    one.pass_until(lambda: one.life.phase is not Phase.FLYING)
    one.autopilot.push_m_s2 = 0.0


def drone_swings(one: LossyFlight) -> None:
    """Be commanded from limit to limit, by settings that are too quick for the link."""
    flying(one)
    for number in range(12):
        side_rad = (-1.0) ** number * one.life.steering.controller.settings.limits.tilt_rad
        one.life.steering.swings.watch(np.array([side_rad, 0.0]), one.now_s)
    one.pass_until(lambda: one.life.phase is not Phase.FLYING)


def another_pilot_comes(one: LossyFlight) -> None:
    """Hear another pilot in flight."""
    flying(one)
    one.life.receive(Heartbeat(9, 191, 8, COMPANION, armed=False, mode=0), one.now_s)


def is_interrupted(one: LossyFlight) -> None:
    """Press Ctrl-C in flight."""
    flying(one)
    one.life.land("Ctrl-C", good=False)


def is_interrupted_while_arming(one: LossyFlight) -> None:
    """Press Ctrl-C just after the order to arm has been sent, perhaps once more: it is on its way."""
    told_to_arm(one)
    one.life.land("Ctrl-C", good=False)


def is_stopped(one: LossyFlight) -> None:
    """Press Ctrl-C twice in flight."""
    flying(one)
    one.life.stop("Ctrl-C twice")


def is_stopped_while_arming(one: LossyFlight) -> None:
    """Press Ctrl-C twice just after the order to arm has been sent."""
    told_to_arm(one)
    one.life.stop("Ctrl-C twice")


def motors_stop(one: LossyFlight) -> None:
    """Stop the motors in flight, as an autopilot does that has turned over, until the pilot hears of it."""
    flying(one)
    one.autopilot.armed = False
    one.pass_until(lambda: one.life.phase is Phase.ENDED)


ENDS: Final[dict[Callable[[LossyFlight], None], str]] = {
    arms_unseen: r"(landed|no flight): .* did not arm within 15 s",
    is_stopped_while_arming: "Ctrl-C twice: the motors are stopped",
    is_planned: "landed: as planned",
    does_not_arm: r"no flight: .* did not arm within 15 s",
    arms_at_the_last_moment: r"(no flight|landed): .* did not arm within 15 s|landed: as planned",
    does_not_climb: r"landed: 1 m were not reached within 17 s",
    estimates_are_late: "landed: no estimate that is not late has come for 2 s",
    is_silent_for_a_while: "landed: (the link was silent, and PX4 has left OFFBOARD for HOLD|as planned)",
    is_silent_for_longer: "landed: (no .* has come for 2 s|the link was silent, .*)",
    state_is_refused: r"landed: (the controller refuses the state|the estimate has jumped)",
    estimate_jumps: "landed: the estimate has jumped by 10.0 m",
    target_is_far: "landed: the target is 25 m away",
    wind_rises: "landed: pushed away: wind, or a drone that the settings do not describe",
    drone_swings: "landed: the drone swings between its limits of tilt",
    another_pilot_comes: "landed: another pilot is on the link",
    is_interrupted: "landed: Ctrl-C",
    is_interrupted_while_arming: "(landed|no flight): Ctrl-C",
    is_stopped: "Ctrl-C twice: the motors are stopped",
    motors_stop: r"\w+ has stopped the motors in flight",
}
"""What happens, and the sentence that a flight then ends with."""


def fly_to_the_end(one: LossyFlight, happens: Callable[[LossyFlight], None]) -> str:
    """Return how a flight ends in which something happens; what was on its way then arrives."""
    happens(one)
    one.pass_until(lambda: one.life.phase in {Phase.ENDED, Phase.FLYING})
    one.wait(2.5)
    one.life.land("as planned", good=True)
    one.pass_until(lambda: one.life.end is not None)
    one.wait(1.0)
    return "" if one.life.end is None else one.life.end.sentence


@pytest.mark.sampled(6)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("delay_s", DELAYS_S)
@pytest.mark.parametrize("lost", LOST)
@pytest.mark.parametrize("stack", STACKS.values(), ids=STACKS)
@pytest.mark.parametrize("happens", ENDS, ids=lambda happens: happens.__name__)
def test_no_flight_ends_with_an_armed_drone(
    happens: Callable[[LossyFlight], None], stack: Stack, lost: float, delay_s: float
) -> None:
    """However it ends, the drone is disarmed and on the ground when the program closes, and stays so."""
    one = flight(stack, lost, delay_s)
    sentence = fly_to_the_end(one, happens)
    assert re.match(ENDS[happens], sentence), sentence
    assert not one.autopilot.armed
    assert one.autopilot.height_m == pytest.approx(0.0, abs=1e-9)
