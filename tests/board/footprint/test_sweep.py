"""Sweeps: points in order, CSV that reads back, the largest controller that fits."""

import csv
import json
import math
import warnings
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen import boards
from mambo_codegen.boards import Board
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.board.footprint.footprint_plots import draw_sweep
from mambo_sil.board.footprint.sweep import Axis, Point, budgets, grid, measure_grid
from mambo_sil.board.footprint.sweep_report import SweepSummary, closest_fit, write_points
from mambo_sil.experiment.campaign.executors import processes
from mambo_sil.experiment.margins.margin_reserve import MarginReference
from mambo_sil.results.summary import Number
from tests.support.command import run, unwrapped
from tests.support.one_norm import ONE_NORM
from tests.support.tools import board_builder

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

PREDICTION, CONTROL = "horizon.prediction", "horizon.control"
AXES = (Axis(PREDICTION, (10, 20)), Axis(CONTROL, (2,)))
POINT = Point(
    {PREDICTION: 10, CONTROL: 2},
    flash_bytes=2656,
    ram_bytes=188,
    stack_bytes=132,
    instructions=4045,
    time_ms=0.0407,
    iae_m_s=1.91,
    fits=True,
)
UNMEASURED = replace(POINT, stack_bytes=math.nan, instructions=math.nan, time_ms=math.nan)
UNKNOWN = MarginReference("a 1-norm", "true", {}, "not linear")
REFUSED = Point({PREDICTION: 1, CONTROL: 2}, refusal="horizon.control = 2 must lie in 1..1")


def point(
    prediction: int, flash_bytes: int, iae_m_s: float, *, fits: bool = True, share: float = 1.0
) -> Point:
    """Return a point of a grid."""
    values: dict[str, Number] = {PREDICTION: prediction, CONTROL: 2}
    found = replace(POINT, values=values, flash_bytes=flash_bytes, iae_m_s=iae_m_s, fits=fits)
    return replace(found, gain_margin=1.5, delay_margin_s=0.042, margin_share=share)


def measured(settings: Settings, board: Board, *axes: Axis) -> list[Point]:
    """Measure a grid on two processes; demand that progress is counted."""
    counts: list[int] = []
    with processes(2) as pool:
        points = measure_grid(settings, board, axes, pool.run, counts.append, reference=UNKNOWN)
    assert counts == list(range(len(points) + 1))
    return points


def test_a_grid_has_every_combination() -> None:
    """The values of the last key vary fastest."""
    axes = Axis("a.b", (1, 3)), Axis("c.d", (0.5, 0.25))
    assert [tuple(one.values()) for one in grid(axes)] == [(1, 0.5), (1, 0.25), (3, 0.5), (3, 0.25)]
    assert grid(axes[:1]) == [{"a.b": 1}, {"a.b": 3}]


@pytest.mark.parametrize(
    ("points", "best"),
    [
        pytest.param(
            [point(5, 1, 9), point(10, 1, 2), point(20, 1, 1, fits=False)], 1, id="closest that fits"
        ),
        pytest.param([point(10, 2, 1.9), point(30, 3, 15.5)], 0, id="not the largest"),
        pytest.param([point(10, 300, 2), point(5, 200, 2), point(5, 250, 2)], 1, id="then the smallest"),
        pytest.param([point(10, 2, math.nan), point(10, 2, 50)], 1, id="not lost"),
        pytest.param([point(10, 2, 50), point(20, 2, math.nan)], 0, id="lost, but longer"),
        pytest.param([REFUSED], None, id="refused"),
        pytest.param([], None, id="none"),
        pytest.param([point(5, 1, math.nan)], None, id="lost"),
        pytest.param([point(5, 1, 1, fits=False)], None, id="over budget"),
        pytest.param([point(5, 1, 1, share=0.79), point(10, 1, 2, share=0.81)], 1, id="keeps margins"),
        pytest.param([point(5, 1, 1, share=math.nan), point(10, 1, 2)], 0, id="margins unknown"),
        pytest.param([point(5, 1, 1, share=0.0)], None, id="unstable"),
    ],
)
def test_the_closest_fit_follows_its_rule(points: list[Point], best: int | None) -> None:
    """Least IAE within budget and margins, then least flash; lost flights are excluded."""
    assert closest_fit(points) is (None if best is None else points[best])


def test_a_closer_point_with_small_margins_is_named() -> None:
    """With what it tolerates; the answer says too where no point keeps its margins, or none are known."""
    small, calm = point(5, 1, 1.0, share=0.5), point(10, 1, 2.0)
    for points, reference, lines in (
        (
            [small, calm],
            replace(UNKNOWN, whose="preset mambo", missing=None),
            [
                "closest: horizon.prediction 10, horizon.control 2, IAE 2 m s",
                "closer, but with a loop more than 20 % worse than with preset mambo: horizon.prediction 5, "
                "horizon.control 2, IAE 1 m s, tolerates 1.50 times the gain or 42.0 ms more delay",
            ],
        ),
        (
            [small],
            replace(UNKNOWN, whose="preset mambo", missing=None),
            [
                "none keeps the margins of preset mambo: each has a loop more than 20 % worse",
                "the closest of these: horizon.prediction 5, ",
            ],
        ),
        ([small], UNKNOWN, ["margins are not known: not linear"]),
        ([calm], replace(UNKNOWN, missing=None), ["closest: horizon.prediction 10, "]),
    ):
        found = SweepSummary(
            source="mambo",
            settings="",
            board="crazyflie",
            budget={},
            axes=[*AXES],
            points=points,
            closest_fit=closest_fit(points),
            reference=reference,
        ).result(Path())
        first, *said = found.answer
        assert first.endswith("controllers fit")
        assert len(said) == len(lines)
        assert all(line.startswith(start) for line, start in zip(said, lines, strict=True))
        assert found.good == (closest_fit(points) is not None)


def test_points_read_back(tmp_path: Path) -> None:
    """One line for each point with all digits; missing measurements are nan."""
    points = [POINT, replace(UNMEASURED, iae_m_s=0.1 + 0.2, fits=False), REFUSED]
    write_points(points, tmp_path / "sweep.csv")
    with (tmp_path / "sweep.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for row, one in zip(rows, points, strict=True):
        expected = asdict(one)
        expected = expected.pop("values") | expected
        assert list(row) == list(expected)
        assert row.pop("refusal") == (expected.pop("refusal") or "")
        read = [text == "True" if text in {"True", "False"} else float(text) for text in row.values()]
        np.testing.assert_array_equal(read, list(expected.values()))


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    "points", [[POINT], [UNMEASURED], [POINT, point(20, 2, 1.0, fits=False)], [REFUSED], [POINT, REFUSED]]
)
@pytest.mark.parametrize("axes", [AXES, AXES[:1]], ids=["two keys", "one key"])
def test_any_points_can_be_drawn(points: list[Point], axes: tuple[Axis, ...], tmp_path: Path) -> None:
    """A single point, one without measured time, one over budget, and refused ones, without a warning."""
    limits = budgets(boards.load("crazyflie"), ONE_NORM, axes)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        draw_sweep(points, axes, limits, ("fits", "Crazyflie"), tmp_path / "sweep")
    assert (tmp_path / "sweep.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (tmp_path / "sweep.svg").read_text("utf-8")


def test_the_budget_of_time_is_left_out_where_it_varies() -> None:
    """It is a share of the update period."""
    board = boards.load("crazyflie")
    assert budgets(board, ONE_NORM, AXES)["time_ms"] > 0.0
    assert "time_ms" not in budgets(board, ONE_NORM, (Axis("horizon.update_period_s", (0.01, 0.02)),))


@pytest.mark.long
def test_the_title_of_a_board_is_no_formula(tmp_path: Path) -> None:
    """Dollar signs in a board's title are drawn literally."""
    draw_sweep([POINT], AXES, {}, ("fits", r"$\frac{$ <b>"), tmp_path / "sweep")
    assert r"$\frac{$ &lt;b&gt;" in (tmp_path / "sweep.svg").read_text("utf-8")


@pytest.mark.long
def test_the_command_writes_table_and_pictures_and_answers_with_the_closest(tmp_path: Path) -> None:
    """The default preset with three response times: on the edge, good, and refused by the settings."""
    board_builder("crazyflie")
    said, _ = run("sweep", "--vary", "cost.response_time_s=0.1:2.3:3", "--fit", "-o", "out")
    assert said.startswith("1 of 1 controllers fit\nclosest: cost.response_time_s 1.2, IAE ")
    out = tmp_path / "out"
    assert {path.name for path in out.iterdir()} == {"sweep.csv", "sweep.png", "sweep.svg", "summary.json"}
    summary = json.loads((out / "summary.json").read_text("utf-8"))
    assert [one["values"] for one in summary["points"]] == [
        {"cost.response_time_s": pytest.approx(0.1)},
        {"cost.response_time_s": pytest.approx(1.2)},
        {"cost.response_time_s": pytest.approx(2.3)},
    ]
    edge, good, refused = summary["points"]
    assert summary["closest_fit"] == good
    assert edge["iae_m_s"] < good["iae_m_s"]
    assert edge["margin_share"] == pytest.approx(0.163, abs=0.005)
    assert good["margin_share"] > 0.8
    assert refused["refusal"].startswith("cost.response_time_s = 2.3 must lie in 0.02..2")


@pytest.mark.long
def test_whole_numbers_stay_whole() -> None:
    """Rounded, each once; two keys give all pairs, of which settings may refuse some."""
    board_builder("crazyflie")
    pair = ["--vary", "horizon.prediction=1:2:4", "--vary", "horizon.control=2:2:1"]
    said, _ = run("sweep", "table1", *pair, "-o", "out")
    assert said.startswith("1 of 2 controllers fit\nclosest: horizon.prediction 2, horizon.control 2, IAE ")
    refused = "is refused: horizon.control = 2 must lie in 1..1 (horizon.prediction)"
    assert unwrapped(said).endswith(f"horizon.prediction 1, horizon.control 2 {refused}")


def vary(*texts: str) -> list[str]:
    """Return the options --vary."""
    return [word for text in texts for word in ("--vary", text)]


GOOD = "limits.tilt_rad=0.2:0.3:2"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (vary("limits.tilt=1:2:2"), "limits.tilt is not a number that settings with controller.method"),
        (vary("limits.tilt=1:2:2"), "did you mean limits.tilt_rad?"),
        (vary("response_time_s=1:2:2"), "did you mean cost.response_time_s?"),
        (vary("optimizer.iterations=1:2:2"), 'controller.method = "quadratic" use; did you mean '),
        (vary("observer.age_s=0:0.1:2"), "observer.age_s is now observer.measurement_age_s"),
        (vary("code.scalar=1:2:2"), "code.scalar is not a number"),
        *(
            (vary(f"limits.tilt_rad={span}"), "must be KEY=FIRST:LAST:COUNT with a COUNT in 1..100, such as")
            for span in (
                "",
                "1",
                "1:2",
                "1:2:x",
                "nan:2:3",
                "1:inf:3",
                "-1e308:1e308:3",
                "1:2:0",
                "1:2:101",
                "1:2:3:4",
            )
        ),
        (vary(GOOD, GOOD), "limits.tilt_rad is there twice"),
        (vary(GOOD, GOOD, GOOD), "3 keys are too many; name one or two"),
        ([*vary(GOOD), "--board", "all"], "all"),
        ([*vary(GOOD), "--board", "teensy"], "did you mean teensy41?"),
    ],
)
def test_a_bad_grid_gets_a_message_and_exit_2(options: list[str], message: str, tmp_path: Path) -> None:
    """The message is one line, and nothing is written."""
    said = run("sweep", *options, code=2)[1]
    assert said.count("\n") == 1
    assert message in said
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_a_sweep_yields_the_points_in_order() -> None:
    """A longer horizon takes more flash and instructions, and no less RAM."""
    board_builder("crazyflie")
    axes = Axis(PREDICTION, (5, 8)), Axis(CONTROL, (1, 2))
    points = measured(with_option(ONE_NORM, "optimizer.iterations", 3), boards.load("crazyflie"), *axes)
    assert [one.values for one in points] == grid(axes)
    assert all(p.fits and math.isfinite(p.iae_m_s) for p in points)
    for less, more in ((0, 1), (0, 2), (1, 3), (2, 3)):
        assert points[less].flash_bytes < points[more].flash_bytes
        assert points[less].ram_bytes <= points[more].ram_bytes
        assert points[less].instructions < points[more].instructions
    assert points[2].iae_m_s < points[0].iae_m_s


def test_settings_that_cannot_fly_are_refused_points() -> None:
    """An update period that is no multiple of the vehicle's tick."""
    board_builder("crazyflie")
    (found,) = measured(Settings(), boards.load("crazyflie"), Axis("horizon.update_period_s", (0.012,)))
    assert found.refusal is not None
    assert found.refusal.startswith("horizon.update_period_s = 0.012 must be a whole multiple of 0.005")


@pytest.mark.long
def test_what_cannot_be_measured_is_not_said_to_fit() -> None:
    """A controller too large for the emulated AVR has no time, so it does not fit whatever the budget."""
    board_builder("mega")
    document = boards.load("mega").model_dump()
    document["ram_bytes"]["value"] = 65_536
    document["budget"] |= {"flash_bytes": 131_072, "ram_bytes": 32_768}
    settings = with_option(ONE_NORM, "optimizer.iterations", 1)
    axes = Axis(PREDICTION, (50,)), Axis(CONTROL, (50,))
    (found,) = measured(settings, Board.model_validate(document), *axes)
    assert found.ram_bytes <= 32_768
    assert found.stack_bytes > 0
    assert math.isnan(found.time_ms)
    assert not found.fits


@pytest.mark.long
def test_a_small_controller_fits_the_mega() -> None:
    """Five predicted steps, one move and three iterations take less than half of the period."""
    board_builder("mega")
    settings = with_option(with_option(ONE_NORM, "horizon.control", 1), "optimizer.iterations", 3)
    (found,) = measured(settings, boards.load("mega"), Axis(PREDICTION, (5,)))
    assert found.time_ms < 5
    assert found.fits
