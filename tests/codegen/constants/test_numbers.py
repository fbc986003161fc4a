"""Numbers of a controller: inputs up to their ranges, fixed point beside float64, members of structures."""

import re
from itertools import product
from math import prod
from typing import Any

import numpy as np
import pytest

from mambo_codegen.bundle.render import render
from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.support.height import CRAZYFLIE
from tests.support.quadratic import EVERYTHING, TWO_MOVES, settings_of

RANGES = {
    "ranges.position_m": 37.0,
    "ranges.velocity_m_s": 11.0,
    "ranges.thrust_acceleration_min_m_s2": 1.5,
    "ranges.thrust_acceleration_max_m_s2": 23.0,
}
REACH_M, FAST_M_S, STEEP_RAD, TURN_RAD, STRONG_M_S2 = 37.0, 11.0, 3.25, 1024.0, 23.0


def settings_with(scalar: str, *, height: bool) -> Settings:
    """Return settings with these ranges."""
    base = CRAZYFLIE if height else TWO_MOVES
    return settings_of(base | RANGES | {"code.scalar": scalar})


def statuses(settings: Settings, state: Any, target: Any, thrust_m_s2: Any) -> list[int]:
    """Return the status of a new controller for each of n inputs."""
    controller = method_of(settings).reference_controller(len(state))
    given = () if settings.height is not None else (thrust_m_s2,)
    return [int(one) for one in controller.step(state, target, *given).status]


@pytest.mark.parametrize("scalar", ["float32", "fixed"])
@pytest.mark.parametrize("height", [False, True])
def test_each_number_is_taken_up_to_its_range(scalar: str, height: bool) -> None:
    """Either way to 1 in a thousand; the first number out of range names the status."""
    settings = settings_with(scalar, height=height)
    state = [REACH_M] * 2 + [FAST_M_S] * 2 + [STEEP_RAD] * 2 + [TURN_RAD]
    state += [REACH_M, FAST_M_S] * height
    target = [REACH_M] * 2 + [FAST_M_S] * 2 + [STRONG_M_S2] * 2
    target += [REACH_M, FAST_M_S] * height + [STRONG_M_S2] * height
    target += [STRONG_M_S2] * (2 + height)
    rows = len(state) + len(target)
    largest = np.concatenate([np.diag(state + target), -np.diag(state + target)])
    for factor, bad in ((0.999, False), (1.001, True)):
        states, targets = np.split(factor * largest, [len(state)], axis=1)
        targets = np.column_stack([targets, np.zeros(len(states))])
        if height:
            states = np.column_stack([states, np.zeros(len(states))])
        expected = [Status.BAD_STATE if bad else Status.OK] * len(state)
        expected += [Status.BAD_TARGET if bad else Status.OK] * len(target)
        assert statuses(settings, states, targets, np.full(2 * rows, 9.81)) == 2 * expected


@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_a_thrust_is_taken_from_the_least_to_the_most(scalar: str) -> None:
    """Of a step without a height."""
    settings = settings_with(scalar, height=False)
    thrusts = [1.499, 1.501, 22.99, 23.01]
    expected = [Status.BAD_THRUST, Status.OK, Status.OK, Status.BAD_THRUST]
    assert statuses(settings, np.zeros((4, 7)), np.zeros((4, 9)), thrusts) == expected


@pytest.mark.parametrize("scalar", ["float32", "fixed"])
@pytest.mark.parametrize("height", [False, True])
def test_a_command_that_is_set_is_cut_off_at_the_tilt_limit(scalar: str, height: bool) -> None:
    """Of angles that are in their range, else it is refused; with a height it has a thrust too."""
    settings = settings_with(scalar, height=height)
    controller: Any = method_of(settings).reference_controller(4)
    angles = np.array([[3.2, -0.1], [0.1, -3.2], [3.3, 0.0], [0.0, 3.3]])
    commands = np.column_stack([angles, np.full(4, 12.0)]) if height else angles
    refused = [Status.OK, Status.OK, Status.BAD_COMMAND, Status.BAD_COMMAND]
    assert controller.report_command(commands).tolist() == refused
    limit_rad = settings.limits.tilt_rad
    expected = np.array([[limit_rad, -0.1], [0.1, -limit_rad], [0.0, 0.0], [0.0, 0.0]])
    numbers = method_of(settings).numbers
    assert numbers.to_si(controller.memory.command_rad, "angle") == pytest.approx(expected, abs=1e-4)
    if height:
        thrusts = numbers.to_si(controller.memory.height.thrust_m_s2, "thrust")
        assert thrusts == pytest.approx([12.0, 12.0, 9.81, 9.81], abs=1e-4)
    assert method_of(settings).tilt_limit_rad == pytest.approx(limit_rad, rel=1e-4)


@pytest.mark.parametrize("scalar", ["float32", "fixed"])
@pytest.mark.parametrize("height", [False, True])
def test_a_jump_of_the_frame_is_taken_up_to_the_ranges(scalar: str, height: bool) -> None:
    """Of places, then of velocities, then of the heading."""
    axes = 3 if height else 2
    largest = np.diag([REACH_M] * axes + [FAST_M_S] * axes + [TURN_RAD])
    method: Any = method_of(settings_with(scalar, height=height))
    controller = method.reference_controller(len(largest))
    for factor, status in ((0.999, Status.OK), (1.001, Status.BAD_JUMP)):
        assert controller.frame_jumped(factor * largest).tolist() == [status] * len(largest)


LIMITED = {"limits.speed_m_s": 1.5, "limits.fence.x_min_m": -1.0, "limits.fence.x_max_m": 2.0}
ONE_NORM = with_option(presets.preset("mambo-1norm"), "limits.speed_m_s", 1.5)
CASES = {
    "feedback": with_option(EVERYTHING, "limits.speed_m_s", 5.0),
    "limits": settings_of(TWO_MOVES | LIMITED),
    "height, limits": settings_of(CRAZYFLIE | LIMITED),
    "height, feedback": settings_of(CRAZYFLIE | {"damping.roll_rate_feedback_s": 0.01}),
    "height, acceleration": settings_of(CRAZYFLIE | {"height.learnt": "acceleration"}),
    "height, guard": settings_of(CRAZYFLIE | {"guard.tilt_budget_rad_s": 1.0}),
    "1-norm": ONE_NORM,
    "1-norm, no tracker": with_option(ONE_NORM, "target.acceleration", "none"),
}


def stored(settings: Settings, scalar: str) -> Any:
    """Return the numbers (k,) that a controller stores after 40 updates; of the 1-norm its bounds."""
    method: Any = method_of(with_option(settings, "code.scalar", scalar))
    controller, outcome = method.reference_controller(1), None
    heights = 2 if settings.height is not None else 0
    for step in range(40):
        time_s, rattle_m_s = 0.01 * step, 0.01 * (step % 2)
        state = [0.4 + 0.3 * time_s, -0.2, 0.3, -0.4, 0.05, -0.03 + 0.1 * time_s, 0.7]
        target = [1.1 + 0.8 * time_s, 0.3, 0.8 + rattle_m_s, 0.2 - 0.3 * time_s + rattle_m_s]
        target += [0.3, -0.2] * (settings.controller.method == "quadratic")
        target += [1.2 + 0.2 * time_s, 0.2 + 0.1 * time_s + rattle_m_s][:heights]
        target += [0.1] * (len(method.target) - len(target))
        if settings.controller.method == "quadratic":
            target[-1] = 2.0
        state += [1.0 + 0.15 * time_s, 0.15, 0.0] * (heights > 0)
        given = () if heights else ([9.9],)
        outcome = controller.step([state], [target], *given)
    assert outcome is not None
    assert outcome.status.tolist() == [0]
    if settings.controller.method == "quadratic":
        return outcome.stored[0]
    return method.numbers.to_si(controller.stored_limits, *method.limits_stored)[0]


@pytest.mark.parametrize("name", CASES)
def test_fixed_point_stands_for_the_numbers_of_float64(name: str) -> None:
    """Each to 2 %, where a wrong format is wrong by a factor of 2 or more."""
    fixed, exact = (stored(CASES[name], scalar) for scalar in ("fixed", "float64"))
    assert len(fixed) == len(exact)
    counts = np.abs(exact) > 1e-7
    assert np.count_nonzero(counts) > 0.6 * len(exact)
    assert fixed[counts] == pytest.approx(exact[counts], rel=0.02, abs=1e-6)


def declared(header: str, name: str) -> dict[str, list[int]]:
    """Return the members of a structure of nmpc.h, with the lengths of arrays."""
    body = re.search(rf"typedef struct {{\n((?: .*\n)*)}} nmpc_{name}_t;", header)
    assert body is not None
    found = re.findall(r"^    \w+ (\w+)(.*?);", body[1], re.MULTILINE)
    return {member: [int(length) for length in re.findall(r"\d", array)] for member, array in found}


@pytest.mark.parametrize("name", CASES)
def test_members_of_structures_are_those_of_the_header(name: str) -> None:
    """In its order: arrays by element, and what follows from the limits by its count of numbers."""
    method: Any = method_of(CASES[name])
    header = render(CASES[name], with_digest=False)["nmpc.h"]
    for structure in ("state", "target", *["limits"] * method.has_limits):
        elements = [
            member + "".join(f"[{index}]" for index in place)
            for member, lengths in declared(header, structure).items()
            for place in product(*map(range, lengths))
        ]
        assert [number.member for number in method.port.numbers(structure)] == elements
    if method.has_limits:
        counts = {member: prod(lengths) for member, lengths in declared(header, "bounds").items()}
        port = method.port
        assert {row.member: port.count(row) for row in port.rows("bounds")} == counts
