"""The summary of a flight with the controller on a board, as a record and as text."""

import statistics
from collections.abc import Sequence
from typing import Self

from pydantic import BaseModel, ConfigDict

from mambo_nmpc.codegen.errors import echo
from mambo_nmpc.sil.flight.report import FlySummary, flight_text
from mambo_nmpc.sil.pil.connection import Connection
from mambo_nmpc.sil.pil.controller import BoardController
from mambo_nmpc.sil.pil.pace import Deadlines


class Spread(BaseModel):
    """Least, median and most of something measured in every step."""

    model_config = ConfigDict(frozen=True)

    least: float
    median: float
    most: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Self:
        """Return the spread of `values`."""
        return cls(least=min(values), median=statistics.median(values), most=max(values))


class EmulatedCount(BaseModel):
    """Instructions of a step on an emulated core, over the flight that `footprint` counts."""

    model_config = ConfigDict(frozen=True)

    board: str
    least: int
    mean: float
    most_met: int


class BoardFlightSummary(FlySummary):
    """The results of `fly --port`."""

    command = "fly --port"

    port: str
    baud: int
    board_says: str
    """The name of the board in its firmware."""
    clock_hz: int
    self_test_difference: int
    """The first step of the self-test with other bits, counted from 1; 0 if there is none."""
    same_digest: bool
    """Whether the self-test digest over `digest_steps` is that of this machine."""
    digest_steps: int
    steps: int
    different_steps: int
    first_different_step: int | None
    cycles: Spread
    """Of `nmpc_step`, at `clock_hz`."""
    emulated: EmulatedCount | None = None
    """None for a board that `footprint` does not know, or if it cannot be built for or emulated here."""
    not_emulated: str = ""
    """Why, if `footprint` knows the board."""
    stack_bytes: int
    round_trip_s: Spread | None
    """From request to reply, of the steps that were not repeated."""
    link_faults: dict[str, int]
    """What went wrong on the link and was made good: damaged, repeated, reconnected, restarts."""
    deadlines: Deadlines | None = None
    """Of a flight by the wall clock."""


def board_fields(board: Connection, controller: BoardController) -> dict[str, object]:
    """Return the fields of a `BoardFlightSummary` that follow from a flight."""
    different, replies = controller.different, controller.replies
    return {
        "board_says": echo(board.greeting.board),
        "clock_hz": board.greeting.clock_hz,
        "steps": len(replies),
        "different_steps": len(different),
        "first_different_step": different[0] if different else None,
        "cycles": Spread.of([reply.cycles for reply in replies]),
        "stack_bytes": max(reply.stack_bytes for reply in replies),
        "round_trip_s": Spread.of(board.round_trips_s) if board.round_trips_s else None,
        "link_faults": dict(board.faults),
    }


def difference(summary: BoardFlightSummary) -> str | None:
    """Say where the bits of the board are not those of this machine; None if all are."""
    if summary.self_test_difference:
        return f"step {summary.self_test_difference} of the self-test has other bits than the reference"
    if not summary.same_digest:
        return f"the self-test digest over {summary.digest_steps} steps is not that of this machine"
    if summary.first_different_step is not None:
        return (
            f"{summary.different_steps} of {summary.steps} steps have other bits than on this machine, "
            f"first step {summary.first_different_step}"
        )
    return None


def emulated_text(summary: BoardFlightSummary) -> str:
    """Say how many instructions a step takes on the emulated core, or why they were not counted."""
    count = summary.emulated
    if count is None:
        return f"not counted: {summary.not_emulated}"
    return (
        f"{count.least} / {count.mean:.0f} / {count.most_met} instructions (least, mean, most met), "
        f"{summary.cycles.median / count.mean:.3g} cycles each"
    )


def link_text(summary: BoardFlightSummary) -> str:
    """Say what went wrong on the link."""
    faults = [f"{count} {name}" for name, count in sorted(summary.link_faults.items()) if count]
    return ", ".join(faults) + ": made good" if faults else "no fault"


def real_time_text(deadlines: Deadlines, steps: int) -> str:
    """Say how a flight by the wall clock kept its period."""
    words = f"{deadlines.misses} of {steps} replies later than the period of {1e3 * deadlines.period_s:g} ms"
    if deadlines.misses:
        words += f", the worst by {1e3 * deadlines.worst_lateness_s:.3g} ms"
    if deadlines.late_requests:
        words += f"; this machine sent {deadlines.late_requests} requests late"
    return words


def board_text(summary: BoardFlightSummary) -> str:
    """Format the summary of a flight with a board."""
    found, cycles, trip = difference(summary), summary.cycles, summary.round_trip_s
    bits = (
        f"all bits of {summary.steps} steps equal those of this machine" if found is None else found.upper()
    )
    lines = [
        flight_text(summary),
        f"{summary.board_says}, {summary.port}: {bits}",
        f"  cycles a step      {cycles.least:.0f} / {cycles.median:.0f} / {cycles.most:.0f} "
        f"(least, median, most), {1e6 * cycles.median / summary.clock_hz:.3g} us at "
        f"{summary.clock_hz / 1e6:g} MHz",
    ]
    if summary.emulated is not None or summary.not_emulated:
        lines.append(f"  emulated           {emulated_text(summary)}")
    lines.append(f"  stack of a step    {summary.stack_bytes} B")
    if trip is not None:
        milliseconds = " / ".join(f"{1e3 * value:.3g}" for value in (trip.least, trip.median, trip.most))
        lines.append(f"  request to reply   {milliseconds} ms")
    if summary.deadlines is not None:
        lines.append(f"  real time          {real_time_text(summary.deadlines, summary.steps)}")
    return "\n".join([*lines, f"  link               {link_text(summary)}"])
