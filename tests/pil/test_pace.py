"""A flight by the wall clock, with a clock that only the tests move."""

import json
from contextlib import closing
from functools import partial
from pathlib import Path

import pytest

from mambo_nmpc.codegen.settings import presets
from mambo_nmpc.sil.controllers.compiled import CompiledController
from mambo_nmpc.sil.engine.simulate import fly as simulate
from mambo_nmpc.sil.flight.loop import Flight, fly
from mambo_nmpc.sil.flight.trajectories import CURVES
from mambo_nmpc.sil.pil.connection import Connection
from mambo_nmpc.sil.pil.controller import BoardController
from mambo_nmpc.sil.pil.pace import Deadlines, Pace
from mambo_nmpc.sil.pil.port import open_port
from mambo_nmpc.sil.pil.report import real_time_text
from tests.support.command import run
from tests.support.serial_line import Faults, build_firmware, serial_line
from tests.support.tools import require_module

SETTINGS = presets.preset("mambo")
PERIOD_S = 0.25  # a power of two, so that sums of times are exact


class Clock:
    """A clock that stands still but for `sleep`, which wakes early if asked for more than `longest_s`."""

    def __init__(self, longest_s: float = 1e9) -> None:
        self.now_s, self.longest_s = 64.0, longest_s

    def __call__(self) -> float:
        """Return the time."""
        return self.now_s

    def sleep(self, duration_s: float) -> None:
        """Let time go by."""
        assert duration_s > 0.0
        self.now_s += min(duration_s, self.longest_s)


def paced(clock: Clock, steps: list[tuple[float, float]]) -> tuple[list[float], Deadlines]:
    """Make steps of (time to the reply, time of the desk after it); return when each was sent."""
    pace, sent = Pace(PERIOD_S, clock, clock.sleep), []
    for reply_s, desk_s in steps:
        pace.wait()
        sent.append(clock.now_s - 64.0)
        clock.now_s += reply_s
        pace.note_reply()
        clock.now_s += desk_s
    return sent, pace.deadlines


@pytest.mark.parametrize("longest_s", [1e9, 0.0625])
def test_requests_are_a_period_apart(longest_s: float) -> None:
    """However long board and desk took, if together less than it; also if a sleep ends early."""
    steps = [(0.125, 0.0625), (0.0, 0.0), (0.0625, 0.125), (0.125, 0.125), (0.0, 0.0)]
    sent, deadlines = paced(Clock(longest_s), steps)
    assert sent == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert deadlines == Deadlines(PERIOD_S, 0, 0.0, 0)


def test_a_late_reply_is_one_miss() -> None:
    """The next request goes at once, the later ones a period apart from there."""
    steps = [(0.125, 0.0), (0.875, 0.0625), (0.125, 0.0), (0.3125, 0.0), (0.25, 0.0)]
    sent, deadlines = paced(Clock(), steps)
    assert sent == [0.0, 0.25, 1.1875, 1.4375, 1.75]
    assert deadlines == Deadlines(PERIOD_S, 2, 0.625, 0)


def test_a_slow_desk_is_not_the_fault_of_the_board() -> None:
    """Its late requests count on their own, and no reply to them is a miss."""
    sent, deadlines = paced(Clock(), [(0.125, 0.25), (0.125, 0.0), (0.0, 0.5), (0.0, 0.0)])
    assert sent == [0.0, 0.375, 0.625, 1.125]
    assert deadlines == Deadlines(PERIOD_S, 0, 0.0, 2)


def test_what_is_told() -> None:
    """Misses with the worst, and requests that this machine sent late."""
    assert real_time_text(Deadlines(0.01, 0, 0.0, 0), 61) == "0 of 61 replies later than the period of 10 ms"
    assert real_time_text(Deadlines(0.01, 3, 0.0021, 2), 61) == (
        "3 of 61 replies later than the period of 10 ms, the worst by 2.1 ms; "
        "this machine sent 2 requests late"
    )


def test_a_delay_on_the_line_is_counted_and_changes_no_bit(tmp_path: Path) -> None:
    """One reply of 61 comes after two periods and a half: a miss, later than the period by one and a half."""
    require_module("serial")
    clock, chunks = Clock(), iter(range(10**6))

    def delay(chunk: bytes) -> bytes:
        if next(chunks) == 30:
            clock.now_s += 2.5 * PERIOD_S
        return chunk

    flight = Flight(CURVES["bernoulli"](2.0, 0.5), duration_s=0.6)
    pace = Pace(PERIOD_S, clock, clock.sleep)
    elf = build_firmware(SETTINGS, "host", tmp_path)
    with (
        serial_line(elf, Faults(from_board=delay)) as line,
        closing(Connection(line.port, partial(open_port, line.port, 115200), SETTINGS, say=print)) as board,
    ):
        trace = fly(flight, BoardController(SETTINGS, board, pace))
    assert trace.same_bits(simulate(flight, CompiledController(SETTINGS)))
    assert pace.deadlines == Deadlines(PERIOD_S, 1, 1.5 * PERIOD_S, 0)
    assert clock.now_s == 64.0 + (60 + 1.5) * PERIOD_S


def test_the_command_tells_the_deadlines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In text, summary and report; a flight without the option has none."""
    require_module("serial")
    monkeypatch.chdir(tmp_path)
    with serial_line(build_firmware(SETTINGS, "host", tmp_path / "pil")) as line:
        options = ["--port", line.port, "--duration-s", "0.1", "--no-pictures"]
        said, _ = run("fly", *options, "--real-time", "-o", "paced")
        free = json.loads(run("fly", *options, "--json", "-o", "free")[0])
    deadlines = json.loads((tmp_path / "paced" / "summary.json").read_text("utf-8"))["deadlines"]
    told = f"{deadlines['misses']} of 11 replies later than the period of 10 ms"
    assert deadlines["period_s"] == 0.01
    assert f"  real time          {told}" in said
    assert free["deadlines"] is None
    run("report", "paced", "-o", "page.html")
    assert told in (tmp_path / "page.html").read_text("utf-8")
