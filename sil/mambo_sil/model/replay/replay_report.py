"""How the replayed commands differ from those of the log: record, text, section of the report."""

from pathlib import Path
from typing import Final

import numpy as np

from mambo_sil.model.replay.log_replay import AXES, LogReplay
from mambo_sil.results.summary import Number, ReportedSummary, Section
from mambo_sil.results.terminal import sentence, table

CURVES: Final = "replay.csv"
PICTURES: Final = ("replay.png", "replay.svg")

SETTLING_S: Final = 1.0
"""Time from the beginning of a log in which the estimates of the controller approach those of the flight."""
GOOD_EXPLAINED: Final = 0.9
"""Least share of the logged command that a replay of the controller that flew explains."""


class LogReplaySummary(ReportedSummary):
    """A replay of a log; what is by axis has roll and pitch."""

    command = "replay"

    log: str
    source: str
    settings: str
    steps: int
    resampled: bool
    equal_steps: int
    """Steps whose logged command the controller repeats in every bit, as it is after `SETTLING_S`."""
    first_different_s: Number | None
    """Time since the beginning of the log of the first other step, None if there is none."""
    refused: int
    explained: tuple[Number, Number]
    """After `SETTLING_S`, 1 less the variance of the difference over that of the logged command."""
    rms_rad: tuple[Number, Number]
    largest_rad: tuple[Number, Number]
    largest_s: tuple[float, float]
    """Time since the beginning of the log of the largest difference."""
    remarks: list[str]

    @property
    def same_bits(self) -> bool:
        """Whether every command is that of the log, bit for bit."""
        return self.equal_steps == self.steps

    @property
    def good(self) -> bool:
        """Whether the log is one of this controller."""
        return self.same_bits or min(self.explained) >= GOOD_EXPLAINED

    def section(self, folder: Path) -> Section:
        """Return the section of the report on this replay; raises ResultsError."""
        from mambo_sil.model.replay.replay_plots import replay_panel  # noqa: PLC0415 - loaded when drawing

        curves = folder / CURVES
        there = curves.is_file()
        content = {
            "facts": {
                "controller": f"settings {self.settings[:16]} of {self.source}",
                **dict(rows(self)),
            },
            "remarks": self.remarks,
            "picture": replay_panel(curves) if there else None,
        }
        missing = [] if there else [CURVES]
        return Section("replay", f"Replay of {self.log}", self.good, finding(self), content, missing)


def summarise(replay: LogReplay, log: str, source: str, settings: str) -> LogReplaySummary:
    """Compare logged and replayed commands."""
    time_s = replay.time_s - replay.time_s[0]
    settled = time_s >= min(SETTLING_S, float(time_s[-1]))
    difference_rad = replay.replayed_rad - replay.logged_rad
    unequal = np.flatnonzero((replay.replayed_rad != replay.logged_rad).any(axis=1))
    late_rad, logged_rad = difference_rad[settled], replay.logged_rad[settled]
    largest = np.abs(late_rad).argmax(axis=0)
    with np.errstate(all="ignore"):
        explained = 1.0 - late_rad.var(axis=0) / logged_rad.var(axis=0)
        rms_rad = np.sqrt((late_rad * late_rad).mean(axis=0))
    return LogReplaySummary(
        log=log,
        source=source,
        settings=settings,
        steps=len(time_s),
        resampled=replay.resampled,
        equal_steps=len(time_s) - len(unequal),
        first_different_s=float(time_s[unequal[0]]) if len(unequal) else None,
        refused=int((replay.status != 0).sum()),
        explained=(float(explained[0]), float(explained[1])),
        rms_rad=(float(rms_rad[0]), float(rms_rad[1])),
        largest_rad=(float(late_rad[largest[0], 0]), float(late_rad[largest[1], 1])),
        largest_s=(float(time_s[settled][largest[0]]), float(time_s[settled][largest[1]])),
        remarks=list(replay.remarks),
    )


def finding(summary: LogReplaySummary) -> str:
    """Say in one line whether the log is one of this controller."""
    if summary.same_bits:
        return f"all {summary.steps} commands of the log are those of this controller, bit for bit"
    explained = min(summary.explained)
    if summary.good:
        return f"this controller explains {100.0 * explained:.4g} % of the logged command"
    return (
        f"NOT THIS CONTROLLER, or not its inputs: it explains {100.0 * max(explained, 0.0):.3g} % of the "
        f"logged command, and should {100.0 * GOOD_EXPLAINED:g} %"
    )


def rows(summary: LogReplaySummary) -> list[tuple[str, str]]:
    """Return name and value of what text and page show."""
    first = summary.first_different_s
    lines = [
        ("equal in every bit", f"{summary.equal_steps} of {summary.steps} commands")
        if first is None
        else (
            "equal in every bit",
            f"{summary.equal_steps} of {summary.steps} commands, the first other one after {first:.2f} s",
        ),
        ("refused inputs", str(summary.refused)),
    ]
    for axis, explained, rms_rad, largest_rad, at_s in zip(
        AXES, summary.explained, summary.rms_rad, summary.largest_rad, summary.largest_s, strict=True
    ):
        lines.append(
            (
                f"{axis} after {SETTLING_S:g} s",
                f"{100.0 * explained:.4g} % explained; difference {rms_rad:.3g} rad rms, "
                f"{largest_rad:.3g} rad at {at_s:.2f} s",
            )
        )
    if summary.resampled:
        lines.append(("rate", "the log has another rate than the controller: its inputs are interpolated"))
    return lines


def replay_text(summary: LogReplaySummary) -> str:
    """Format a summary."""
    lines = [sentence(finding(summary)), "", *table((), rows(summary), (0, 1))]
    return "\n".join([*lines, *map(sentence, summary.remarks)])
