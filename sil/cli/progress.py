"""Progress bars on stderr if it is a terminal; otherwise no output."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text


@contextmanager
def progress_bar(text: str) -> Iterator[Callable[[float], None]]:
    """Show `text` and a bar; yield a function that takes the finished share, 0 to 1."""
    columns = TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn()
    shown = sys.stderr.isatty()
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=not shown) as progress:
        task = progress.add_task(text, total=1.0)

        def advance(share: float) -> None:
            progress.update(task, completed=share)

        yield advance


class _RateColumn(ProgressColumn):
    """Column with the number of finished things per second."""

    def render(self, task: Task) -> Text:
        """Return the rate, nothing before it is known."""
        return Text("" if task.speed is None else f"{task.speed:.3g}/s")


@contextmanager
def counting_bar(text: str, things: str, total: int) -> Iterator[Callable[[int], None]]:
    """Show `text`, a bar, count and rate of `things`, and the time left; yield a setter of the count."""
    columns = (
        *(TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn(things)),
        *(_RateColumn(), TimeRemainingColumn()),
    )
    shown = sys.stderr.isatty()
    console = Console(stderr=True)
    with Progress(
        *columns, console=console, transient=True, disable=not shown, speed_estimate_period=600.0
    ) as progress:
        task = None

        def count(finished: int) -> None:
            nonlocal task
            if task is None:  # the rate excludes what an earlier run finished
                task = progress.add_task(text, total=total, completed=finished)
            progress.update(task, completed=finished)

        yield count
