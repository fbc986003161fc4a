"""Sweeps: points in order, CSV that reads back, the largest controller that fits."""

import csv
import json
import math
from dataclasses import astuple, replace
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen import boards
from mambo_codegen.boards import Board
from mambo_codegen.settings.controller_toml import to_toml
from mambo_codegen.settings.model import Settings
from mambo_sil.board.footprint.footprint_plots import draw_sweep
from mambo_sil.board.footprint.sweep import Grid, Point, measure_grid
from mambo_sil.board.footprint.sweep_report import closest_fit, write_points
from mambo_sil.experiment.campaign.executors import processes
from tests.support.command import run
from tests.support.one_norm import ONE_NORM
from tests.support.quadratic import quadratic_settings
from tests.support.tools import board_builder

POINT = Point(
    prediction=10,
    control=2,
    iterations=5,
    flash_bytes=2656,
    ram_bytes=188,
    stack_bytes=132,
    instructions=4045,
    time_ms=0.0407,
    iae_m_s=1.91,
    fits=True,
)
UNMEASURED = replace(POINT, stack_bytes=math.nan, instructions=math.nan, time_ms=math.nan)


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def point(prediction: int, control: int, iae_m_s: float, *, fits: bool = True) -> Point:
    """Return a point of a grid."""
    return replace(POINT, prediction=prediction, control=control, iae_m_s=iae_m_s, fits=fits)


def measured(settings: Settings, board: Board, grid: Grid) -> list[Point]:
    """Measure a grid on two processes; demand that progress is counted."""
    counts: list[int] = []
    with processes(2) as pool:
        points = measure_grid(settings, board, grid, pool.run, counts.append)
    assert counts == list(range(len(points) + 1))
    return points


def test_a_grid_has_every_combination_that_is_a_controller() -> None:
    """Points are in the order of the axes, without control horizons beyond the prediction horizon."""
    grid = Grid(prediction=(1, 3), control=(1, 2), iterations=(5, 3))
    assert grid.points() == [(1, 1, 5), (1, 1, 3), (3, 1, 5), (3, 1, 3), (3, 2, 5), (3, 2, 3)]


@pytest.mark.parametrize(
    ("points", "best"),
    [
        pytest.param(
            [point(5, 1, 9), point(10, 1, 2), point(20, 1, 1, fits=False)], 1, id="closest that fits"
        ),
        pytest.param([point(10, 2, 1.9), point(30, 3, 15.5)], 0, id="not the largest"),
        pytest.param([point(10, 1, 2), point(5, 3, 2), point(5, 2, 2)], 2, id="then the shortest"),
        pytest.param([point(10, 2, math.nan), point(10, 2, 50)], 1, id="not lost"),
        pytest.param([point(10, 2, 50), point(20, 2, math.nan)], 0, id="lost, but longer"),
        pytest.param([], None, id="none"),
        pytest.param([point(5, 1, math.nan)], None, id="lost"),
        pytest.param([point(5, 1, 1, fits=False)], None, id="over budget"),
    ],
)
def test_the_closest_fit_follows_its_rule(points: list[Point], best: int | None) -> None:
    """Longest prediction within budget, then most moves, then least IAE; lost flights are excluded."""
    assert closest_fit(points) is (None if best is None else points[best])


def test_points_read_back(tmp_path: Path) -> None:
    """One line for each point with all digits; missing measurements are nan."""
    points = [POINT, replace(UNMEASURED, iae_m_s=0.1 + 0.2, fits=False)]
    write_points(points, tmp_path / "sweep.csv")
    with (tmp_path / "sweep.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == list(Point.__dataclass_fields__)
    for row, one in zip(rows, points, strict=True):
        read = [text == "True" if text in {"True", "False"} else float(text) for text in row.values()]
        np.testing.assert_array_equal(read, astuple(one))


@pytest.mark.parametrize("points", [[POINT], [UNMEASURED], [POINT, point(20, 2, 1.0, fits=False)]])
def test_any_points_can_be_drawn(points: list[Point], tmp_path: Path) -> None:
    """A single point, one without measured time, one over budget."""
    draw_sweep(points, boards.load("crazyflie"), 0.01, tmp_path / "sweep")
    assert (tmp_path / "sweep.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (tmp_path / "sweep.svg").read_text("utf-8")


def test_the_title_of_a_board_is_no_formula(tmp_path: Path) -> None:
    """Dollar signs in a board's title are drawn literally."""
    odd = boards.load("crazyflie").model_copy(update={"title": r"$\frac{$ <b>"})
    draw_sweep([POINT], odd, 0.01, tmp_path / "sweep")
    assert r"$\frac{$ &lt;b&gt;" in (tmp_path / "sweep.svg").read_text("utf-8")


def test_the_command_writes_table_and_pictures_and_answers_with_the_largest(tmp_path: Path) -> None:
    """A small controller on the Crazyflie, where it fits."""
    board_builder("crazyflie")
    grid = ["--prediction", "2", "--control", "1", "--iterations", "1"]
    said, _ = run("sweep", *grid, "--fit", "-o", "out")
    assert said.startswith("prediction  2  control  1  iterations   1  ")
    assert len(said.splitlines()) == 1
    out = tmp_path / "out"
    assert {path.name for path in out.iterdir()} == {"sweep.csv", "sweep.png", "sweep.svg", "summary.json"}
    summary = json.loads((out / "summary.json").read_text("utf-8"))
    assert [one["prediction"] for one in summary["points"]] == [2]
    assert summary["closest_fit"] == summary["points"][0]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--prediction", "x"], "--prediction x must be numbers in 1..50, such as 5:30, 5:30:5 or 1,3,5"),
        (["--prediction", "5:30:0"], "--prediction 5:30:0 must be numbers in 1..50"),
        (["--prediction", "0:3"], "--prediction 0:3 must be numbers in 1..50"),
        (["--prediction", "30:5"], "--prediction 30:5 must be numbers in 1..50"),
        (["--prediction", f"1:{10**12}"], "--prediction 1:1000000000000 must be numbers in 1..50"),
        (["--control", "51"], "--control 51 must be numbers in 1..50"),
        (["--iterations", "3,101"], "--iterations 3,101 must be numbers in 1..100"),
        (["--prediction", "2", "--control", "3"], "--control 3"),
        (["--board", "all"], "all"),
        (["--board", "teensy"], "did you mean teensy41?"),
    ],
)
def test_a_bad_grid_gets_a_message_and_exit_2(options: list[str], message: str, tmp_path: Path) -> None:
    """The message is one line, and nothing is written."""
    said = run("sweep", *options, code=2)[1]
    assert said.count("\n") == 1
    assert message in said
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_a_quadratic_cost_has_nothing_to_sweep(tmp_path: Path) -> None:
    """The message names file, key, rule and the command to use instead."""
    (tmp_path / "quadratic.toml").write_text(to_toml(quadratic_settings()), "utf-8")
    said = run("sweep", "quadratic.toml", code=2)[1]
    assert 'quadratic.toml: cost.norm = "quadratic" must be "1-norm"' in said
    assert "mambo-nmpc tune" in said
    assert [path.name for path in tmp_path.iterdir()] == ["quadratic.toml"]


@pytest.mark.long
def test_a_sweep_yields_the_points_in_order() -> None:
    """A longer horizon takes more flash and instructions, and no less RAM."""
    board_builder("crazyflie")
    grid = Grid(prediction=(5, 8), control=(1, 2), iterations=(3,))
    points = measured(ONE_NORM, boards.load("crazyflie"), grid)
    assert [(p.prediction, p.control, p.iterations) for p in points] == grid.points()
    assert all(p.fits and math.isfinite(p.iae_m_s) for p in points)
    for less, more in ((0, 1), (0, 2), (1, 3), (2, 3)):
        assert points[less].flash_bytes < points[more].flash_bytes
        assert points[less].ram_bytes <= points[more].ram_bytes
        assert points[less].instructions < points[more].instructions
    assert points[2].iae_m_s < points[0].iae_m_s


@pytest.mark.long
def test_what_cannot_be_measured_is_not_said_to_fit() -> None:
    """A controller too large for the emulated AVR has no time, so it does not fit whatever the budget."""
    board_builder("mega")
    document = boards.load("mega").model_dump()
    document["ram_bytes"]["value"] = 65_536
    document["budget"] |= {"flash_bytes": 131_072, "ram_bytes": 32_768}
    grid = Grid(prediction=(50,), control=(50,), iterations=(1,))
    (found,) = measured(ONE_NORM, Board.model_validate(document), grid)
    assert found.ram_bytes <= 32_768
    assert found.stack_bytes > 0
    assert math.isnan(found.time_ms)
    assert not found.fits


@pytest.mark.long
def test_a_small_controller_fits_the_mega() -> None:
    """Five predicted steps, one move and three iterations take less than half of the period."""
    board_builder("mega")
    grid = Grid(prediction=(5,), control=(1,), iterations=(3,))
    (found,) = measured(ONE_NORM, boards.load("mega"), grid)
    assert found.time_ms < 5
    assert found.fits
