"""The summary of a flight with the controller on a board: record and result."""

import statistics
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from pydantic import BaseModel, ConfigDict

from mambo_codegen.errors import echo
from mambo_extensions.pil.board_controller import BoardController
from mambo_extensions.pil.connection import Connection
from mambo_extensions.pil.timed import Arrival, TimedController
from mambo_sil.board.footprint.on_board import Spread
from mambo_sil.flight.flight_report import FlySummary
from mambo_sil.results.blocks import CommandResult, ResultTable

CLOCK_TOLERANCE: Final = 0.01
"""Share by which the clocks of board and desk may differ: a ceramic resonator is half as bad."""


class EmulatedCount(BaseModel):
    """Instructions of a step on an emulated core, over the flight that `footprint` counts."""

    model_config = ConfigDict(frozen=True)

    board: str
    least: int
    mean: float
    most_met: int


class RealTime(BaseModel):
    """How a flight went whose steps the board's clock called."""

    model_config = ConfigDict(frozen=True)

    board_period_s: float
    """The update period, rounded to cycles of the board's clock."""
    wall_period_s: float | None
    """That period by the clock of this machine; None if only one reply came."""
    clocks_agree: bool
    """Whether both are equal, but for CLOCK_TOLERANCE and the irregularity of the replies."""
    overruns: int
    """Periods of the board without a step."""
    late_inputs: int
    """Steps with older inputs than those sent for them, which came too late, damaged, or not at all."""
    lost_replies: int
    """Replies that did not come, or damaged: the drone kept its command, and no bits are compared."""
    delay_s: Spread
    """From the end of a period to the call of the step."""


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
    """Whether the self-test digest over `digest_steps` is the one of this machine."""
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
    """On the link: damaged, repeated, reconnected, restarts; in real time damaged and doubled."""
    real_time: RealTime | None = None

    def result(self, folder: Path, /) -> CommandResult:
        """Return the result of this flight; drawing raises TraceError."""
        cycles, trip = self.cycles, self.round_trip_s
        rows = [
            (
                "cycles a step",
                f"{cycles.least:.0f} / {cycles.median:.0f} / {cycles.most:.0f} (least, median, most), "
                f"{1e6 * cycles.median / self.clock_hz:.3g} us at {self.clock_hz / 1e6:g} MHz",
            )
        ]
        if self.emulated is not None or self.not_emulated:
            rows.append(("emulated", emulated_text(self)))
        rows.append(("stack of a step", f"{self.stack_bytes} B"))
        if trip is not None:
            rows.append(("request to reply", f"{trip.milliseconds} ms"))
        if self.real_time is not None:
            rows += zip(("real time", "", ""), real_time_text(self.real_time, self.steps), strict=True)
        rows.append(("link", link_text(self)))
        flown = super().result(folder)
        return replace(flown, blocks=[*flown.blocks, ResultTable((), rows)])

    def _remarks(self) -> Iterator[str]:
        yield from super()._remarks()
        found = difference(self)
        same = f"all bits of {self.steps} steps equal those of this machine"
        yield f"{self.board_says}, {self.port}: {same if found is None else found.upper()}"


def board_fields(board: Connection, controller: BoardController | TimedController) -> dict[str, object]:
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
        "real_time": real_time_of(board, controller) if isinstance(controller, TimedController) else None,
    }


def real_time_of(board: Connection, controller: TimedController) -> RealTime:
    """Return how a flight by the board's clock went."""
    arrivals = controller.arrivals
    wall_period_s, agree = wall_clock(arrivals, board.period_s)
    return RealTime(
        board_period_s=board.period_s,
        wall_period_s=wall_period_s,
        clocks_agree=agree,
        overruns=arrivals[-1].reply.overruns,
        late_inputs=controller.late_inputs,
        lost_replies=controller.lost_replies,
        delay_s=Spread.of([arrival.reply.delay_cycles / board.greeting.clock_hz for arrival in arrivals]),
    )


def wall_clock(arrivals: Sequence[Arrival], board_period_s: float) -> tuple[float | None, bool]:
    """Return the period by the clock of this machine, and whether it agrees with the board's.

    The period is the median of those between replies that are half of the flight apart (after Theil and Sen),
    which a few late replies do not change.
    """
    if len(arrivals) == 1:
        return None, True
    pairs = zip(arrivals, arrivals[len(arrivals) // 2 :], strict=False)
    period_s = statistics.median(
        (later.time_s - one.time_s) / (later.period - one.period) for one, later in pairs
    )
    periods = arrivals[-1].period - arrivals[0].period
    offsets_s = [arrival.time_s - period_s * arrival.period for arrival in arrivals]
    allowed_s = CLOCK_TOLERANCE * board_period_s * periods + max(offsets_s) - min(offsets_s)
    return period_s, abs(period_s - board_period_s) * periods <= allowed_s


def difference(summary: BoardFlightSummary) -> str | None:
    """Say where the bits of the board differ from this machine's; None if they do not."""
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
        f"{count.least} / {count.mean:.0f} / {count.most_met} instructions (least, mean, largest), "
        f"{summary.cycles.median / count.mean:.3g} cycles each"
    )


def link_text(summary: BoardFlightSummary) -> str:
    """Say what went wrong on the link."""
    faults = [f"{count} {name}" for name, count in sorted(summary.link_faults.items()) if count]
    recovered = ": recovered" if summary.real_time is None else ""
    return ", ".join(faults) + recovered if faults else "no fault"


def real_time_text(timed: RealTime, steps: int) -> list[str]:
    """Say how a flight by the board's clock went, of which `steps` replies came; a sentence each."""
    made = steps + timed.lost_replies
    clock = f"a step every {1e3 * timed.board_period_s:.6g} ms of the board's clock"
    if timed.wall_period_s is not None:
        clock += f", {1e3 * timed.wall_period_s:.6g} ms of this machine's"
        clock += "" if timed.clocks_agree else ": THE CLOCKS DISAGREE"
    return [
        clock,
        f"called {timed.delay_s.milliseconds} ms after the end of a period (least, median, most)",
        f"{timed.late_inputs} of {made} steps with late inputs, {timed.lost_replies} replies lost, "
        f"{timed.overruns} periods without a step",
    ]
