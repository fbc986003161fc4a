"""The constants of the target tracker against their definitions: differences of places, simulations."""

from typing import Any

import numpy as np
import pytest
from scipy.linalg import solve_discrete_lyapunov
from scipy.optimize import linprog

from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.tracker_constants import (
    JERK_SHARE,
    JUMP_MARGIN,
    TrackerConstants,
    target_limit_m_s2,
)
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.support.quadratic import TWO_MOVES, settings_of

ONE_NORM = with_option(presets.preset("mambo-1norm"), "horizon.prediction_step_s", 0.15)
QUADRATIC = settings_of(TWO_MOVES)


def tracker_of(settings: Settings) -> TrackerConstants:
    """Return the constants of the tracker of a target."""
    found = method_of(settings).tracker
    assert found is not None
    return found


def test_the_factor_makes_what_is_read_an_acceleration_per_step() -> None:
    """Of a target on a parabola: the second difference of its places at steps of the prediction."""
    acceleration_m_s2, update_s = 0.7, ONE_NORM.horizon.update_period_s
    step_s = method_of(ONE_NORM).step_s
    places_m = 0.5 * acceleration_m_s2 * (step_s * np.arange(3)) ** 2
    (difference_m,) = np.diff(places_m, n=2)
    change_m_s = acceleration_m_s2 * update_s
    assert tracker_of(ONE_NORM).factor_s * change_m_s == pytest.approx(difference_m, rel=1e-12)


def largest_m_s2(settings: Settings) -> float:
    """Return the drone's largest acceleration at its tilt limit, by linear programmes for both ways."""
    limit_rad = settings.limits.tilt_rad
    bounds = [(-limit_rad, limit_rad)]
    return float(max(-linprog([-sign * GRAVITY_M_S2], bounds=bounds).fun for sign in (1, -1)))


def test_a_target_that_a_drone_cannot_follow_has_jumped() -> None:
    """From 1.5 times what the drone can."""
    most_m_s2, update_s = 1.5 * largest_m_s2(ONE_NORM), ONE_NORM.horizon.update_period_s
    assert JUMP_MARGIN == 1.5
    found, step_s = tracker_of(ONE_NORM), method_of(ONE_NORM).step_s
    assert found.change_limit_m_s == pytest.approx(most_m_s2 * update_s, rel=1e-12)
    assert found.acceleration_limit_m_step2 == pytest.approx(step_s**2 * most_m_s2, rel=1e-12)
    beyond = 1 - found.change_limit_m_s / found.tested_change_m_s
    assert beyond == pytest.approx(1 / 5), "of inputs drawn evenly"


def test_no_input_within_its_range_is_beyond_the_limit_of_a_jump() -> None:
    """The largest change of a velocity leads from one end of its range to the other."""
    slow = with_option(with_option(ONE_NORM, "ranges.velocity_m_s", 0.1), "horizon.update_period_s", 0.1)
    ends_m_s = 0.1 * np.array([-1, 1])
    assert tracker_of(slow).change_limit_m_s == pytest.approx(np.max(np.diff(ends_m_s)), rel=1e-12)


def test_the_limit_of_a_target_within_limits_is_what_the_drone_follows_or_the_range() -> None:
    """1.5 times what the tilt limit gives; or the largest thrust over mass that is accepted."""
    assert target_limit_m_s2(QUADRATIC) == pytest.approx(1.5 * largest_m_s2(QUADRATIC), rel=1e-12)
    weak = with_option(QUADRATIC, "ranges.thrust_acceleration_min_m_s2", 1.0)
    assert target_limit_m_s2(with_option(weak, "ranges.thrust_acceleration_max_m_s2", 6.0)) == 6.0


@pytest.mark.parametrize("gain", [0.1, 0.3, 0.8])
def test_the_bounds_of_the_estimates_are_those_of_the_worst_inputs(gain: float) -> None:
    """Of an acceleration whose jerk is the largest at every step, to 1 %; the jerk is a tenth of it."""
    found = tracker_of(with_option(ONE_NORM, "target.tracker_gain", gain))
    worst, jerk = 0.0, found.jerk_limit_m_step2_update
    for _ in range(3000):
        worst = (1 - gain) * (worst + jerk) + gain * found.acceleration_limit_m_step2
    assert 1.005 * worst < found.acceleration_bound_m_step2 < 1.02 * worst
    assert jerk == pytest.approx(found.acceleration_limit_m_step2 / 10, rel=1e-12)
    assert JERK_SHARE == 0.1


@pytest.mark.parametrize("gain", [0.1, 0.3, 0.8])
def test_the_gain_of_the_jerk_is_the_best_one_beside_that_of_the_acceleration(gain: float) -> None:
    """Benedict and Bordner's: no other pair has less noise and a smaller error after a change of jerk.

    So the gradients by both gains, of the variance of the estimate and of the sum of squared errors, which
    are simulated, point in opposite directions.
    """
    found = tracker_of(with_option(ONE_NORM, "target.tracker_gain", gain))
    assert found.gain == gain

    def slopes(cost: Any) -> Any:
        change = 1e-5
        return np.array(
            [
                cost(gain + change, found.jerk_gain) - cost(gain - change, found.jerk_gain),
                cost(gain, found.jerk_gain + change) - cost(gain, found.jerk_gain - change),
            ]
        )

    noise, error = slopes(_variance), slopes(_transient)
    across = noise[0] * error[1] - noise[1] * error[0]
    assert abs(across) < 1e-4 * np.linalg.norm(noise) * np.linalg.norm(error)
    assert noise @ error < 0


def _filter(gain: float, jerk_gain: float) -> tuple[Any, Any]:
    """Return transition (2, 2) and input (2,) of [acceleration, jerk]; the input is the measurement."""
    transition = np.array([[1 - gain, 1 - gain], [-jerk_gain, 1 - jerk_gain]])
    return transition, np.array([gain, jerk_gain])


def _variance(gain: float, jerk_gain: float) -> float:
    """Return the variance of the acceleration under white noise of variance 1."""
    transition, by = _filter(gain, jerk_gain)
    return float(solve_discrete_lyapunov(transition, np.outer(by, by))[0, 0])


def _transient(gain: float, jerk_gain: float) -> float:
    """Return the sum of squared errors of the predicted acceleration after a change of jerk by 1."""
    transition, by = _filter(gain, jerk_gain)
    state, total = np.zeros(2), 0.0
    for step in range(4000):
        total += (step - state[0]) ** 2
        state = transition @ state + by * (step + 1)
    return total
