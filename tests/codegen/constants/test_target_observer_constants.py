"""The constants of the target's observer against their definitions: fits, noise, and flights along curves."""

import math
from typing import Any, Final

import numpy as np
import pytest

from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.methods.quadratic.target_observer_constants import (
    TargetObserverConstants,
    largest_velocities,
)
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.support.benedict_bordner import no_pair_is_better
from tests.support.height_settings import height_settings
from tests.support.quadratic import ONE_MOVE, TWO_MOVES, Array, Axis, axis_of, settings_of
from tests.support.strategies import Values

PERIODS_S: Final = (0.005, 0.01, 0.02, 0.05)
LAWS: Final = {
    ("two moves", "roll"): TWO_MOVES,
    ("one move", "roll"): ONE_MOVE,
    ("one move", "pitch"): ONE_MOVE,
    ("no delay", "roll"): TWO_MOVES | {"model.roll_delay_s": 0.0, "model.roll_integral_1_s": 0.0},
    ("slow", "roll"): TWO_MOVES | {"horizon.update_period_s": 0.02},
}
MEAN_CHANGE: Final = 2 / math.sqrt(math.pi)


def observed(**changed: Any) -> Settings:
    """Return settings with an observer; the names of keys have __ for their dots."""
    return settings_of(TWO_MOVES | {name.replace("__", "."): value for name, value in changed.items()})


def constants_of(settings: Settings) -> TargetObserverConstants:
    """Return the constants of the observer."""
    return Quadratic(settings).target_observer


def at_period(update_s: float) -> TargetObserverConstants:
    """Return the constants at an update period."""
    return constants_of(observed(horizon__update_period_s=update_s))


def derivatives(values: Array, degree: int) -> Array:
    """Return the derivatives at the newest of (n,) values of the polynomial that fits them best."""
    polynomial = np.polyfit(np.arange(1.0 - len(values), 1.0), values, degree)
    return np.array([math.factorial(k) * polynomial[degree - k] for k in range(degree + 1)])


def step_later(fit: Array) -> Array:
    """Return derivatives (k,) of a polynomial one step later."""
    terms = [[fit[i + j] / math.factorial(j) for j in range(len(fit) - i)] for i in range(len(fit))]
    return np.array([sum(row) for row in terms])


@pytest.mark.parametrize(("degree", "update_s"), [(3, 0.01), (2, 0.01), (3, 0.05), (2, 0.05)])
def test_a_gain_makes_the_fit_of_all_values_of_that_of_all_but_the_newest(
    degree: int, update_s: float
) -> None:
    """The prediction, plus gains times what is new, is the least-squares polynomial through n values."""
    found = at_period(update_s)
    least, gains = (found.least, found.gains) if degree == 3 else (found.known_least, found.known_gains)
    values = np.random.default_rng(degree).normal(0.0, 1.0, least + len(gains))
    for row, gain in enumerate(gains):
        n = least + row
        predicted = step_later(derivatives(values[: n - 1], degree))
        fitted = predicted + gain * (values[n - 1] - predicted[0])
        np.testing.assert_allclose(fitted, derivatives(values[:n], degree), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("update_s", PERIODS_S)
def test_a_gain_is_the_weight_of_the_newest_value(update_s: float) -> None:
    """There is a row for each memory; it is what a fit makes of the newest value 1 among zeros."""
    found = at_period(update_s)
    assert found.gains.shape == (found.longest - found.least + 1, 4)
    assert found.known_gains.shape == (found.known_longest - found.known_least + 1, 3)
    for least, gains in ((found.least, found.gains), (found.known_least, found.known_gains)):
        for n, row in enumerate(gains, least):
            np.testing.assert_allclose(row, derivatives(np.eye(n)[-1], len(row) - 1), rtol=1e-7)


@pytest.mark.parametrize("update_s", PERIODS_S)
def test_memories_are_times(update_s: float) -> None:
    """As many set-points as the time holds, at least one more than the polynomial has coefficients."""
    found = at_period(update_s)
    counts = found.least, found.slow, found.first, found.longest, found.known_least, found.known_longest
    times_s, least = (0.18, 0.42, 0.32, 0.76, 0.08, 0.2), (5, 5, 5, 5, 4, 4)
    nearest = np.argmin(np.abs(np.subtract.outer(times_s, update_s * np.arange(1000))), axis=1)
    assert counts == tuple(np.maximum(nearest, least))
    assert found.least <= found.first <= found.longest
    assert found.least <= found.slow <= found.longest


def test_the_desired_velocity_is_filtered_as_benedict_and_bordner_do() -> None:
    """With a gain of 0.58 no other pair of gains is better in both, noise and the error of a ramp."""
    found = at_period(0.01)
    assert found.desired_gain == 0.58
    assert no_pair_is_better(found.desired_gain, found.desired_jerk_gain)


def test_memories_are_bounded_at_the_ends() -> None:
    """A table has at most 250 set-points; at slow updates a parabola keeps 4 and a cubic 5."""
    quick = constants_of(observed(horizon__update_period_s=0.001, observer__outage_s=0.1))
    slow = at_period(0.1)
    assert (quick.least, quick.slow, quick.first, quick.longest) == (180, 250, 250, 250)
    assert (slow.least, slow.slow, slow.first, slow.longest) == (5, 5, 5, 8)
    assert (slow.known_least, slow.known_longest) == (4, 4)


def test_at_10_ms_the_memory_grows_as_flown() -> None:
    """min(18 + 3200 h, 42 + 800 h, 76) of the noise h in m/s; min(8 + 100 h_a, 20) of that in m/s^2."""
    found = at_period(0.01)
    assert (found.least, found.slow, found.longest, found.first) == (18, 42, 76, 32)
    assert found.memory_slopes == pytest.approx((3200.0, 800.0), rel=1e-12)
    assert (found.known_least, found.known_longest) == (8, 20)
    assert found.known_slope * 0.01 == pytest.approx(100.0, rel=1e-12)


@pytest.mark.parametrize("update_s", PERIODS_S)
def test_noise_of_the_same_density_asks_for_the_same_time(update_s: float) -> None:
    """White noise whose variance times the period is the same adds as much time to the memory."""
    found, density = at_period(update_s), 0.004 * math.sqrt(0.01)
    noise = np.random.default_rng(1).normal(0.0, density / math.sqrt(update_s), 200_000)
    mean_change = float(np.abs(np.diff(noise)).mean())
    expected_s = 0.004 * MEAN_CHANGE
    for slope, s2_m in zip(found.memory_slopes, (32, 8), strict=True):
        assert slope * mean_change * update_s == pytest.approx(s2_m * expected_s, rel=0.01)
    changes = found.known_slope * (mean_change * update_s) * update_s
    assert changes == pytest.approx(1.0 * expected_s, rel=0.01), "the same noise, of accelerations"


@pytest.mark.parametrize("update_s", [*PERIODS_S, 0.1, 0.2])
def test_the_noise_is_a_mean_over_a_sixth_of_a_second(update_s: float) -> None:
    """Its share of the latest change is the period over that; it begins at 30 mm/s."""
    found = at_period(update_s)
    assert found.noise_share == pytest.approx(min(1.0, 6 * update_s), rel=1e-12)
    assert (found.first_noise, found.update_s) == (0.03, update_s)
    assert found.ahead_share == pytest.approx(update_s / 0.05, rel=1e-12)
    assert found.snap_share == pytest.approx(min(1.0, update_s / 0.1), rel=1e-12)
    assert found.half_ahead_s == 0.05 / 2


@pytest.mark.parametrize("update_s", PERIODS_S)
def test_belief_falls_where_noise_in_the_longest_memory_is_six_hundredths_of_what_the_tilt_gives(
    update_s: float,
) -> None:
    """From there to 3 times that, by the deviation of accelerations that are fitted to simulated noise."""
    settings = observed(horizon__update_period_s=update_s, limits__tilt_rad=0.4)
    found, random = constants_of(settings), np.random.default_rng(2)
    noise = random.normal(0.0, 1.0, (found.longest, 20_000))
    design = np.vander(update_s * np.arange(1.0 - found.longest, 1.0), 4)
    deviation_1_s = float(np.linalg.lstsq(design, noise, rcond=None)[0][2].std())
    sigma = 0.06 * GRAVITY_M_S2 * 0.4 / deviation_1_s
    for times, expected in ((1, 1.0), (2, 0.5), (3, 0.0)):
        mean_change = float(np.abs(np.diff(times * sigma * noise, axis=0)).mean())
        assert found.fade_top - found.fade * mean_change == pytest.approx(expected, abs=0.03)
    assert [found.fade_top, found.most_noise * found.fade] == pytest.approx([1.5, 3.0]), "bounded beyond"


def test_at_10_ms_belief_falls_as_flown() -> None:
    """1.5 - 6 h at a tilt of 0.638 rad, within 1 %; a noise is at most a quarter of the largest velocity."""
    assert constants_of(observed(limits__tilt_rad=0.638)).fade == pytest.approx(6.0, rel=0.01)
    assert constants_of(observed(ranges__velocity_m_s=1.0)).most_noise == 0.25


@pytest.mark.parametrize("update_s", PERIODS_S)
def test_limits_are_those_of_what_the_drone_can_and_a_half_more(update_s: float) -> None:
    """Along x and y by the tilt limit, up by the thrusts; derivatives by 10/s, 2.1/s^2 and 6.4/s^2."""
    settings = with_option(height_settings(), "horizon.update_period_s", update_s)
    found, height = constants_of(settings), settings.height
    assert height is not None
    assert found.climb is not None
    upward = max(height.thrust_max_m_s2 - GRAVITY_M_S2, GRAVITY_M_S2 - height.thrust_min_m_s2)
    level = GRAVITY_M_S2 * settings.limits.tilt_rad
    for limits, most in ((found.level, 1.5 * level), (found.climb, 1.5 * upward)):
        shares = [1, 10 * update_s, 2.1 * update_s**2, 6.4 * update_s**2, 1, 0.1]
        assert limits.row == pytest.approx([update_s * most * share for share in shares], rel=1e-12)
    assert found.limits == [found.level, found.climb]


def test_limits_keep_within_ranges() -> None:
    """The acceleration within that of a thrust, a jump within the largest velocity, a jerk within a step."""
    weak = constants_of(observed(ranges__thrust_acceleration_max_m_s2=5.0, limits__tilt_rad=0.5))
    assert weak.level.acceleration == pytest.approx(0.05, rel=1e-12)
    values = height_settings(thrust_max_m_s2=30.0)
    strong = constants_of(with_option(values, "ranges.thrust_acceleration_max_m_s2", 30.0)).climb
    assert strong is not None
    assert strong.acceleration == pytest.approx(0.3, rel=1e-12)
    slow = constants_of(observed(horizon__update_period_s=0.1, ranges__velocity_m_s=0.5))
    assert (slow.velocity_range, slow.level.jump) == (0.5, 0.5)
    assert slow.level.acceleration == pytest.approx(0.15 * GRAVITY_M_S2 * 0.5, rel=1e-12)
    assert slow.level.jerk == pytest.approx(slow.level.acceleration, rel=1e-12)


def test_at_the_slowest_updates_every_derivative_may_change_by_the_acceleration_and_no_more() -> None:
    """In a step of 0.8 s; a mean has no more than the latest change in it."""
    found = constants_of(settings_of(ONE_MOVE | {"horizon.update_period_s": 0.8}))
    limits = found.level
    assert [limits.jerk, limits.snap, limits.known_snap] == [limits.acceleration] * 3
    assert (found.noise_share, found.snap_share) == (1.0, 1.0)


def test_tables_end_with_the_longest_memory_and_memories_are_drawn_from_one_below_the_least() -> None:
    """A row each; a memory grows by one before it is used."""
    found = at_period(0.01)
    assert (found.least + found.last_row, found.known_least + found.known_last_row) == (76, 20)
    assert found.least_drawn == 17


def test_no_prediction_and_no_change_of_what_is_new_exceeds_its_bound() -> None:
    """Of any fit within limits; and of set-points at the ends of their range, with the largest noise."""
    found = constants_of(height_settings())
    random, bounds = np.random.default_rng(6), largest_velocities(found)
    for limits, (predicted, changed) in zip(found.limits, np.reshape(bounds, (2, 2)), strict=True):
        most = [found.velocity_range, limits.acceleration, limits.jerk, limits.snap]
        fits = random.choice([-1.0, 1.0], (1000, 4)) * most
        largest = max(abs(step_later(fit)[0]) for fit in fits)
        assert largest < predicted
        assert predicted == pytest.approx(found.velocity_range + 3 * limits.acceleration, rel=1e-12)
        trusted = limits.jump + 4 * found.most_noise
        assert changed == pytest.approx(2 * found.velocity_range + trusted, rel=1e-12)


def test_without_a_height_there_are_no_limits_of_one() -> None:
    """And there is no tracker."""
    assert Quadratic(observed()).tracker is None
    found = constants_of(observed())
    assert (found.climb, found.limits) == (None, [found.level])


def fly(axis: Axis, row: Array, snap_s: float, degree: int) -> tuple[Array, Array, float]:
    """Fly a modelled drone along a target whose acceleration is t^degree / degree!, at first in its place.

    row (8,) is the law's, in SI units. Returns distances (n,), the last of them and the last state (8,) at
    t = 0, and the command that follows.
    """
    plant = axis.transition.copy()
    plant[:, 2:4] = 0
    steps, command = round(30.0 / axis.period_s), 0.0
    state, distances, seen = np.zeros(8), [], np.zeros(8)
    for step in range(steps + 1):
        time_s = (step - steps) * axis.period_s
        place, velocity, acceleration, jerk, snap = (
            time_s**k / math.factorial(k) if k >= 0 else 0.0 for k in range(degree + 2, degree - 3, -1)
        )
        if step == 0:
            state[:2] = place, velocity
        seen = state - [place, velocity, acceleration, 0, 0, 0, 0, 0]
        seen[3] = jerk + snap_s * snap
        distances.append(seen[0])
        command = float(row @ seen)
        state = plant @ state + axis.change * (command - state[7])
    return np.array(distances), seen, command


def without_distance(axis: Axis, row: Array) -> Array:
    """Return a row (8,) in SI units that takes of a constant acceleration what follows it exactly.

    The law's own disturbance decays within 1000 s, which leaves some um.
    """
    found = row.copy()
    found[2] = 0.0
    less = fly(axis, found, 0.0, 0)[0][-1]
    found[2] = -1.0
    found[2] = -less / (less - fly(axis, found, 0.0, 0)[0][-1])
    return found


def in_si(axis: Axis, row: Any) -> Array:
    """Return a row (8,) for steps in SI units; what an axis does not have is 0."""
    found: Array = np.divide(row, axis.scale, out=np.zeros(8), where=axis.scale != 0)
    return found


def first_move(values: Values, angle: str) -> tuple[Array, float, Axis]:
    """Return the first move's row in SI units, its share of the snap, and the axis."""
    settings, k = settings_of(values), ("roll", "pitch").index(angle)
    axis, law = axis_of(settings, angle), Quadratic(settings).law
    own = in_si(axis, law.rows[k, 0])
    row = without_distance(axis, own)
    assert row[2] == pytest.approx(own[2], rel=1e-3)
    return row, float(law.snap_s[k]), axis


def settled(axis: Axis, row: Array, snap_s: float, degree: int) -> float:
    """Return the largest distance over the last second."""
    distances = fly(axis, row, snap_s, degree)[0]
    return float(np.abs(distances[-round(1 / axis.period_s) :]).max())


@pytest.mark.parametrize(("name", "angle"), LAWS)
def test_the_first_move_follows_jerk_and_snap_without_a_distance(name: str, angle: str) -> None:
    """Within 0.1 um of a constant one; without the share of the snap that leaves more than 40 um."""
    row, snap_s, axis = first_move(LAWS[name, angle], angle)
    assert [settled(axis, row, snap_s, degree) < 1e-7 for degree in range(3)] == [True] * 3
    assert settled(axis, row, 0.0, 2) > 4e-5


@pytest.mark.parametrize("name", ["two moves", "no delay", "slow"])
def test_the_second_move_looks_ahead_by_a_third_of_the_ramp(name: str) -> None:
    """Of a constant jerk: it is the command that follows, and what the jerk adds to it in that time."""
    settings = settings_of(LAWS[name, "roll"])
    axis = axis_of(settings, "roll")
    first, second = (in_si(axis, row) for row in Quadratic(settings).law.rows[0])
    _, seen, command = fly(axis, without_distance(axis, first), 0.0, 1)
    assert second @ seen == pytest.approx(command + settings.horizon.ramp_s / 3, abs=1e-6)


def test_the_height_follows_jerk_and_snap_without_a_distance() -> None:
    """By the lag and the delay of the thrust."""
    settings = height_settings()
    height, found = settings.height, Quadratic(settings).height
    assert height is not None
    assert found is not None
    values = settings.model_dump(exclude_none=True)
    values["cost"] |= {name: getattr(height, name) for name in ("response_time_s", "velocity_weight_s")}
    values["damping"]["roll_rate_feedback_s"] = 0.0
    values["model"] |= {"roll_lag_s": height.lag_s, "roll_delay_s": height.delay_s, "roll_integral_1_s": 0.0}
    axis = axis_of(Settings.model_validate(values), "roll")
    first, second = (in_si(axis, np.insert(row, 5, 0.0)) for row in found.rows)
    row = without_distance(axis, first)
    assert [settled(axis, row, found.snap_s, degree) < 1e-7 for degree in range(3)] == [True] * 3
    _, seen, command = fly(axis, row, 0.0, 1)
    assert second @ seen == pytest.approx(command + settings.horizon.ramp_s / 3, abs=1e-6)
