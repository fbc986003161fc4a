"""Metrics of limits against slow loops over drawn flights, and when a fence is set."""

from typing import Any

import numpy as np
import pytest

from mambo_codegen.methods import method_of
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.adjusted import AdjustedController
from mambo_sil.flight.fences import (
    fenced,
    measure_limits,
    nears_limit,
    square_fence,
    walls_m,
    with_limits,
)
from mambo_sil.flight.scenario import Scenario, flight_of
from mambo_sil.flight.traces import Trace
from tests.support.height_settings import height_settings

MAMBO = presets.preset("mambo")
FLIGHTS, SAMPLES = 120, 30


def drawn(seed: int, columns: int = 4) -> Trace:
    """Return random walks about the origin with samples half a second apart, to targets that jump twice.

    Every fourth target rests at the end, as many only along x or y; some never jump.
    """
    rng = np.random.default_rng(seed)
    shape = SAMPLES, FLIGHTS
    position_m = np.cumsum(rng.normal(0, 0.4, (*shape, 3)), axis=0) + rng.normal(0, 1, (FLIGHTS, 3))
    jumps = np.repeat(rng.normal(0, 1, (3, FLIGHTS, columns)), SAMPLES // 3, axis=0)
    target = jumps * np.where(np.arange(FLIGHTS) % 5 == 0, 0.0, 1.0)[:, None]
    target[-1, :, :2] *= 1.2
    target[-1, ::2, 2:4] = 0.0
    target[-1, ::4, 2] = 0.3
    target[-1, 1::4, 2] = 0.0
    target[0, 1::2, 2:4] = target[1, 1::2, 2:4] = 0.0
    return Trace(
        time_s=0.5 * np.arange(SAMPLES, dtype=np.float64),
        position_m=position_m,
        velocity_m_s=rng.normal(0, 2, (*shape, 3)),
        euler_rad=np.zeros((*shape, 3)),
        target=target,
        command_rad=np.zeros((*shape, 2)),
        thrust_acceleration_m_s2=np.full(shape, 9.81),
        status=np.zeros(shape, np.int64),
    )


LOW, HIGH = dict.fromkeys(("x", "y", "z"), -np.inf), dict.fromkeys(("x", "y", "z"), np.inf)
"""No walls, by their axes; the height is up."""


def walled(low: dict[str, float], high: dict[str, float]) -> Settings:
    """Return preset mambo with walls, with a height the Crazyflie's."""
    base = height_settings() if "z" in low else MAMBO
    document = base.model_dump(exclude_none=True)
    document["limits"]["fence"] |= {f"{axis}_min_m": place_m for axis, place_m in low.items() if axis != "z"}
    document["limits"]["fence"] |= {f"{axis}_max_m": place_m for axis, place_m in high.items() if axis != "z"}
    if "z" in low:
        document["limits"]["fence"] |= {"floor_m": low["z"], "ceiling_m": high["z"]}
    return Settings.model_validate(document)


def outside_m(walls: Any, place_m: Any) -> float:
    """Return the distance by which a place is beyond the wall that it is farthest beyond."""
    x_m, y_m, down_m = place_m
    up = (x_m, y_m, -down_m)
    low, high = walls[:3], walls[3:]
    beyond = [wall - one for wall, one in zip(low, up, strict=True)]
    beyond += [one - wall for wall, one in zip(high, up, strict=True)]
    return float(max(0.0, *beyond))


def past_wall_m(trace: Trace, row: int, walls: Any, since_s: float) -> float:
    """Return the largest distance outside behind the first sample inside, or of all if there is none."""
    found, all_of_it, was_inside = 0.0, 0.0, False
    for time_s, place_m in zip(trace.time_s, trace.position_m[:, row], strict=True):
        if time_s < since_s:
            continue
        beyond = outside_m(walls, place_m)
        was_inside = was_inside or beyond == 0.0
        found = max(found, beyond) if was_inside else 0.0
        all_of_it = max(all_of_it, beyond)
    return found if was_inside else all_of_it


@pytest.mark.parametrize(
    ("low", "high"),
    [
        ({"x": -1.5}, {"x": 0.5}),
        ({"y": -0.5}, {"y": 2.0}),
        ({"x": -1.0, "y": -3.5}, {"x": 3.0, "y": 1.0}),
        ({"x": -1.0, "y": 0.0}, {"x": 0.0, "y": 1.0}),
        ({"x": -2.0}, {"x": -1.0}),
        ({"x": 1.0}, {"x": 2.0}),
        ({"y": -2.0}, {"y": -1.0}),
        ({"y": 1.0}, {"y": 2.0}),
        ({"z": -0.5}, {"z": 2.5}),
        ({"z": -2.0}, {"z": -1.0}),
        ({"x": -1.0, "z": 0.0}, {"x": 2.0, "z": 1.5}),
    ],
)
def test_past_a_wall_of_the_settings_is_that_of_a_slow_loop(
    low: dict[str, float], high: dict[str, float]
) -> None:
    """From the first sample inside on, whatever the time of a fence in flight that there is not."""
    trace, settings = drawn(1), walled(low, high)
    walls = (*(LOW | low).values(), *(HIGH | high).values())
    expected = [past_wall_m(trace, row, walls, -np.inf) for row in range(FLIGHTS)]
    assert walls_m(settings) == walls
    for one in (Scenario(), Scenario(fence_time_s=5.0)):
        assert measure_limits(trace, settings, [one] * FLIGHTS).past_wall_m.tolist() == expected


def square(half_m: float) -> tuple[float, ...]:
    """Return the walls of a square fence."""
    return (-half_m, -half_m, -np.inf, half_m, half_m, np.inf)


def test_past_a_fence_in_flight_is_that_of_a_slow_loop() -> None:
    """From the sample at the time of the fence on, which counts; into some fences no drone comes."""
    trace, times_s = drawn(2), 0.25 * (np.arange(FLIGHTS) % 59)
    scenarios = [
        Scenario(fence_m=0.01 if row % 3 else 0.5 + 0.04 * row, fence_time_s=time_s, duration_s=20.0)
        for row, time_s in enumerate(times_s.tolist())
    ]
    expected = [
        past_wall_m(trace, row, square(one.fence_m), one.fence_time_s) for row, one in enumerate(scenarios)
    ]
    found = measure_limits(trace, MAMBO, scenarios).past_wall_m
    assert found.tolist() == expected
    assert len(set(expected)) > FLIGHTS / 2


@pytest.mark.parametrize("columns", [4, 6])
def test_overshoot_is_the_farthest_projection_beyond_the_last_target(columns: int) -> None:
    """On the line from the first target; 0 if the last one moves, or is the first; on any course."""
    trace, expected = drawn(3, columns), []
    for row in range(FLIGHTS):
        first, last, moves = trace.target[0, row, :2], trace.target[-1, row, :2], trace.target[-1, row, 2:4]
        way_m = last - first
        rests = np.any(way_m != 0.0) and np.all(moves == 0.0)
        line = way_m / np.linalg.norm(way_m) if rests else np.zeros(2)
        expected.append(max(0.0, *((place_m[:2] - last) @ line for place_m in trace.position_m[:, row])))
    found = measure_limits(trace, MAMBO, [Scenario()] * FLIGHTS).overshoot_m
    assert found == pytest.approx(expected, abs=1e-12)
    assert FLIGHTS / 20 < np.count_nonzero(found) < FLIGHTS / 2


def test_speed_and_late_error_are_those_of_a_slow_loop() -> None:
    """The largest speed over the limit; the largest error from 10 s on."""
    trace = drawn(4)
    found = measure_limits(trace, MAMBO, [Scenario()] * FLIGHTS)
    for row in range(FLIGHTS):
        speed_m_s = max(np.hypot(*velocity[:2]) for velocity in trace.velocity_m_s[:, row])
        assert found.speed_excess[row] == pytest.approx(max(speed_m_s / 5.0 - 1.0, 0.0), abs=1e-12)
        errors_m = [
            np.hypot(*(place_m[:2] - target[:2]))
            for time_s, place_m, target in zip(
                trace.time_s, trace.position_m[:, row], trace.target[:, row], strict=True
            )
            if time_s >= 10.0
        ]
        assert found.late_error_m[row] == pytest.approx(max(errors_m), rel=1e-12)


def test_a_flight_that_is_lost_at_its_end_has_no_metrics() -> None:
    """Also without a fence; one that ends at the origin has."""
    trace = drawn(5)
    trace.position_m[-1, 0] = np.nan
    trace.position_m[-1, 1] = 0.0
    found = measure_limits(trace, MAMBO, [Scenario()] * FLIGHTS).past_wall_m
    assert np.isnan(found[0])
    assert found[1:].tolist() == [0.0] * (FLIGHTS - 1)


@pytest.mark.parametrize("period_s", [0.01, 0.025])
def test_a_fence_is_set_before_the_update_nearest_to_its_time(period_s: float) -> None:
    """However the time is rounded, and counted from take-off too."""
    settings = with_option(MAMBO, "horizon.update_period_s", period_s)
    times_s = np.concatenate([period_s * np.arange(5, 60, 7), np.random.default_rng(0).uniform(0, 2, 20)])
    for start in ("hover", "take-off"):
        scenarios = [
            Scenario(fence_m=1.5, fence_time_s=time_s, duration_s=3.0, start=start)
            for time_s in times_s.tolist()
        ]
        flight = flight_of(scenarios, period_s)
        found = fenced(CompiledController(settings, len(scenarios)), settings, scenarios, flight)
        assert isinstance(found, AdjustedController)
        for row, one in enumerate(found._adjustments):
            assert (one.row, one.setter) == (row, "set_limits")
            assert one.update == np.argmin(np.abs(flight.times_s() - times_s[row]))
            assert one.values[2:6] == (-1.5, -1.5, 1.5, 1.5)


def test_numbers_of_the_limits_are_changed_by_their_names() -> None:
    """Each changes its own and no other, with a height and without."""
    for settings in (MAMBO, with_option(height_settings(), "limits.speed_m_s", 3.0)):
        limiting = method_of(settings).limiting
        assert limiting is not None
        names = ["speed", "braking", "x_min", "y_min", "x_max", "y_max", "tilt"]
        names += ["floor", "ceiling", "climb", "descent"] if settings.height is not None else []
        for index, name in enumerate(names):
            expected = limiting.limits.tolist()
            expected[index] = 0.123
            assert with_limits(settings, **{name: 0.123}) == tuple(expected)
    assert square_fence(2.5) == {"x_min": -2.5, "y_min": -2.5, "x_max": 2.5, "y_max": 2.5}
    assert walls_m(MAMBO, 2.5) == square(2.5)


@pytest.mark.parametrize("limit_m_s", [0.5, 8.0])
def test_a_flight_shows_its_speed_beyond_half_of_the_limit(limit_m_s: float) -> None:
    """By the first flight; without a limit none does."""
    trace = drawn(6)
    for share, shows in ((0.49, False), (0.51, True)):
        trace.velocity_m_s[..., :2] = 0.0
        trace.velocity_m_s[7, 0, 0] = share * limit_m_s
        trace.velocity_m_s[7, 1] = 100.0
        assert nears_limit(trace, limit_m_s) is shows
        assert nears_limit(trace, 0.0) is False
