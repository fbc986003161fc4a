"""A target that says where it goes: the law that knows it, and what is refused."""

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from mambo_codegen.methods.quadratic.law import state_names
from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings.controller_toml import with_option
from tests.support.height import CRAZYFLIE
from tests.support.quadratic import TWO_MOVES, Array, Axis, axis_of, settings_of
from tests.support.strategies import Values

PREVIEW = CRAZYFLIE | {
    "target.acceleration": "preview",
    "code.scalar": "float64",
    "height.response_time_s": 0.3,
    "height.descent_m_s": 0.5,
    "height.climb_m_s": 0.5,
}
ACCELERATIONS = [3, 8, 9, 10, 11, 12, 13]
"""Columns of a row: the target's acceleration now and ahead."""
AHEAD_S = np.linspace(0.0, 0.3, 7)


def best_moves(axis: Axis, ahead: Array, steps: int) -> Array:
    """Return the free moves for accelerations of the target (7,), by least squares over all commands.

    The motion of the target is integrated in short steps; behind the preview its jerk fades in a second.
    """
    moves = 2 if axis.ramp else 1
    free = steps - axis.ramp - 1
    states, unknown = np.zeros((8, moves + free + 1)), np.eye(moves + free + 1)
    rows, last = [], round(AHEAD_S[-1] / axis.period_s)
    for step in range(steps):
        if step == last:
            states[2, -1], states[3, -1] = -ahead[6], (ahead[6] - ahead[5]) / 0.05
        if step == 0:
            change = unknown[0]
        elif step <= axis.ramp:
            change = (unknown[1] - unknown[0]) / axis.ramp
        else:
            change = unknown[moves + step - axis.ramp - 1]
        rows += [states[0], np.sqrt(axis.state_cost[1, 1]) * states[1], np.sqrt(axis.change_cost) * change]
        states = (axis.transition @ states) + np.outer(axis.change, change)
        if step < last:
            times_s = (np.arange(400) + 0.5) / 400 * axis.period_s
            given = np.interp((step * axis.period_s) + times_s, AHEAD_S, ahead)
            states[0, -1] -= np.mean(given * (axis.period_s - times_s)) * axis.period_s
            states[1, -1] -= np.mean(given) * axis.period_s
    problem = np.array(rows)
    found: Array = np.linalg.lstsq(problem[:, :-1], -problem[:, -1], rcond=None)[0][:moves]
    return found


@pytest.mark.parametrize(("period_s", "ramp_s"), [(0.025, 0.4), (0.025, 0.1), (0.05, 0.3), (0.05, 0.0)])
def test_the_law_is_the_least_cost_of_all_commands(period_s: float, ramp_s: float) -> None:
    """For a ramp that is longer than the preview, shorter, as long, and none."""
    settings = settings_of(PREVIEW | {"horizon.update_period_s": period_s, "horizon.ramp_s": ramp_s})
    rows, axis = Quadratic(settings).law.rows[1][:, ACCELERATIONS], axis_of(settings, "pitch")
    for ahead in np.eye(7):
        moves = best_moves(axis, ahead, round(6.0 / period_s))
        assert rows @ ahead / period_s**2 == pytest.approx(moves, rel=2e-4, abs=2e-5)


def test_what_is_not_ahead_is_as_without_a_preview() -> None:
    """A steady acceleration counts as a disturbance against it; the other gains are those of the settings."""
    settings = settings_of(PREVIEW)
    without = Quadratic(with_option(settings, "target.acceleration", "none"))
    assert " ".join(state_names(settings)) == "e v w p0 a i c u p1 p2 p3 p4 p5 p6"
    law, height = Quadratic(settings).law, Quadratic(settings).height
    assert height is not None
    assert without.height is not None
    np.testing.assert_array_equal(
        law.rows[:, :, [0, 1, 2, 4, 5, 6, 7]], without.law.rows[:, :, [0, 1, 2, 4, 5, 6, 7]]
    )
    np.testing.assert_array_equal(law.ratios, without.law.ratios)
    np.testing.assert_array_equal(
        height.rows[:, [0, 1, 2, 4, 5, 6]], without.height.rows[:, [0, 1, 2, 4, 5, 6]]
    )
    steady = law.rows[:, :, ACCELERATIONS].sum(axis=2) / 0.01**2
    np.testing.assert_allclose(steady, -law.rows[:, :, 2], rtol=2e-3)


def inputs(n: int) -> tuple[Array, Array]:
    """Return states (n, 10) and targets (n, 27) of drones that hover at a height of 1 m."""
    state, target = np.zeros((n, 10)), np.zeros((n, 27))
    state[:, 7] = target[:, 6] = 1.0
    return state, target


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 50.1, -50.1])
def test_a_preview_out_of_range_is_refused(value: float) -> None:
    """Every number of it, with the status of a bad target; the drone holds its command."""
    controller = Quadratic(settings_of(PREVIEW)).reference_controller(19)
    state, target = inputs(19)
    controller.step(state, target)
    for row in range(18):
        target[row, 9 + row] = value
    step = controller.step(state, target)
    assert step.status.tolist() == [Status.BAD_TARGET] * 18 + [Status.OK]
    np.testing.assert_array_equal(step.command_rad[:18], 0.0)


def test_the_drone_tilts_before_the_target_turns() -> None:
    """Towards an acceleration that is still to come, the more the nearer it is; and climbs before it."""
    controller = Quadratic(settings_of(PREVIEW)).reference_controller(4)
    state, target = inputs(4)
    target[1, 9 + (3 * 5) + 1] = target[2, 9 + (3 * 2) + 1] = 2.0
    target[3, 9 + (3 * 2) + 2] = 2.0
    step: Any = controller.step(state, target)
    roll = step.command_rad[:, 0]
    assert roll[0] == roll[3] == 0.0
    assert roll[2] > 1e-3
    assert roll[1] != 0.0
    assert step.thrust_m_s2[3] > step.thrust_m_s2[0] + 1e-2


def test_nothing_of_a_preview_is_kept() -> None:
    """The controller stores as many numbers as one without: a target that is late changes nothing of it."""
    settings = settings_of(PREVIEW)
    without = with_option(settings, "target.acceleration", "none")
    assert Quadratic(settings).stored == Quadratic(without).stored


@pytest.mark.parametrize("base", [{}, TWO_MOVES])
def test_a_preview_needs_a_height(base: Values) -> None:
    """With neither method; the message says what else there is."""
    with pytest.raises(ValidationError, match=r'must be "given", "tracked" or "none" without \[height\]'):
        settings_of(base | {"target.acceleration": "preview"})
