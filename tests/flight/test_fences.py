"""Fences set in flight, metrics of limits against slow loops over drawn flights, and how both are shown."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mambo_codegen.methods import method_of
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.errors import FlightError
from mambo_sil.flight import loop
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.adjusted import AdjustedController
from mambo_sil.flight.engine.native import is_native
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.fences import (
    LIMIT_METRICS,
    fenced,
    measure_limits,
    nears_limit,
    square_fence,
    walls_m,
    with_limits,
)
from mambo_sil.flight.flight_marks import FlightMarks
from mambo_sil.flight.flight_plots import draw_flight, flight_columns
from mambo_sil.flight.flight_report import RepeatSummary, judge
from mambo_sil.flight.scenario import Scenario, flight_of
from mambo_sil.flight.traces import Trace
from mambo_sil.results.blocks import ResultTable
from mambo_sil.results.folders import SUMMARY
from mambo_sil.results.metric_names import titled
from mambo_sil.results.terminal import result_text
from tests.support.height_settings import height_settings
from tests.support.tools import toolchain

MAMBO = presets.preset("mambo")
ONE_NORM = with_option(presets.preset("mambo-1norm"), "limits.speed_m_s", 2.0)
FLIGHTS, SAMPLES = 120, 30


def level_trace(step_s: float, position_m: Any, velocity_m_s: Any, target: Any) -> Trace:
    """Return flights with such samples, `step_s` apart, of drones that stay level."""
    shape = position_m.shape[:2]
    return Trace(
        time_s=step_s * np.arange(shape[0], dtype=np.float64),
        position_m=position_m,
        velocity_m_s=velocity_m_s,
        euler_rad=np.zeros((*shape, 3)),
        target=target,
        command_rad=np.zeros((*shape, 2)),
        thrust_acceleration_m_s2=np.full(shape, 9.81),
        status=np.zeros(shape, np.int64),
    )


def drawn(seed: int, columns: int = 4) -> Trace:
    """Return random walks about the origin with samples half a second apart, to targets that jump twice.

    Every fourth target rests at the end, as many only along x or y; some never jump.
    """
    rng = np.random.default_rng(seed)
    shape = SAMPLES, FLIGHTS
    position_m = np.cumsum(rng.normal(0, 0.4, (*shape, 3)), axis=0) + rng.normal(0, 1, (FLIGHTS, 3))
    jumps = np.repeat(rng.normal(0, 1, (3, FLIGHTS, columns)), SAMPLES // 3, axis=0)
    target = jumps * np.where(np.arange(FLIGHTS) % 5 == 0, 0.0, 1.0)[:, None]
    target[0, :, :2] *= 0.8
    target[-1, :, :2] *= 1.2
    target[-1, ::2, 2:4] = 0.0
    target[-1, ::4, 2] = 0.3
    target[-1, 1::4, 2] = 0.0
    target[0, 1::2, 2:4] = target[1, 1::2, 2:4] = 0.0
    return level_trace(0.5, position_m, rng.normal(0, 2, (*shape, 3)), target)


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
    """The largest speed over the limit; the largest error from 10 s on, be it large or small."""
    trace = drawn(4)
    trace.position_m[:, ::2] *= 0.01
    trace.target[:, ::2] *= 0.01
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
    trace.position_m[-1, 0] = trace.velocity_m_s[-1, 0] = np.nan
    trace.position_m[-1, 1] = 0.0
    for fence_m, fenced_too in ((0.0, False), (1.0, True)):
        found = measure_limits(trace, MAMBO, [Scenario(fence_m=fence_m)] * FLIGHTS)
        for values in vars(found).values():
            assert np.isnan(values).tolist() == [True] + [False] * (FLIGHTS - 1)
        assert found.past_wall_m[1:].any() == fenced_too


def test_walls_are_those_of_the_settings_and_of_a_fence_in_flight() -> None:
    """Beside each other; without either there are none, and without [height] no floor and no ceiling."""
    settings = walled({"z": 0.5}, {"z": 1.5})
    assert walls_m(settings, 2.0) == (-2.0, -2.0, 0.5, 2.0, 2.0, 1.5)
    assert walls_m(settings.model_copy(update={"height": None})) is None
    assert walls_m(MAMBO) is walls_m(walled({"z": 0.0}, {"z": 0.0})) is None


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
        places = {"speed_m_s": [0], "braking_m_s2": [1], "fence_min_m": [2, 3], "fence_max_m": [4, 5]}
        places |= {"tilt_rad": [6]}
        if settings.height is not None:
            places |= {"floor_m": [7], "ceiling_m": [8], "climb_m_s": [9], "descent_m_s": [10]}
        assert list(limiting.named) == list(places)
        for name, columns in places.items():
            expected = limiting.limits.copy()
            expected[columns] = 0.123
            assert with_limits(settings, **{name: [0.123] * len(columns)}) == tuple(expected.tolist())
        with pytest.raises(KeyError, match="speed_limit"):
            with_limits(settings, speed_limit=1.0)
    assert square_fence(2.5) == {"fence_min_m": (-2.5, -2.5), "fence_max_m": (2.5, 2.5)}
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


def scenarios(count: int) -> list[Scenario]:
    """Return a flight without a fence, and flights whose fence comes while they are outside of it."""
    circle = Scenario(trajectory="circle", size_m=2.0, rate_rad_s=0.5, duration_s=4.0)
    fence = circle.model_copy(update={"fence_m": 1.0, "fence_time_s": 1.0})
    return [circle, *(fence.model_copy(update={"yaw_rad": 0.7 * one}) for one in range(1, count))]


def trace_of(x_m: list[float], speed_m_s: list[float], target_x_m: list[float]) -> Trace:
    """Return a flight along x with samples 5 s apart, whose target moves by jumps."""
    shape = len(x_m), 1
    position_m, velocity_m_s, target = np.zeros((*shape, 3)), np.zeros((*shape, 3)), np.zeros((*shape, 4))
    position_m[:, 0, 0], velocity_m_s[:, 0, 1], target[:, 0, 0] = x_m, speed_m_s, target_x_m
    return level_trace(5.0, position_m, velocity_m_s, target)


FLOWN = trace_of([0.0, 2.5, 3.5, 3.0], [0.0, 5.5, -6.0, 0.0], [0.0, 3.0, 3.0, 3.0])


@pytest.mark.long
def test_the_picture_of_a_flight_has_its_walls(tmp_path: Path) -> None:
    """One line for each wall, and none without a fence; floor and ceiling in the picture of the height."""
    trace = trace_of([0.0, 1.0], [0.0, 0.0], [0.0, 1.0])
    heights = np.zeros((2, 1, 2))
    spatial = replace(trace, target=np.concatenate([trace.target, heights], axis=-1))
    fences = {"two": walls_m(walled({"z": 0.5}, {"z": 1.5})), "nothing": None, "four": walls_m(MAMBO, 2.0)}
    dashes = []
    for name, walls in fences.items():
        for flown in (trace, spatial):
            draw_flight(flown, "", "", tmp_path / name, FlightMarks(walls))
            dashes.append((tmp_path / f"{name}.svg").read_text("utf-8").count("stroke-dasharray"))
    assert dashes == [0, 2, 0, 0, 4, 4]


@pytest.mark.long
def test_the_picture_of_a_fast_flight_has_its_speed_limit(tmp_path: Path) -> None:
    """With the speed over time; a flight slower than half of the limit, or without one, has neither."""
    fast = trace_of([0.0, 4.0], [0.0, 4.0], [0.0, 8.0])
    shown = {}
    for limit_m_s in (0.0, 5.0, 9.0):
        draw_flight(fast, "", "", tmp_path / "fast", FlightMarks(speed_limit_m_s=limit_m_s))
        drawn = (tmp_path / "fast.svg").read_text("utf-8")
        shown[limit_m_s] = drawn.count("stroke-dasharray"), drawn.count("speed, m/s")
    assert shown == {0.0: (0, 0), 5.0: (1, 1), 9.0: (0, 0)}


@pytest.mark.long
def test_the_picture_on_a_page_has_fence_and_speed_too() -> None:
    """The speed over time, and a line for each wall and the limit."""
    fast = trace_of([0.0, 4.0], [0.0, 4.0], [0.0, 8.0])
    marks = FlightMarks(), FlightMarks(walls_m(MAMBO, 2.0), 5.0)
    plain, near = (flight_columns({"fast": fast}, given)[0] for given in marks)
    assert ["speed, m/s" in one for one in (plain, near)] == [False, True]
    assert [one.count("stroke-dasharray") for one in (plain, near)] == [0, 5]
    assert ["from above, speed, distance" in one for one in (plain, near)] == [False, True]


def test_a_summary_says_how_a_flight_keeps_its_limits(tmp_path: Path) -> None:
    """Past the wall with a fence; over the speed limit if the flight came near it; read again, the same."""
    shown = {}
    slow = replace(FLOWN, velocity_m_s=FLOWN.velocity_m_s * 0.4)
    cases = {
        "pd": (FLOWN, MAMBO, None),
        "no limits": (FLOWN, presets.preset("table1"), Scenario()),
        "slow": (slow, MAMBO, Scenario()),
        "fast": (FLOWN, MAMBO, Scenario()),
        "walls": (slow, walled({"y": -1.0}, {"y": 1.0}), Scenario()),
        "both": (FLOWN, MAMBO, Scenario(fence_m=2.0)),
    }
    for name, (trace, settings, scenario) in cases.items():
        judged = judge(trace, settings, NOMINAL, scenario)
        summary = RepeatSummary(
            repeat=name,
            scenario=Scenario(),
            controller="nmpc",
            settings=None,
            same_bits_as_recorded=None,
            same_bits_as_host=None,
            **judged,
        )
        summary.write(tmp_path)
        again = RepeatSummary.model_validate_json((tmp_path / SUMMARY).read_text("utf-8"))
        text = result_text(again.result(tmp_path))
        assert ("past the wall" in text) == (name in ("walls", "both"))
        assert ("speed over the limit" in text) == (name in ("fast", "both"))
        assert ("walls_m" in summary.text()) == (again.walls_m is not None) == (name in ("walls", "both"))
        assert again.speed_limit_m_s == (5.0 if name in ("fast", "both") else None)
        shown[name] = {key: again.metrics[key] for key in LIMIT_METRICS if key in again.metrics}
        (table,) = (one for one in summary.result(tmp_path).blocks if isinstance(one, ResultTable))
        assert len(table.rows) == len(again.metrics)
    assert shown["pd"] == shown["no limits"] == shown["slow"] == {}
    assert shown["fast"] == pytest.approx({"speed_excess": 0.2})
    assert shown["walls"] == {"past_wall_m": 0.0}
    assert shown["both"] == pytest.approx({"speed_excess": 0.2, "past_wall_m": 1.5})


def test_metrics_of_limits_have_plain_names() -> None:
    """In tables, pages and pictures."""
    assert titled("past_wall_m") == "past the wall, m"
    assert titled("seen_speed_excess") == "speed over the limit as estimated, share"


@pytest.mark.parametrize("settings", [MAMBO, ONE_NORM], ids=["quadratic", "1-norm"])
def test_a_fence_in_flight_has_the_bits_of_python(settings: Settings) -> None:
    """The drone is outside when it comes, and flies in; the flight without a fence stays outside."""
    toolchain("gcc")
    chosen = scenarios(3)
    flight = flight_of(chosen, settings.horizon.update_period_s)
    flown = [fenced(CompiledController(settings, 3), settings, chosen, flight) for _ in range(2)]
    assert is_native(flown[0])
    trace = fly(flight, flown[0])
    assert trace.same_bits(loop.fly(flight, flown[1]))
    outside = np.abs(trace.position_m[-1, :, :2]).max(axis=1)
    assert outside[0] > 1.5
    assert (outside[1:] < 1.1).all()


def test_flights_without_a_fence_have_their_controller() -> None:
    """Itself, and no wrapper."""
    one = scenarios(1)
    flight, controller = flight_of(one, 0.01), CompiledController(MAMBO, 1)
    assert fenced(controller, MAMBO, one, flight) is controller


def test_a_fence_wants_limits() -> None:
    """Settings without limits have no nmpc_set_limits."""
    with pytest.raises(FlightError, match="no limits"):
        with_limits(presets.preset("table1"), **square_fence(1.0))


@pytest.mark.long
def test_the_picture_of_a_crash_has_a_cross_and_says_so(tmp_path: Path) -> None:
    """In the path, with a name in the legend, and a line over time; above it the message and the flight."""
    drawn = {}
    for crash_s in (math.nan, 5.0):
        _, svg = draw_flight(FLOWN, "CRASHED", "mambo", tmp_path / "flight", FlightMarks(crash_s=crash_s))
        drawn[crash_s] = svg.read_text("utf-8")
    assert [">crash<" in one for one in drawn.values()] == [False, True]
    assert [one.count("#d55e00") > 3 for one in drawn.values()] == [False, True]
    assert all(">CRASHED<" in one and ">mambo<" in one for one in drawn.values())
