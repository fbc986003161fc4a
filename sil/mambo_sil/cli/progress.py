"""Progress of long work on stderr: a moving bar on a terminal, otherwise a line after 2 s, then every 30 s.

Work that takes less prints no line.
"""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from typing import Final

FIRST_LINE_S: Final = 2.0
"""Time after which a command says what it does."""
LINE_PERIOD_S: Final = 30.0
"""Time from one line to the next where stderr is no terminal."""
_SHOWS: Final = threading.Event()
"""Whether a bar has been shown."""


class Bar:
    """What is shown of some work: its stage, and how much of `total` is finished, in `things` or in percent.

    `show` is called after every change. Of things that are not alike the remaining time is not known.
    """

    def __init__(self, stage: str, total: float, things: str = "", *, alike: bool = True) -> None:
        self._stage, self._total, self._things, self._alike = stage, total, things, alike
        self._begun_s = time.monotonic()
        self._first = self._finished = self._running = 0.0
        self._told = not things
        self.show: Callable[[], None] = lambda: None

    def __call__(self, finished: float) -> None:
        """Show how much is finished; of things the first call tells what an earlier run finished."""
        if not self._told:
            self._told, self._first = True, finished
        self._finished = finished
        self.show()

    def running(self, amount: float) -> None:
        """Show how much of the running work is done; it counts for the bar, but is not finished."""
        self._running = amount
        self.show()

    def stage(self, name: str) -> None:
        """Show another stage."""
        self._stage = name
        self.show()

    @property
    def share(self) -> float | None:
        """The finished share, or None before the first progress and after the last, when it tells nothing."""
        done = self._finished + self._running if self._alike else 0.0
        return done / self._total if self._first < done < self._total else None

    def text(self) -> str:
        """Return stage, finished amount, rate and remaining time, as far as they are known."""
        parts = [self._stage]
        if self._things and self._told:
            parts.append(f"{int(self._finished)} of {self._total:.0f} {self._things}")
        share = self.share
        if share is not None:
            done = share * self._total
            rate_1_s = (done - self._first) / max(time.monotonic() - self._begun_s, 1e-3)
            rate = (
                f"{rate_1_s:.{0 if rate_1_s >= 10.0 else 1}f}/s" if self._things else f"{100 * share:.0f} %"
            )
            parts += [rate, f"{spell_duration((self._total - done) / rate_1_s)} left"]
        return ", ".join(parts)

    def line(self) -> str:
        """Return the text with the time since the beginning."""
        return f"{self.text()}, {spell_duration(time.monotonic() - self._begun_s)} so far"


def spell_duration(time_s: float) -> str:
    """Spell a duration in seconds, minutes or hours."""
    if time_s < 100.0:
        return f"{time_s:.0f} s"
    return f"{time_s / 60.0:.0f} min" if time_s < 6000.0 else f"{time_s / 3600.0:.1f} h"


def progress_bar(stage: str) -> AbstractContextManager[Bar]:
    """Show a bar for work that begins with `stage`; its amounts are shares, 0 to 1."""
    return _shown(Bar(stage, 1.0))


def counting_bar(stage: str, things: str, total: int, *, alike: bool = True) -> AbstractContextManager[Bar]:
    """Show a bar for work that begins with `stage`; its amounts are numbers of `things` out of `total`."""
    return _shown(Bar(stage, total, things, alike=alike))


@contextmanager
def announced(name: str) -> Iterator[None]:
    """Say on a terminal that the command `name` works if it has shown no bar for `FIRST_LINE_S`."""
    _SHOWS.clear()
    if not sys.stderr.isatty():
        _SHOWS.set()
    begun = Bar(name, 1.0)

    def announce() -> None:
        if not _SHOWS.wait(FIRST_LINE_S):
            with suppress(OSError, ValueError):
                print(begun.line(), file=sys.stderr, flush=True)

    threading.Thread(target=announce, daemon=True).start()
    try:
        yield
    finally:
        _SHOWS.set()


@contextmanager
def _shown(bar: Bar) -> Iterator[Bar]:
    """Show `bar` while the block runs."""
    _SHOWS.set()
    with _moving(bar) if sys.stderr.isatty() else _printed(bar):
        yield bar


@contextmanager
def _moving(bar: Bar) -> Iterator[None]:
    """Draw `bar` on the terminal; it runs to and fro while its share is not known."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = TextColumn("{task.description}"), BarColumn(bar_width=20), TimeElapsedColumn()
    console, above = Console(stderr=True), sys.stdout.isatty()  # results go above the bar, or to their file
    with Progress(*columns, console=console, transient=True, redirect_stdout=above) as progress:
        task = progress.add_task(bar.text(), total=None)

        def show() -> None:
            share = bar.share
            progress.tasks[0].total = None if share is None else 1.0  # update() cannot set None
            progress.update(task, description=bar.text(), completed=share or 0.0)

        bar.show = show
        yield


@contextmanager
def _printed(bar: Bar) -> Iterator[None]:
    """Print a line on `bar` after `FIRST_LINE_S`, then every `LINE_PERIOD_S`.

    From another thread: the work may block this one.
    """
    over = threading.Event()

    def print_lines() -> None:
        wait_s = FIRST_LINE_S
        while not over.wait(wait_s):
            wait_s = LINE_PERIOD_S
            with suppress(OSError, ValueError):  # whoever read stderr has closed it
                print(bar.line(), file=sys.stderr, flush=True)

    printer = threading.Thread(target=print_lines, daemon=True)
    printer.start()
    try:
        yield
    finally:
        over.set()
        printer.join()
