"""How the replayed commands differ from the log's: record and result."""

from pathlib import Path
from typing import Final

import numpy as np
from markupsafe import Markup

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.model.identify.signals import TILTS
from mambo_sil.model.replay.input_errors import SETTLING_S
from mambo_sil.model.replay.log_replay import AXES, LogReplay
from mambo_sil.model.replay.replay_errors import errors_of
from mambo_sil.model.replay.replay_verdict import ReplayVerdict, judge
from mambo_sil.results.blocks import CommandResult, Facts, Picture, ResultTable, Sentence
from mambo_sil.results.summary import Number, ReportedSummary

CURVES: Final = "replay.csv"
PICTURES: Final = ("replay.png", "replay.svg")
CAPTION: Final = (
    "The logged commands, those of the compiled controller on the logged inputs, and their difference."
)


class LogReplaySummary(ReportedSummary):
    """A replay of a log."""

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
    axes: list[str]
    """What is compared: roll, pitch and, where the log has it and the settings command it, thrust."""
    lacks_thrust: bool
    """Whether the controller commands a thrust that the log does not have."""
    worst: list[Number]
    """Largest median error of a second, rad or m/s^2; what follows is by axis, too."""
    tolerated: list[Number]
    """What is allowed in that second."""
    from_s: list[Number]
    until_s: list[Number]
    """From when to when the axis is too far off, or the worst second; since the beginning of the log."""
    rms: list[Number]
    largest: list[Number]
    largest_s: list[Number]
    """Time since the beginning of the log of the largest error."""
    verdict: ReplayVerdict
    reason: str
    """Why."""
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
    difference = replay.replayed - replay.logged
    unequal = np.flatnonzero((difference != 0.0).any(axis=1))
    axes = errors_of(replay)
    verdict, reason = judge(replay, axes)
    rms, largest, largest_s = _sizes(difference[replay.settled], time_s[replay.settled])
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
        axes=[one.axis.name for one in axes],
        lacks_thrust=replay.settings.height is not None and len(axes) == len(TILTS),
        worst=[one.worst for one in axes],
        tolerated=[one.tolerated for one in axes],
        from_s=[one.from_s for one in axes],
        until_s=[one.until_s for one in axes],
        rms=rms,
        largest=largest,
        largest_s=largest_s,
        verdict=verdict,
        reason=reason,
        remarks=list(replay.remarks),
    )


def _sizes(difference: FloatArray, time_s: FloatArray) -> tuple[list[float], list[float], list[float]]:
    """Return the rms of differences (k, axes), the largest ones and their times; NaN without any."""
    columns = range(difference.shape[1])
    if not len(time_s):
        nothing = [np.nan for _ in columns]
        return nothing, nothing, nothing
    places = np.abs(difference).argmax(axis=0)
    rms = np.sqrt((difference * difference).mean(axis=0))
    return rms.tolist(), [float(difference[places[k], k]) for k in columns], time_s[places].tolist()


def _finding(summary: LogReplaySummary) -> str:
    """Say in one line whether the log is one of this controller."""
    match summary.verdict:
        case ReplayVerdict.CANNOT_TELL:
            return f"CANNOT TELL whether it was this controller: {summary.reason}"
        case ReplayVerdict.NO:
            return f"NOT THIS CONTROLLER, or not its inputs: {summary.reason}"
    which = "of roll and pitch, without the thrust, " if summary.lacks_thrust else "of the log "
    if summary.equal_steps == summary.steps:
        return f"all {summary.steps} commands {which}are those of this controller, bit for bit"
    return f"the commands {which}are those of this controller: {summary.reason}"


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
    for k, name in enumerate(summary.axes):
        unit = AXES[k].unit
        lines.append(
            (
                name,
                f"worst second {summary.worst[k]:.2g} {unit}, allowed {summary.tolerated[k]:.2g}; "
                f"{summary.rms[k]:.2g} {unit} rms, {summary.largest[k]:.2g} {unit} at "
                f"{summary.largest_s[k]:.2f} s",
            )
        )
    if summary.resampled:
        lines.append(("rate", "the log has another rate than the controller: its inputs are interpolated"))
    return lines
