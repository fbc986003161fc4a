"""Fences set in flight, and metrics of limits."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.errors import FlightError
from mambo_sil.flight import loop
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.native import is_native
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.fences import (
    LIMIT_METRICS,
    LimitMetrics,
    fenced,
    measure_limits,
    square_fence,
    walls_m,
    with_limits,
)
from mambo_sil.flight.flight_plots import draw_flights, flight_columns
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
    return Trace(
        time_s=np.arange(0.0, 5.0 * len(x_m), 5.0),
        position_m=position_m,
        velocity_m_s=velocity_m_s,
        euler_rad=np.zeros((*shape, 3)),
        target=target,
        command_rad=np.zeros((*shape, 2)),
        thrust_acceleration_m_s2=np.full(shape, 9.81),
        status=np.zeros(shape, np.int64),
    )


FLOWN = trace_of([0.0, 2.5, 3.5, 3.0], [0.0, 5.5, -6.0, 0.0], [0.0, 3.0, 3.0, 3.0])


def between(floor_m: float, ceiling_m: float) -> Settings:
    """Return settings of a controller of the height with a floor and a ceiling."""
    fence = {"limits.fence.ceiling_m": ceiling_m, "limits.fence.floor_m": floor_m}
    settings = height_settings()
    for name, wall in fence.items():
        settings = with_option(settings, name, wall)
    return settings


def values(found: LimitMetrics) -> list[float]:
    """Return the metrics of one flight."""
    return [float(value[0]) for value in vars(found).values()]


def test_metrics_of_a_step_are_those_of_its_samples() -> None:
    """6 m/s over a limit of 5; half a metre beyond the target; 1.5 m outside; an error of .5 m after 10 s."""
    assert values(measure_limits(FLOWN, MAMBO, [Scenario(fence_m=2.0)])) == pytest.approx(
        [0.2, 0.5, 1.5, 0.5]
    )


def test_without_a_fence_nothing_is_past_a_wall() -> None:
    """And a target that moves at the end has no overshoot."""
    moving = replace(FLOWN, target=FLOWN.target + np.array([0.0, 0.0, 1.0, 0.0]))
    assert values(measure_limits(moving, MAMBO, [Scenario()])) == pytest.approx([0.2, 0.0, 0.0, 0.5])


def test_a_fence_counts_from_the_first_time_inside() -> None:
    """A drone outside of a new fence has to come back first; one that never does is outside to the end."""
    back = trace_of([3.0, 1.5, 2.25, 1.0], [0.0] * 4, [0.0] * 4)
    late = Scenario(fence_m=2.0, fence_time_s=4.0)
    assert measure_limits(back, MAMBO, [late]).past_wall_m == pytest.approx([0.25])
    assert measure_limits(back, MAMBO, [late.model_copy(update={"fence_m": 0.5})]).past_wall_m == [1.75]


def test_walls_of_the_settings_are_a_fence_too() -> None:
    """Along one axis only: there is none along the other."""
    walled = MAMBO
    for name, wall in (("y_min_m", -1.0), ("y_max_m", 1.0)):
        walled = with_option(walled, f"limits.fence.{name}", wall)
    assert walls_m(MAMBO) is None
    assert walls_m(walled) == (-np.inf, -1.0, -np.inf, np.inf, 1.0, np.inf)
    assert measure_limits(FLOWN, walled, [Scenario()]).past_wall_m == [0.0]
    beside = replace(FLOWN, position_m=FLOWN.position_m[..., [1, 0, 2]])
    assert measure_limits(beside, walled, [Scenario()]).past_wall_m == [2.5]


def test_floor_and_ceiling_are_walls_of_a_controller_of_the_height() -> None:
    """Beside those along x and y, of the settings or set in flight; without [height] there are none."""
    settings = between(0.5, 1.5)
    assert walls_m(settings) == (-np.inf, -np.inf, 0.5, np.inf, np.inf, 1.5)
    assert walls_m(settings, 2.0) == (-2.0, -2.0, 0.5, 2.0, 2.0, 1.5)
    assert walls_m(between(0.0, 0.0)) is None
    assert walls_m(settings.model_copy(update={"height": None})) is None


@pytest.mark.parametrize(
    ("heights_m", "past_m"),
    [
        ([1.0, 1.75, 1.6, 1.0], 0.25),  # above the ceiling
        ([1.0, 0.375, 0.4, 1.0], 0.125),  # below the floor
        ([0.0, 0.25, 1.0, 1.6], 0.1),  # from the ground: counts from the first time inside
        ([0.5, 1.5, 0.5, 1.5], 0.0),
    ],
)
def test_a_flight_is_past_floor_and_ceiling(heights_m: list[float], past_m: float) -> None:
    """As past the walls along x and y; the largest counts."""
    flown = trace_of([0.0, 0.0, 1.0, 0.0], [0.0] * 4, [0.0] * 4)
    flown.position_m[:, 0, 2] = np.negative(heights_m)
    for fence_m, expected in ((0.0, past_m), (2.0, past_m), (0.375, 0.625)):
        found = measure_limits(flown, between(0.5, 1.5), [Scenario(fence_m=fence_m)])
        assert found.past_wall_m == pytest.approx([expected])
    assert measure_limits(flown, MAMBO, [Scenario()]).past_wall_m == [0.0]


@pytest.mark.long
def test_the_picture_of_a_flight_has_its_walls(tmp_path: Path) -> None:
    """One line for each wall, and none without a fence; floor and ceiling in both pictures of the height."""
    trace = trace_of([0.0, 1.0], [0.0, 0.0], [0.0, 1.0])
    heights = np.zeros((2, 1, 2))
    spatial = replace(trace, target=np.concatenate([trace.target, heights], axis=-1))
    fences = {"two": walls_m(between(0.5, 1.5)), "nothing": None, "four": walls_m(MAMBO, 2.0)}
    dashes = []
    for name, walls in fences.items():
        for flown in (trace, spatial):
            draw_flights({name: flown}, tmp_path / name, walls)
            dashes.append((tmp_path / f"{name}.svg").read_text("utf-8").count("stroke-dasharray"))
    assert dashes == [0, 4, 0, 0, 4, 4]


@pytest.mark.long
def test_the_picture_of_a_fast_flight_has_its_speed_limit(tmp_path: Path) -> None:
    """With the speed over time; a flight slower than half of the limit, or without one, has neither."""
    fast = trace_of([0.0, 4.0], [0.0, 4.0], [0.0, 8.0])
    shown = {}
    for limit_m_s in (0.0, 5.0, 9.0):
        draw_flights({"fast": fast}, tmp_path / "fast", None, limit_m_s)
        drawn = (tmp_path / "fast.svg").read_text("utf-8")
        shown[limit_m_s] = drawn.count("stroke-dasharray"), drawn.count("speed, m/s")
    assert shown == {0.0: (0, 0), 5.0: (1, 1), 9.0: (0, 0)}


@pytest.mark.long
def test_the_picture_on_a_page_has_fence_and_speed_too() -> None:
    """The speed over time, and a line for each wall and the limit."""
    fast = trace_of([0.0, 4.0], [0.0, 4.0], [0.0, 8.0])
    plain, near = (flight_columns({"fast": fast}, *given)[0] for given in ((), (walls_m(MAMBO, 2.0), 5.0)))
    assert ["speed, m/s" in one for one in (plain, near)] == [False, True]
    assert [one.count("stroke-dasharray") for one in (plain, near)] == [0, 5]
    assert ["from above, speed, distance" in one for one in (plain, near)] == [False, True]


def test_a_summary_says_how_a_flight_keeps_its_limits(tmp_path: Path) -> None:
    """Past the wall with a fence; over the speed limit if the flight came near it; read again, the same."""
    shown = {}
    walled = with_option(MAMBO, "limits.fence.y_min_m", -1.0)
    walled = with_option(walled, "limits.fence.y_max_m", 1.0)
    slow = replace(FLOWN, velocity_m_s=FLOWN.velocity_m_s * 0.4)
    cases = {
        "pd": (FLOWN, MAMBO, None),
        "no limits": (FLOWN, presets.preset("table1"), Scenario()),
        "slow": (slow, MAMBO, Scenario()),
        "fast": (FLOWN, MAMBO, Scenario()),
        "walls": (slow, walled, Scenario()),
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


def test_a_lost_flight_has_no_metrics() -> None:
    """NaN, which exceeds every bound."""
    lost = replace(FLOWN, position_m=np.full_like(FLOWN.position_m, np.nan))
    lost = replace(lost, velocity_m_s=lost.position_m)
    for scenario in (Scenario(), Scenario(fence_m=1.0)):
        assert np.isnan(values(measure_limits(lost, MAMBO, [scenario]))).all()


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
