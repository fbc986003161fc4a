"""The constants of the limits against their definitions: linear programmes, tangents, what is refused."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq, linprog, minimize_scalar

from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.methods.shared.limits import ActiveLimit, LimitsLaw
from mambo_codegen.methods.shared.limits_constants import (
    BRAKING_SHARE,
    SPELLING,
    LimitsConstants,
    limits_bits,
)
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.model import Settings
from tests.support.height import CRAZYFLIE
from tests.support.quadratic import (
    ANGLES,
    ONE_MOVE,
    TWO_MOVES,
    axis_of,
    settings_of,
    settling_steps,
    two_move_cost,
)
from tests.support.strategies import Values

WORST_ROLL: Values = {
    "model.roll_gain": 0.8,
    "model.pitch_gain": 1.1,
    "model.roll_trim_rad": -0.04,
    "model.pitch_trim_rad": 0.02,
    "model.acceleration_per_tilt": 0.9,
}
WORST_PITCH: Values = {
    "model.roll_gain": 1.2,
    "model.pitch_gain": 0.9,
    "model.roll_trim_rad": 0.01,
    "model.pitch_trim_rad": -0.05,
}
PLAIN: Values = {}
"""Drones of which one axis has both the smaller gain and the larger trim; and one without trims."""


def limited(values: Values, **limits: Any) -> Settings:
    """Return settings in float64 with a speed limit of 2 m/s and other limits."""
    return settings_of(
        TWO_MOVES
        | {"code.scalar": "float64", "limits.speed_m_s": 2.0}
        | values
        | {f"limits.{name}": value for name, value in limits.items()}
    )


def constants_of(settings: Settings) -> LimitsConstants:
    """Return the constants of settings that have limits."""
    found = method_of(settings).limiting
    assert found is not None
    return found


def deceleration_m_s2(settings: Settings) -> float:
    """Return what the tilt limit gives along the axis of the heading, either way, along which it gives least.

    A linear programme for each: the largest acceleration by commands within the limit.
    """
    model, limit_rad = settings.model, settings.limits.tilt_rad
    slope = GRAVITY_M_S2 * model.acceleration_per_tilt
    gains = {"roll": slope * model.roll_gain, "pitch": -slope * model.pitch_gain}
    at_rest = {"roll": slope * model.roll_trim_rad, "pitch": -slope * model.pitch_trim_rad}
    most = []
    for angle, sign in itertools.product(ANGLES, (1, -1)):
        found = linprog([-sign * gains[angle]], bounds=[(-limit_rad, limit_rad)])
        most.append(-found.fun - sign * at_rest[angle])
    return float(min(most))


@pytest.mark.parametrize("values", [WORST_ROLL, WORST_PITCH, PLAIN])
def test_the_braking_is_what_the_tilt_limit_gives_whatever_the_heading(values: Values) -> None:
    """Of a braking that is not given its share, and the largest that the controller lets be set the whole."""
    settings = limited(values)
    worst_m_s2, found = deceleration_m_s2(settings), constants_of(settings)
    assert found.tilted.at(settings.limits.tilt_rad) == pytest.approx(worst_m_s2, rel=1e-12)
    assert found.limits[1] == pytest.approx(BRAKING_SHARE * worst_m_s2, rel=1e-12)
    assert 1.0 < SPELLING < 1.001

    def is_refused(braking_m_s2: float) -> float:
        limits = found.limits.copy()
        limits[1] = braking_m_s2
        return -1.0 if controller(settings).set_limits([limits])[0] == Status.OK else 1.0

    assert brentq(is_refused, 0.5 * worst_m_s2, 2.0 * worst_m_s2, xtol=1e-6) == pytest.approx(
        worst_m_s2, rel=1e-3
    )


def test_of_two_axes_that_each_hinder_the_braking_counts_as_both() -> None:
    """The smaller gain of one and the larger trim of the other: never more than there is."""
    mixed = limited({"model.roll_gain": 0.8, "model.pitch_gain": 1.1, "model.pitch_trim_rad": 0.05})
    both = limited({"model.roll_gain": 0.8, "model.pitch_gain": 1.1, "model.roll_trim_rad": 0.05})
    at_limit = [constants_of(one).tilted.at(one.limits.tilt_rad) for one in (mixed, both)]
    assert at_limit[0] == at_limit[1] == pytest.approx(deceleration_m_s2(both), rel=1e-12)
    assert at_limit[0] < deceleration_m_s2(mixed)


def controller(settings: Settings) -> Any:
    """Return the reference controller of settings."""
    return method_of(settings).reference_controller(1)


@pytest.mark.parametrize("height", [False, True])
def test_a_limit_that_is_not_set_is_the_widest_that_may_be_set(height: bool) -> None:
    """Speed, walls, floor and ceiling: the controller takes them, and refuses any that are wider."""
    settings = settings_of(
        (CRAZYFLIE if height else TWO_MOVES) | {"code.scalar": "float64", "limits.braking_m_s2": 2.0}
    )
    widest = constants_of(settings).limits
    assert len(widest) == (11 if height else 7)
    unset = {0: 1, 2: -1, 3: -1, 4: 1, 5: 1, 6: 1} | ({7: -1, 8: 1} if height else {})
    assert controller(settings).set_limits([widest]).tolist() == [Status.OK]
    for index, outwards in unset.items():
        for change, status in ((1e-6, Status.BAD_LIMITS), (-1e-6, Status.OK)):
            limits = widest.copy()
            limits[index] += outwards * change
            assert controller(settings).set_limits([limits]).tolist() == [status], index


def test_limits_that_are_set_are_those_of_the_settings() -> None:
    """In the order of nmpc_limits_t; a fence may have walls along one axis alone."""
    walls = {"x_min_m": -1.0, "x_max_m": 2.0, "floor_m": -0.5, "ceiling_m": 3.0}
    height = {"height.climb_m_s": 0.7, "height.descent_m_s": 0.6}
    settings = limited(
        CRAZYFLIE | height,
        braking_m_s2=1.5,
        tilt_rad=0.4,
        **{f"fence.{name}": m for name, m in walls.items()},
    )
    reach_m = settings.ranges.position_m
    expected = [2.0, 1.5, -1.0, -reach_m, 2.0, reach_m, 0.4, -0.5, 3.0, 0.7, 0.6]
    assert constants_of(settings).limits.tolist() == expected
    other = limited(CRAZYFLIE, **{"fence.y_min_m": -3.0, "fence.y_max_m": 4.0})
    assert constants_of(other).limits[[2, 3, 4, 5, 7, 8]].tolist() == [
        -reach_m,
        -3.0,
        reach_m,
        4.0,
        -reach_m,
        reach_m,
    ]


@pytest.mark.parametrize("values", [ONE_MOVE, TWO_MOVES | {"model.pitch_lag_s": 0.25}])
def test_the_approach_rate_is_that_of_the_slower_axis(values: Values) -> None:
    """K_e / K_v of the law whose cost is simulated, in 1/s."""
    settings = limited(values)
    rates_1_s = []
    for angle in ANGLES:
        axis = axis_of(settings, angle)
        steps = settling_steps(settings)
        if axis.ramp:
            curvature, slope = two_move_cost(axis, steps)
            row = np.linalg.solve(curvature, slope)[0]
        else:
            row = stationary_gain(axis)
        rates_1_s.append(row[0] / row[1])
    assert abs(rates_1_s[0] - rates_1_s[1]) > 1e-3
    assert constants_of(settings).approach_1_s == pytest.approx(min(rates_1_s), rel=1e-7)


def stationary_gain(axis: Any) -> Any:
    """Return the gain of one free move, by steps of dynamic programming until nothing changes."""
    to_go = axis.state_cost
    for _ in range(3000):
        closed = axis.transition - np.outer(axis.change, gain := axis.gain(to_go))
        to_go = axis.state_cost + (closed.T @ to_go @ closed) + (axis.change_cost * np.outer(gain, gain))
    return axis.gain(to_go)


def desired_m_s(settings: Settings, distance_m: Any) -> tuple[Any, Any]:
    """Return desired speeds (n,) towards targets at rest at distances (n,), and which limits act (n,)."""
    method = method_of(settings)
    law, distance_m = LimitsLaw(method, constants_of(settings)), np.atleast_1d(distance_m)
    bounds = law.bounds(np.repeat(law.defaults, len(distance_m), axis=0))
    target = np.column_stack([distance_m, np.zeros((len(distance_m), 3))])
    velocity, active = law._desire(bounds, bounds.speed_m_s, np.zeros((len(distance_m), 2)), target)
    return velocity[:, 0], active


def test_braking_begins_and_ends_where_its_curve_touches_the_line() -> None:
    """The line v = k d touches v^2 = 2 A (d - d_0) at the knee; fed forward it ends nearer."""
    braking_m_s2 = 1.3
    settings = limited({}, braking_m_s2=braking_m_s2, speed_m_s=20.0)
    found = constants_of(settings)
    k = found.approach_1_s

    def nearest(start_m: float) -> Any:
        """Return where the line lies least above the curve from `start_m`, and by how much."""
        return minimize_scalar(
            lambda d: k * d - math.sqrt(2 * braking_m_s2 * (d - start_m)),
            bounds=(start_m, start_m + 10.0),
            method="bounded",
            options={"xatol": 1e-12},
        )

    start_m = brentq(lambda start_m: float(nearest(start_m).fun), 1e-6, 5.0, xtol=1e-12)
    knee_m = nearest(start_m).x
    assert 2 * braking_m_s2 * found.knee_s2 == pytest.approx(knee_m, rel=1e-5)
    distances_m = np.linspace(1e-3, 3 * knee_m, 20_001)
    speeds_m_s, active = desired_m_s(settings, distances_m)
    first_m = distances_m[np.flatnonzero(active == ActiveLimit.BRAKING)[0]]
    assert first_m == pytest.approx(2 * braking_m_s2 * found.near_s2, abs=2 * distances_m[0])
    share = first_m / knee_m
    assert share == pytest.approx(0.7, abs=2e-3)
    limit_active = active != 0
    steepest_1_s = max(k, np.max(speeds_m_s[limit_active] / distances_m[limit_active]))
    assert found.steepest_1_s == pytest.approx(steepest_1_s, rel=2e-3)
    ahead_m = distances_m[limit_active] + knee_m - first_m
    expected_m_s = np.sqrt(2 * braking_m_s2 * (ahead_m - start_m))
    assert speeds_m_s[limit_active] == pytest.approx(expected_m_s, abs=2e-3)


@pytest.mark.parametrize("braking_m_s2", [0.3, 2.0])
def test_formats_hold_their_largest_value_and_are_as_fine_as_that_allows(braking_m_s2: float) -> None:
    """The largest fits in 31 bits, and twice as much would not; braking has three bits more to spare."""
    settings = limited(WORST_ROLL, braking_m_s2=braking_m_s2)
    found = constants_of(settings)
    gives_m_s2 = deceleration_m_s2(
        limited(WORST_ROLL | {"model.roll_trim_rad": 0.0, "model.pitch_trim_rad": 0.0})
    )
    largest = {
        "braking": 8 * 2 * gives_m_s2,
        "approach": found.steepest_1_s,
        "knee": found.knee_s2,
        "slope": gives_m_s2 / settings.limits.tilt_rad,
    }
    bits = limits_bits(found, velocity=20, position=19)
    for name, value in largest.items():
        share = value * 2.0 ** bits[name] / 2**31
        assert 0.49 < share < 1.0, name
    assert limits_bits(found, velocity=15, position=25)["approach"] == 19
    assert set(limits_bits(None, 20, 20).values()) == {0}
    assert limits_bits(None, 20, 20).keys() == bits.keys()


def test_limits_at_the_ends_of_the_ranges_are_allowed() -> None:
    """A speed as large as the range, walls at its ends, the braking that the tilt limit gives."""
    base = {"ranges.velocity_m_s": 3.0, "ranges.position_m": 50.0}
    most_m_s2 = constants_of(limited(base)).tilted.at(0.5)
    fence = {"fence.x_min_m": -50.0, "fence.x_max_m": 50.0}
    settings = limited(base, speed_m_s=3.0, braking_m_s2=most_m_s2, **fence)
    assert constants_of(settings).limits[:5].tolist() == [3.0, most_m_s2, -50.0, -50.0, 50.0]
    with pytest.raises(ValueError, match="x_min_m"):
        limited(base, speed_m_s=3.0, **{"fence.x_min_m": -51.0, "fence.x_max_m": 49.0})


def test_numbers_of_fixed_point_stand_for_the_limits() -> None:
    """Each limit has the format of its quantity, as what follows from it in the controller shows."""
    walls = {
        "x_min_m": -1.0,
        "x_max_m": 2.0,
        "y_min_m": -3.0,
        "y_max_m": 1.5,
        "floor_m": -0.5,
        "ceiling_m": 3.0,
    }
    fence = {f"fence.{name}": place_m for name, place_m in walls.items()}
    height = {"height.climb_m_s": 0.7, "height.descent_m_s": 0.6, "code.scalar": "fixed"}
    settings = limited(CRAZYFLIE | height, braking_m_s2=1.5, tilt_rad=0.4, **fence)
    method, memory = method_of(settings), controller(settings).memory
    bounds, lift = memory.limits.bounds, memory.height_bounds

    def si(number: Any, quantity: str) -> list[float]:
        return [float(one) for one in np.ravel(method.numbers.to_si(np.atleast_1d(number), quantity))]

    assert si(bounds.speed_m_s, "velocity") == pytest.approx([2.0], rel=1e-4)
    assert si(bounds.braking, "braking") == pytest.approx([3.0], rel=1e-4)
    assert si(bounds.centre_m, "position") == pytest.approx([0.5, -0.75], rel=1e-4)
    assert si(bounds.clear_m + bounds.margin_m[:, None], "position") == pytest.approx([1.5, 2.25], rel=1e-4)
    assert si(bounds.tilt_rad, "angle") == pytest.approx([0.4], rel=1e-4)
    assert si([lift.floor_m, lift.ceiling_m], "position") == pytest.approx([-0.5, 3.0], rel=1e-4)
    up_m, down_m = si([lift.up_m, lift.down_m], "position")
    assert up_m / down_m == pytest.approx(0.7 / 0.6, rel=1e-4)
    stored = controller(settings).step(np.zeros((1, 10)), np.zeros((1, 13))).stored[0].tolist()
    first = next(
        at for at in range(len(stored)) if stored[at : at + 2] == pytest.approx([0.5, -0.75], rel=1e-4)
    )
    clear_x_m, clear_y_m, margin_m, knee_m, near_m, *others = stored[first + 2 : first + 10]
    assert [clear_x_m + margin_m, clear_y_m + margin_m] == pytest.approx([1.5, 2.25], rel=1e-4)
    assert margin_m == pytest.approx(2.0**2 / 3.0 + knee_m / 2, rel=1e-3), "2 m/s, and half the knee"
    assert near_m in (pytest.approx(knee_m, rel=1e-3), pytest.approx(0.7 * knee_m, rel=1e-3))
    assert others == pytest.approx([2.0, 3.0, 0.4], rel=1e-4)


@pytest.mark.parametrize(
    ("limits", "has"),
    [
        ({}, False),
        ({"limits.fence.y_max_m": 1.0, "limits.fence.y_min_m": -1.0}, True),
        ({"limits.speed_m_s": 1.0}, True),
        ({"limits.braking_m_s2": 1.0}, True),
        ({"limits.tilt_rad": 0.3}, False),
    ],
)
def test_speed_braking_or_a_fence_alone_give_a_1_norm_limits(limits: Values, has: bool) -> None:
    """A tilt limit, which every controller has, does not."""
    assert (method_of(settings_of(limits)).limiting is not None) is has


def test_a_quadratic_controller_brakes_without_a_key() -> None:
    """By 0.8 of what the tilt limit gives; its speed ends at the range of velocities, and no wall stands."""
    settings = settings_of(TWO_MOVES)
    limiting, ranges = method_of(settings).limiting, settings.ranges
    assert limiting is not None
    speed_m_s, braking_m_s2, *walls_m, _ = limiting.limits
    assert (speed_m_s, braking_m_s2) == (ranges.velocity_m_s, pytest.approx(0.8 * 9.81 * 0.5))
    assert walls_m == [-ranges.position_m, -ranges.position_m, ranges.position_m, ranges.position_m]
