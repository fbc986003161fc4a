"""Ranges of inputs: each number of state, target, thrust and command is taken up to its range, not beyond."""

from typing import Any

import numpy as np
import pytest

from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings.model import Settings
from tests.support.height import CRAZYFLIE
from tests.support.quadratic import TWO_MOVES, settings_of

RANGES = {
    "ranges.position_m": 37.0,
    "ranges.velocity_m_s": 11.0,
    "ranges.thrust_acceleration_min_m_s2": 1.5,
    "ranges.thrust_acceleration_max_m_s2": 23.0,
}
REACH_M, FAST_M_S, STEEP_RAD, TURN_RAD, STRONG_M_S2 = 37.0, 11.0, 3.25, 1024.0, 23.0


def settings_with(scalar: str, acceleration: str, *, height: bool) -> Settings:
    """Return settings with these ranges."""
    base = CRAZYFLIE if height else TWO_MOVES
    return settings_of(base | RANGES | {"code.scalar": scalar, "target.acceleration": acceleration})


def statuses(settings: Settings, state: Any, target: Any, thrust_m_s2: Any) -> list[int]:
    """Return the status of a new controller for each of n inputs."""
    controller = method_of(settings).reference_controller(len(state))
    given = () if settings.height is not None else (thrust_m_s2,)
    return [int(one) for one in controller.step(state, target, *given).status]


@pytest.mark.parametrize("scalar", ["float32", "fixed"])
@pytest.mark.parametrize("acceleration", ["none", "given"])
@pytest.mark.parametrize("height", [False, True])
def test_each_number_is_taken_up_to_its_range(scalar: str, acceleration: str, height: bool) -> None:
    """Either way to 1 in a thousand; the first number out of range names the status."""
    settings = settings_with(scalar, acceleration, height=height)
    given = acceleration == "given"
    state = [REACH_M] * 2 + [FAST_M_S] * 2 + [STEEP_RAD] * 2 + [TURN_RAD]
    state += [REACH_M, FAST_M_S] * height
    target = [REACH_M] * 2 + [FAST_M_S] * 2 + [STRONG_M_S2] * 2 * given
    target += [REACH_M, FAST_M_S] * height + [STRONG_M_S2] * (height and given)
    rows = len(state) + len(target)
    largest = np.concatenate([np.diag(state + target), -np.diag(state + target)])
    for factor, bad in ((0.999, False), (1.001, True)):
        states, targets = np.split(factor * largest, [len(state)], axis=1)
        if height:
            states = np.column_stack([states, np.zeros(len(states))])
        expected = [Status.BAD_STATE if bad else Status.OK] * len(state)
        expected += [Status.BAD_TARGET if bad else Status.OK] * len(target)
        assert statuses(settings, states, targets, np.full(2 * rows, 9.81)) == 2 * expected


@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_a_thrust_is_taken_from_the_least_to_the_most(scalar: str) -> None:
    """Of a step without a height."""
    settings = settings_with(scalar, "none", height=False)
    thrusts = [1.499, 1.501, 22.99, 23.01]
    expected = [Status.BAD_THRUST, Status.OK, Status.OK, Status.BAD_THRUST]
    assert statuses(settings, np.zeros((4, 7)), np.zeros((4, 4)), thrusts) == expected


@pytest.mark.parametrize("scalar", ["float32", "fixed"])
@pytest.mark.parametrize("height", [False, True])
def test_a_command_that_is_set_is_cut_off_at_the_tilt_limit(scalar: str, height: bool) -> None:
    """Of angles that are in their range, else it is refused; with a height it has a thrust too."""
    settings = settings_with(scalar, "none", height=height)
    controller: Any = method_of(settings).reference_controller(4)
    angles = np.array([[3.2, -0.1], [0.1, -3.2], [3.3, 0.0], [0.0, 3.3]])
    commands = np.column_stack([angles, np.full(4, 12.0)]) if height else angles
    refused = [Status.OK, Status.OK, Status.BAD_COMMAND, Status.BAD_COMMAND]
    assert controller.set_command(commands).tolist() == refused
    limit_rad = settings.limits.tilt_rad
    expected = np.array([[limit_rad, -0.1], [0.1, -limit_rad], [0.0, 0.0], [0.0, 0.0]])
    numbers = method_of(settings).numbers
    assert numbers.to_si(controller.memory.command_rad, "angle") == pytest.approx(expected, abs=1e-4)
    if height:
        thrusts = numbers.to_si(controller.memory.height.thrust_m_s2, "thrust")
        assert thrusts == pytest.approx([12.0, 12.0, 9.81, 9.81], abs=1e-4)
    assert method_of(settings).tilt_limit_rad == pytest.approx(limit_rad, rel=1e-4)
