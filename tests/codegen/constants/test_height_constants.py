"""The constants of the height against their definitions: simulated costs, flights, linear programmes."""

import itertools
from typing import Any, Final

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_are
from scipy.optimize import linprog

from mambo_codegen.methods import method_of
from mambo_codegen.methods.quadratic.attitude_constants import MOST_WEIGHT
from mambo_codegen.methods.quadratic.height_constants import (
    COSINE_TERMS,
    DESCENT_SHARE,
    LEAST_COSINE,
    LEAST_WEIGHT,
    STEEPEST_RAD,
    HeightConstants,
    jump_m_s2,
)
from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.methods.quadratic.reciprocal import Reciprocal
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.model import Settings
from tests.support.height import CRAZYFLIE
from tests.support.quadratic import ONE_MOVE, Axis, axis_of, settings_of, settling_steps, two_move_cost
from tests.support.strategies import Values

EXACT: Final[Values] = CRAZYFLIE | {"code.scalar": "float64"}
DELAYED: Final[Values] = EXACT | {
    "height.delay_s": 0.04,
    "height.response_time_s": 0.3,
    "height.velocity_weight_s": 0.4,
    "height.descent_m_s": 1.1,
    "height.climb_m_s": 1.7,
    "horizon.update_period_s": 0.02,
}
ONE: Final[Values] = ONE_MOVE | {
    "code.scalar": "float64",
    "height.lag_s": 0.05,
    "height.learnt_gain_limit": 0.2,
    "height.thrust_max_m_s2": 25.0,
    "height.thrust_gain": 1.6,
    "height.thrust_min_m_s2": 4.0,
    "height.climb_m_s": 0.8,
    "height.descent_m_s": 0.5,
}
CASES: Final = {"two moves": EXACT, "delay, 50 Hz": DELAYED, "one move": ONE}


def height_of(settings: Settings) -> HeightConstants:
    """Return the constants of settings that have a height."""
    found = Quadratic(settings).height
    assert found is not None
    return found


def axis_like_roll(settings: Settings) -> tuple[Settings, Axis]:
    """Return settings whose roll answers as the thrust does, with the costs of the height; and its axis."""
    height = settings.height
    assert height is not None
    model = {"roll_lag_s": height.lag_s, "roll_delay_s": height.delay_s, "roll_integral_1_s": 0.0}
    cost = {"response_time_s": height.response_time_s, "velocity_weight_s": height.velocity_weight_s}
    like = settings.model_copy(
        update={
            "model": settings.model.model_copy(update=model),
            "cost": settings.cost.model_copy(update=cost),
            "damping": settings.damping.model_copy(update={"roll_rate_feedback_s": 0.0}),
        }
    )
    return like, axis_of(like, "roll")


@pytest.fixture(params=CASES)
def settings(request: pytest.FixtureRequest) -> Settings:
    """Each of the cases."""
    return settings_of(CASES[request.param])


def test_the_law_is_the_minimum_of_a_simulated_cost(settings: Settings) -> None:
    """Rows less the jerk, in steps, and the ratio of the second derivatives; and their approach rate."""
    like, axis = axis_like_roll(settings)
    found = height_of(settings)
    columns, kept = [0, 1, 2, 4, 5, 6], [0, 1, 2, 4, 6, 7]
    if axis.ramp:
        curvature, slope = two_move_cost(axis, settling_steps(like))
        rows, ratio = -np.linalg.solve(curvature, slope), curvature[0, 1] / curvature[0, 0]
    else:
        to_go = solve_discrete_are(
            axis.transition, axis.change[:, None], axis.state_cost, np.array([[axis.change_cost]])
        )
        rows, ratio = np.eye(8)[7:] - axis.gain(to_go), 0.0
    assert found.rows[:, columns] == pytest.approx((rows * axis.scale)[:, kept], rel=1e-7, abs=1e-12)
    assert found.ratio == pytest.approx(ratio, rel=1e-8)
    still_m_s = -rows[0, 0] / rows[0, 1]
    assert still_m_s * found.reach_steps * axis.period_s == pytest.approx(-1.0, rel=1e-7)


def test_the_model_of_the_thrust_is_the_exact_solution_for_a_held_command(settings: Settings) -> None:
    """By SciPy's matrix exponential of lag and delay."""
    height, period_s = settings.height, settings.horizon.update_period_s
    assert height is not None
    lag, follow = 1 / height.lag_s, 1 / (height.delay_s or period_s)
    a = [-lag, lag, 0.0] if height.delay_s else [-lag, 0.0, lag]
    exact = expm(period_s * np.array([a, [0.0, -follow, follow], [0.0, 0.0, 0.0]]))
    found = height_of(settings)
    assert found.thrust_row == pytest.approx(exact[0], rel=1e-9, abs=1e-12)
    assert found.lagged_row == pytest.approx(exact[1, 1:], rel=1e-9)


def test_units_are_those_of_differences_of_places(settings: Settings) -> None:
    """Second differences of the places of a body that falls, or has the least or the largest thrust."""
    found, height, period_s = height_of(settings), settings.height, settings.horizon.update_period_s
    assert height is not None

    def difference_m(acceleration_m_s2: float) -> float:
        return float(np.diff(0.5 * acceleration_m_s2 * (period_s * np.arange(3)) ** 2, n=2)[0])

    assert found.gravity_m_step2 == pytest.approx(difference_m(GRAVITY_M_S2), rel=1e-12)
    assert found.per_gravity * difference_m(GRAVITY_M_S2) == pytest.approx(1.0, rel=1e-12)
    delivered_m = difference_m(height.thrust_gain)
    assert found.step2_s2 == pytest.approx(delivered_m, rel=1e-12)
    assert found.steps2_per_s2 * delivered_m == pytest.approx(1.0, rel=1e-12)
    least, most = height.thrust_min_m_s2, height.thrust_max_m_s2
    assert found.thrust_m_step2 == pytest.approx((difference_m(least), difference_m(most)), rel=1e-12)
    lifts = (*found.thrust_m_step2, found.gravity_m_step2)
    assert delivered_m * np.array(found.command_m_s2) == pytest.approx(lifts, rel=1e-12)


@pytest.mark.parametrize("learn", ["gain", "acceleration", "none"])
def test_the_observer_s_gain_is_the_riccati_equation_s(learn: str) -> None:
    """SciPy's, in steps; that of a learnt gain of the thrust, whose effect is g, over g."""
    settings = settings_of(DELAYED | {"height.learnt": learn, "height.disturbance_noise": 1.7})
    observer, period_s = settings.observer, settings.horizon.update_period_s
    transition = np.array([[1, period_s, period_s**2 / 2], [0, 1, period_s], [0, 0, 1]])
    process = np.diag([0, observer.acceleration_noise**2, 1.7**2]) * period_s
    noise = np.diag([observer.position_noise**2, observer.velocity_noise**2]) / period_s
    spread = solve_discrete_are(transition.T, np.eye(3)[:2].T, process, noise)
    gain = spread[:, :2] @ np.linalg.inv(spread[:2, :2] + noise)
    gain = gain * np.array([[period_s ** (row - column) for column in range(2)] for row in range(3)])
    found = height_of(settings)
    if learn == "gain":
        lifts = [(1 + change) * found.gravity_m_step2 - found.gravity_m_step2 for change in (-1e-3, 1e-3)]
        gain[2] /= np.diff(lifts)[0] / 2e-3
    assert found.gain == pytest.approx(gain, rel=1e-9)
    assert (found.learns_gain, found.learns_acceleration) == (learn == "gain", learn == "acceleration")


class PointMass:
    """n drones that move up and down: thrust with the lag of the settings, over `load` times the mass."""

    def __init__(self, settings: Settings, loads: tuple[float, ...]) -> None:
        height = settings.height
        assert height is not None
        self._lag_s, self._period_s = height.lag_s, settings.horizon.update_period_s
        self._gain, self._load = height.thrust_gain, np.array(loads)
        self.place_m = self.climb_m_s = np.zeros(len(loads))
        self._thrust_m_s2 = np.full(len(loads), GRAVITY_M_S2)

    def fly(self, controller: Any, target_m: Any, seconds: float) -> Any:
        """Fly to heights (n,); return the climbs (steps, n)."""
        n, climbs = len(self.place_m), []
        for _ in range(round(seconds / self._period_s)):
            state = np.zeros((n, 10))
            state[:, 7], state[:, 8] = self.place_m, self.climb_m_s
            target = np.zeros((n, len(controller._constants.target)))
            target[:, 6] = target_m
            commanded_m_s2 = self._gain * controller.step(state, target).thrust_m_s2
            for _ in range(20):
                self._step(commanded_m_s2, self._period_s / 20)
            climbs.append(self.climb_m_s)
        return np.array(climbs)

    def _step(self, commanded_m_s2: Any, step_s: float) -> None:
        self._thrust_m_s2 = self._thrust_m_s2 + (commanded_m_s2 - self._thrust_m_s2) * step_s / self._lag_s
        self.climb_m_s = self.climb_m_s + step_s * (self._thrust_m_s2 / self._load - GRAVITY_M_S2)
        self.place_m = self.place_m + step_s * self.climb_m_s


@pytest.mark.parametrize("limits", [{}, {"limits.speed_m_s": 2.0}], ids=["without limits", "with limits"])
@pytest.mark.parametrize("case", CASES)
def test_a_far_target_is_approached_at_the_largest_climb_and_descent(case: str, limits: Values) -> None:
    """A point mass on its way far up and far down, at a steady speed."""
    settings = settings_of(CASES[case] | limits)
    height = settings.height
    assert height is not None
    assert height.climb_m_s != height.descent_m_s
    controller = method_of(settings).reference_controller(2)
    climbs_m_s = PointMass(settings, (1.0, 1.0)).fly(controller, [40.0, -40.0], 3.0)
    expected = [height.climb_m_s, -height.descent_m_s]
    assert climbs_m_s[-1] == pytest.approx(expected, rel=5e-3)
    found = height_of(settings)
    rate_1_s = 1 / (found.reach_steps * settings.horizon.update_period_s)
    assert [found.up_m * rate_1_s, found.down_m * rate_1_s] == pytest.approx(
        [height.climb_m_s, height.descent_m_s], rel=1e-12
    )


@pytest.mark.parametrize(
    ("learn", "key", "limit"),
    [("gain", "learnt_gain_limit", 0.3), ("acceleration", "learnt_acceleration_limit_m_s2", 1.962)],
)
def test_what_is_learnt_ends_at_the_limit_of_the_settings(learn: str, key: str, limit: float) -> None:
    """Of a heavy and a light drone in flight: a share of the thrust, or an acceleration."""
    settings = settings_of(EXACT | {"height.learnt": learn, f"height.{key}": limit})
    controller: Any = method_of(settings).reference_controller(3)
    loads = (2.0, 0.5, 1.1)
    PointMass(settings, loads).fly(controller, 0.0, 1.0)
    state, period_s = controller.memory.height, settings.horizon.update_period_s
    if learn == "gain":
        learnt, within = state.gain - 1, 1 / 1.1 - 1
    else:
        learnt, within = state.disturbance_m_step2 / period_s**2, -0.1 * GRAVITY_M_S2
    assert learnt[:2] == pytest.approx([-limit, limit], rel=1e-9)
    assert learnt[2] == pytest.approx(within, abs=0.05 if key == "learnt_gain_limit" else 0.5)
    assert abs(learnt[2]) < limit


def test_no_acceleration_of_the_model_is_beyond_its_limit(settings: Settings) -> None:
    """By all thrusts, learnt gains and tilts at their ends; and the limit is one of those."""
    found, height = height_of(settings), settings.height
    assert height is not None
    deviation = height.learnt_gain_limit if height.learnt == "gain" else 0.0
    gravity, (least, most) = found.gravity_m_step2, found.thrust_m_step2
    reached = [
        gain * cosine * thrust - gravity
        for gain, cosine, thrust in itertools.product(
            (1 - deviation, 1 + deviation), (LEAST_COSINE, 1.0), (0.0, least, most)
        )
    ]
    assert found.limit_m_step2 == pytest.approx(np.max(np.abs(reached)), rel=1e-12)


def test_the_limit_of_weak_thrust_is_that_of_a_fall() -> None:
    """Where the thrust lifts less than gravity draws."""
    weak = height_of(
        settings_of(
            EXACT | {"height.thrust_max_m_s2": 11.0, "height.learnt": "none", "height.descent_m_s": 0.1}
        )
    )
    assert weak.limit_m_step2 == weak.gravity_m_step2


def test_climb_and_descent_are_braked_by_the_thrust_there_is(settings: Settings) -> None:
    """A speed that falls at the approach rate decelerates most at once: by what the thrust can give."""
    found, height, period_s = height_of(settings), settings.height, settings.horizon.update_period_s
    assert height is not None
    time_s = np.linspace(0.0, 1.0, 100_001)
    for most_m_s, thrust_m_s2, share in zip(
        found.most_m_s, (height.thrust_min_m_s2, height.thrust_max_m_s2), (1.0, DESCENT_SHARE), strict=True
    ):
        speed_m_s = most_m_s * np.exp(-time_s / (found.reach_steps * period_s))
        steepest_m_s2 = np.max(-np.gradient(speed_m_s, time_s, edge_order=2))
        assert steepest_m_s2 == pytest.approx(share * abs(thrust_m_s2 - GRAVITY_M_S2), rel=1e-4)
    assert DESCENT_SHARE == 0.7


@pytest.mark.parametrize("name", ["climb_m_s", "descent_m_s"])
def test_settings_refuse_speeds_that_cannot_be_braked(name: str) -> None:
    """The largest is allowed, and what the message says is the largest with three decimals."""
    index = ("climb_m_s", "descent_m_s").index(name)
    most_m_s = height_of(settings_of(EXACT)).most_m_s[index]
    assert settings_of(EXACT | {f"height.{name}": most_m_s}).height is not None
    said = f"at most {np.floor(most_m_s * 1e3) / 1e3:g}, which the drone can brake"
    with pytest.raises(ValueError, match=said):
        settings_of(EXACT | {f"height.{name}": most_m_s + 1e-9})
    with pytest.raises(ValueError, match=r"height.(climb|descent)_m_s|must be at most 0.4,"):
        settings_of(EXACT | {"ranges.velocity_m_s": 0.4, f"height.{name}": 0.5})


def test_settings_refuse_a_thrust_that_is_no_command() -> None:
    """The end of the range is allowed."""
    assert settings_of(EXACT | {"ranges.thrust_acceleration_max_m_s2": 15.2}).height is not None
    with pytest.raises(ValueError, match=r"height\.thrust_max_m_s2\n  must be at most 15\.1"):
        settings_of(EXACT | {"ranges.thrust_acceleration_max_m_s2": 15.1})


def inverse(found: Reciprocal, x: Any) -> Any:
    """Return 1/x as the C computes it, in float64."""
    y = found.start - found.slope * x
    for step in range(found.steps):
        y = y * ((found.two if step == found.steps - 1 else 2.0) - y * x)
    return y


def best_line(low: float, high: float) -> tuple[float, float, float]:
    """Return A, B and the error e of the line A - B x that makes the largest |1 - x (A - B x)| least.

    A linear programme over a grid of x.
    """
    x = np.linspace(low, high, 2001)
    rows = np.column_stack([x, -(x**2), np.zeros_like(x)])
    error = np.array([0, 0, 1])
    above, below = rows - error, -rows - error
    bounds = np.concatenate([np.ones_like(x), -np.ones_like(x)])
    found = linprog(error, A_ub=np.concatenate([above, below]), b_ub=bounds, bounds=[(None, None)] * 3)
    start, slope, least = found.x.tolist()
    return start, slope, least


@pytest.mark.parametrize(
    "values", [{}, {"height.learnt_gain_limit": 0.2}, {"height.learnt": "none"}, {"model.tilt": "exact"}]
)
def test_reciprocals_have_the_best_line_and_the_error_they_say(values: Values) -> None:
    """Over the shares of the thrust that tilt and learnt gain make, and over the weights of a tilt."""
    settings = settings_of(EXACT | values)
    found, height = height_of(settings), settings.height
    assert height is not None
    deviation = height.learnt_gain_limit if height.learnt == "gain" else 0.0
    vector = Quadratic(settings).thrust_vector
    least_share = 0.3 if vector else LEAST_COSINE
    lines = [
        (found.thrust_inverse, least_share * (1 - deviation), 1 + deviation, 3e-4),
        (found.weight_inverse, LEAST_WEIGHT, MOST_WEIGHT, 3e-4),
    ]
    if vector:
        lines += [(vector.share_inverse, 0.3, 1.0, 1e-6), (vector.steep_inverse, 1.0, 4.0, 1e-6)]
    for reciprocal, low, high, allowed in lines:
        start, slope, line_error = best_line(low, high)
        assert (reciprocal.start, reciprocal.slope) == pytest.approx((start, slope), rel=1e-4)
        x = np.linspace(low, high, 100_001)
        error = x * inverse(reciprocal, x) - 1
        if reciprocal is not found.weight_inverse:
            assert -reciprocal.error * (1 + 1e-9) - 1e-15 <= error.min() <= -0.99 * reciprocal.error
            assert error.max() <= 1e-12
            assert reciprocal.two == 2.0
        else:
            assert error.min() >= 0.0, "never too small"
            assert 1e-6 < error.min() < 2e-5
            assert 0.98 * reciprocal.error < error.max() <= reciprocal.error * 1.01
        fewest = next(steps for steps in range(10) if line_error ** (2**steps) <= allowed)
        assert reciprocal.steps == fewest
        line = reciprocal.start - reciprocal.slope * x
        assert max(line.max(), inverse(reciprocal, x).max()) < reciprocal.most < 1.02 / low


def test_the_cosine_is_close_where_it_counts() -> None:
    """Within 9e-4 where cos x is more than the least one, and no larger beyond the steepest angle."""
    x = np.linspace(0, STEEPEST_RAD, 10_001)
    second, fourth = COSINE_TERMS
    found = 1 - x**2 * (second - fourth * x**2)
    counts = np.cos(x) > LEAST_COSINE
    assert np.max(np.abs(found - np.cos(x))[counts]) < 9e-4
    assert np.all(found[~counts] < LEAST_COSINE + 9e-4)
    assert np.cos(STEEPEST_RAD) < LEAST_COSINE


@pytest.mark.parametrize(("least", "most", "jump"), [(2.0, 12.0, 11.715), (8.0, 16.0, 9.285)])
def test_a_target_jumps_with_half_more_than_what_the_thrust_gives(
    least: float, most: float, jump: float
) -> None:
    """Down from the largest thrust or up from the least one, whichever is more."""
    height = settings_of(EXACT).height
    assert height is not None
    bounds = {"thrust_min_m_s2": least, "thrust_max_m_s2": most}
    assert jump_m_s2(height.model_copy(update=bounds)) == pytest.approx(jump)
