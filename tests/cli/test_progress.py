"""Progress of long work: what a bar shows, on a terminal and elsewhere."""

import os
import pty
import re
import subprocess
import sys
import threading
from io import StringIO

import pytest

from mambo_sil.cli import progress
from mambo_sil.cli.progress import Bar, counting_bar, progress_bar

ON_A_TERMINAL = """
import sys
from mambo_sil.cli.progress import counting_bar
with counting_bar("starting", "flights", 8) as bar:
    bar(2)
    bar.stage("flying")
    bar.running(1.5)
    print("finished", flush=True)
    sys.stdin.readline()
"""


def seen(bar: Bar) -> tuple[str, float | None]:
    """Return text and share of a bar."""
    return bar.text(), bar.share


def test_a_bar_counts_what_is_finished_and_moves_with_what_runs() -> None:
    """Finished things are whole; rate and share include what runs, not what an earlier run finished."""
    bar = Bar("flying", 1000, "flights")
    assert seen(bar) == ("flying", None)
    bar(200)
    assert seen(bar) == ("flying, 200 of 1000 flights", None)
    bar.running(50.5)
    assert seen(bar)[1] == 0.2505
    assert re.fullmatch(r"flying, 200 of 1000 flights, [\d.]+/s, \d+ s left", bar.text())
    bar.running(0.0)
    bar(1000)
    bar.stage("computing statistics")
    assert seen(bar) == ("computing statistics, 1000 of 1000 flights", None)


def test_things_that_are_not_alike_have_no_remaining_time() -> None:
    """Of the checks of `verify` one takes as long as all others."""
    bar = Bar("verifying", 22, "checks", alike=False)
    bar(0)
    bar(2)
    assert seen(bar) == ("verifying, 2 of 22 checks", None)


def test_a_command_without_a_bar_says_that_it_works(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a terminal, after `FIRST_LINE_S`; a bar says it otherwise."""
    stream = Stream()
    monkeypatch.setattr(stream, "isatty", lambda: True)
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(progress, "FIRST_LINE_S", 0.0)
    with progress.announced("margins"):
        assert stream.written.wait(60.0)
    assert stream.getvalue().startswith("margins, 0 s so far")


def test_a_bar_of_shares_shows_percent() -> None:
    """Nothing is known before the first share."""
    bar = Bar("flying", 1.0)
    assert bar.text() == "flying"
    bar(0.25)
    assert re.fullmatch(r"flying, 25 %, \d+ s left", bar.text())
    assert re.fullmatch(r"flying, 25 %, \d+ s left, \d+ s so far", bar.line())


@pytest.mark.parametrize(
    ("time_s", "text"),
    [(0.4, "0 s"), (99.0, "99 s"), (150.0, "2 min"), (5999.0, "100 min"), (9000.0, "2.5 h")],
)
def test_durations_are_spelled_in_two_or_three_digits(time_s: float, text: str) -> None:
    """Seconds, minutes or hours."""
    assert progress.spell_duration(time_s) == text


class Stream(StringIO):
    """A stream that tells when the first line has been written."""

    def __init__(self) -> None:
        super().__init__()
        self.written = threading.Event()

    def flush(self) -> None:
        """Tell it."""
        self.written.set()


def test_lines_are_printed_where_stderr_is_no_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also while the work blocks; work that is over sooner prints nothing."""
    stream = Stream()
    monkeypatch.setattr(sys, "stderr", stream)
    with progress_bar("brief work") as bar:
        bar(0.5)
    assert stream.getvalue() == ""
    monkeypatch.setattr(progress, "FIRST_LINE_S", 0.0)
    with counting_bar("flying", "flights", 8) as bar:
        bar(3)
        assert stream.written.wait(60.0)
    assert stream.getvalue().splitlines()[-1].startswith("flying")
    assert stream.getvalue().endswith(" so far\n")


def test_a_bar_is_drawn_on_a_terminal_and_removed() -> None:
    """Stage, count and bar are on the terminal; stdout has the results only."""
    mine, its = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-c", ON_A_TERMINAL],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=its,
        env=os.environ | {"TERM": "xterm", "COLUMNS": "100"},
    ) as process:
        os.close(its)
        shown = b""
        while b"flying, 2 of 8 flights" not in shown:
            shown += os.read(mine, 1000)
        assert process.stdin is not None
        process.stdin.write(b"\n")
        process.stdin.close()
        assert process.stdout is not None
        assert process.stdout.read() == b"finished\n"
    assert process.returncode == 0
    os.close(mine)
