"""How the replayed commands differ from the log's: record and result."""

from pathlib import Path
from typing import Final

import numpy as np
from markupsafe import Markup

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.model.replay.log_replay import AXES, SETTLING_S, LogReplay
from mambo_sil.model.replay.replay_verdict import SAME, ReplayVerdict, errors_of, judge
from mambo_sil.results.blocks import CommandResult, Facts, Picture, ResultTable, Sentence
from mambo_sil.results.summary import Number, ReportedSummary

CURVES: Final = "replay.csv"
PICTURES: Final = ("replay.png", "replay.svg")
CAPTION: Final = (
    "The logged commands, those of the compiled controller on the logged inputs, and their difference."
)


class LogReplaySummary(ReportedSummary):
    """A replay of a log; what is by axis has roll and pitch."""

    command = "replay"

    log: str
    source: str
    settings: str
    steps: int
    resampled: bool
    equal_steps: int
    """Steps whose logged command the controller repeats in every bit."""
    first_different_s: Number | None
    """Time since the beginning of the log of the first other step, None if there is none."""
    refused: int
    lost: int
    """Updates that the log has lost; `steps` are the others."""
    gaps: int
    """Gaps that are too long to fill: behind each the controller begins anew."""
    judged: int
    """Steps `SETTLING_S` or more after a beginning of the controller; what follows is of these."""
    miss: tuple[Number, Number]
    """Change of the error over the change of the logged command: half of the motion has less."""
    error_rad: tuple[Number, Number]
    """Error: half of the motion has less."""
    rms_rad: tuple[Number, Number]
    largest_rad: tuple[Number, Number]
    largest_s: tuple[Number, Number]
    """Time since the beginning of the log of the largest error."""
    verdict: ReplayVerdict
    missing: str
    """What is missing for a verdict."""
    remarks: list[str]

    @property
    def good(self) -> bool | None:
        """Whether the log is one of this controller; None if that cannot be told."""
        return None if self.verdict is ReplayVerdict.CANNOT_TELL else self.verdict is ReplayVerdict.YES

    def result(self, folder: Path, /) -> CommandResult:
        """Return the result of this replay; drawing raises ResultsError."""

        def picture() -> list[Markup]:
            from mambo_sil.model.replay.replay_plots import replay_panel  # noqa: PLC0415 - loaded when drawing

            return [replay_panel(folder / CURVES)]

        return CommandResult(
            f"Replay of {self.log}",
            self.good,
            [_finding(self)],
            [
                Picture(picture, CAPTION, [folder / CURVES]),
                Facts({"controller": f"settings {self.settings[:16]} of {self.source}"}),
                ResultTable((), _rows(self)),
                *map(Sentence, self.remarks),
            ],
        )


def summarise(replay: LogReplay, log: str, source: str, settings: str) -> LogReplaySummary:
    """Compare logged and replayed commands."""
    time_s = replay.time_s - replay.time_s[0]
    difference_rad = replay.replayed_rad - replay.logged_rad
    unequal = np.flatnonzero((difference_rad != 0.0).any(axis=1))
    axes = errors_of(replay)
    verdict, missing = judge(replay, axes)
    rms_rad, largest_rad, largest_s = _of(difference_rad[replay.settled], time_s[replay.settled])
    return LogReplaySummary(
        log=log,
        source=source,
        settings=settings,
        steps=len(time_s),
        resampled=replay.resampled,
        equal_steps=len(time_s) - len(unequal),
        first_different_s=float(time_s[unequal[0]]) if len(unequal) else None,
        refused=int((replay.status != 0).sum()),
        lost=replay.lost,
        gaps=replay.gaps,
        judged=int(replay.settled.sum()),
        miss=(axes[0].miss, axes[1].miss),
        error_rad=(axes[0].error_rad, axes[1].error_rad),
        rms_rad=rms_rad,
        largest_rad=largest_rad,
        largest_s=largest_s,
        verdict=verdict,
        missing=missing,
        remarks=list(replay.remarks),
    )


Pair = tuple[float, float]


def _of(difference_rad: FloatArray, time_s: FloatArray) -> tuple[Pair, Pair, Pair]:
    """Return the rms of differences (k, 2), the largest ones and their times; NaN without any."""
    if not len(time_s):
        nothing = (np.nan, np.nan)
        return nothing, nothing, nothing
    rms_rad, largest = (
        np.sqrt((difference_rad * difference_rad).mean(axis=0)),
        np.abs(difference_rad).argmax(0),
    )
    return (
        (float(rms_rad[0]), float(rms_rad[1])),
        (float(difference_rad[largest[0], 0]), float(difference_rad[largest[1], 1])),
        (float(time_s[largest[0]]), float(time_s[largest[1]])),
    )


def _finding(summary: LogReplaySummary) -> str:
    """Say in one line whether the log is one of this controller."""
    miss = f"{100.0 * max(summary.miss):.2g} % of the logged command's motion"
    match summary.verdict:
        case ReplayVerdict.CANNOT_TELL:
            return f"CANNOT TELL whether it was this controller: {summary.missing}"
        case ReplayVerdict.NO:
            limit = f"more than the {100.0 * SAME:g} % allowed"
            return f"NOT THIS CONTROLLER, or not its inputs: it misses {miss}, {limit}"
    if summary.equal_steps == summary.steps:
        return f"all {summary.steps} commands of the log are those of this controller, bit for bit"
    return f"the commands of the log are those of this controller: it misses {miss}"


def _rows(summary: LogReplaySummary) -> list[tuple[str, str]]:
    """Return name and value of what was compared."""
    first = summary.first_different_s
    later = "" if first is None else f", the first other one after {first:.2f} s"
    lines = [
        ("equal in every bit", f"{summary.equal_steps} of {summary.steps} commands{later}"),
        ("refused inputs", str(summary.refused)),
        ("judged", f"{summary.judged} commands, {SETTLING_S:g} s or more after a beginning"),
    ]
    if summary.lost:
        behind = f"; it begins anew behind {summary.gaps} long gaps" if summary.gaps else ""
        lines.append(("lost", f"{summary.lost} of {summary.lost + summary.steps} updates{behind}"))
    for axis, miss, error_rad, rms_rad, largest_rad, at_s in zip(
        AXES,
        summary.miss,
        summary.error_rad,
        summary.rms_rad,
        summary.largest_rad,
        summary.largest_s,
        strict=True,
    ):
        lines.append(
            (
                axis,
                f"misses {100.0 * miss:.2g} % of the motion; difference {error_rad:.2g} rad in the middle, "
                f"{rms_rad:.2g} rad rms, {largest_rad:.2g} rad at {at_s:.2f} s",
            )
        )
    if summary.resampled:
        lines.append(("rate", "the log has another rate than the controller: its inputs are interpolated"))
    return lines
