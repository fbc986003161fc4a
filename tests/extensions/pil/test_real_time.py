"""Flights by the clock of a process or of a board in QEMU: their bits and counts, never their timing."""

import json
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any, Final

import pytest

from mambo_codegen.settings import presets
from mambo_extensions.pil.connection import Connection
from mambo_extensions.pil.serial_port import open_port
from mambo_extensions.pil.timed import TimedController
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.trajectories import CURVES
from tests.extensions.pil.support.serial_line import build_firmware, serial_line
from tests.support.command import run, unwrapped
from tests.support.tools import without_compilers_of_boards

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

SETTINGS: Final = presets.preset("mambo")


def demand_consistent(summary: dict[str, Any], periods: int) -> None:
    """Demand the bits of the desk in a flight of so many periods, and counts that make these up."""
    assert (summary["different_steps"], summary["self_test_difference"]) == (0, 0)
    assert (summary["same_digest"], summary["same_bits_as_host"]) == (True, True)
    timed = summary["real_time"]
    made = summary["steps"] + timed["lost_replies"]
    assert summary["statuses"]["OK"] <= summary["steps"]
    assert sum(summary["statuses"].values()) == periods + 1
    assert made + timed["overruns"] >= periods
    assert 0 <= timed["late_inputs"] <= made
    assert timed["board_period_s"] == 0.01
    assert timed["delay_s"]["least"] >= 0.0


@pytest.mark.long
def test_a_flight_by_the_clock_of_a_process_is_told(tmp_path: Path) -> None:
    """In text, summary and report; a flight on request has nothing of it."""
    with serial_line(build_firmware(SETTINGS, "host", tmp_path / "pil")) as line:
        options = ["--port", line.port, "--duration-s", "0.3", "--no-pictures"]
        said, _ = run("fly", *options, "--real-time", "-o", "timed")
        free = json.loads(run("fly", *options, "--json", "-o", "free")[0])
    said = unwrapped(said)
    summary = json.loads((tmp_path / "timed" / "summary.json").read_text("utf-8"))
    demand_consistent(summary, 30)
    assert f"all bits of {summary['steps']} steps equal those of this machine" in said
    timed = summary["real_time"]
    made = summary["steps"] + timed["lost_replies"]
    told = (
        f"{timed['late_inputs']} of {made} steps with late inputs, {timed['lost_replies']} replies lost, "
        f"{timed['overruns']} periods without a step"
    )
    assert " real time a step every 10 ms of the board's clock, " in said
    assert told in said
    assert free["real_time"] is None
    run("report", "timed", "-o", "page.html")
    assert told in (tmp_path / "page.html").read_text("utf-8")


@pytest.mark.long
@pytest.mark.parametrize("board", ["crazyflie", "mega"])
def test_boards_in_qemu_fly_by_their_own_clock(board: str, tmp_path: Path) -> None:
    """On a busy machine inputs are late and periods have no step: every bit is the same all the same."""
    with serial_line(build_firmware(SETTINGS, board, tmp_path / "pil")) as line:
        options = ["--port", line.port, "--duration-s", "0.5", "--no-pictures", "--json"]
        with without_compilers_of_boards():
            demand_consistent(json.loads(run("fly", *options, "--real-time")[0]), 50)


@pytest.mark.long
def test_a_board_whose_clock_was_left_running_is_taken_over(tmp_path: Path) -> None:
    """By the next flight, on request or by the clock: what it still sends is not taken for an answer."""
    flight = Flight(CURVES["bernoulli"](2.0, 0.5), duration_s=0.2)
    with serial_line(build_firmware(SETTINGS, "host", tmp_path / "pil")) as line:
        left = Connection(line.port, partial(open_port, line.port, 1), SETTINGS, say=print)
        port = left._port
        fly(flight, TimedController(SETTINGS, left))
        port.close()
        with closing(Connection(line.port, partial(open_port, line.port, 1), SETTINGS, say=print)) as board:
            controller = TimedController(SETTINGS, board)
            fly(flight, controller)
    assert controller.different == []
    assert controller.arrivals[0].number == 0
