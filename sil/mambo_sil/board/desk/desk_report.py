"""The results of a flight of an app on the desk: summary, text, table and picture."""

import csv
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.figure import Figure

from mambo_codegen.errors import echo
from mambo_sil.board.desk.desk_events import DeskTrace
from mambo_sil.board.desk.events_file import BoundSection, EventsFile, MeasureName
from mambo_sil.results.number_format import digits
from mambo_sil.results.pictures import save
from mambo_sil.results.style import LOOKS, PAGE_INCHES, QUIET, THIN, style
from mambo_sil.results.summary import Number, Summary
from mambo_sil.results.terminal import sentence, table

DESK_FILES: Final = ("trace.csv", "flight.png", "flight.svg")
COLUMNS: Final = (
    *("time_s", "x_m", "y_m", "z_m", "target_x_m", "target_y_m", "target_z_m"),
    *("command_roll_rad", "command_pitch_rad", "lost"),
)
WORDS: Final[dict[MeasureName, tuple[str, str]]] = {
    "lowest_m": ("lowest height", "m"),
    "highest_m": ("largest height", "m"),
    "off_m": ("largest distance to the target", "m"),
    "height_off_m": ("largest difference to its height", "m"),
    "iae_60_s_m_s": ("IAE of 60 s", "m s"),
    "command_rms_rad": ("command, root mean square", "rad"),
    "touch_m_s": ("fastest touch-down", "m/s"),
    "told_s": ("told that the position is lost after", "s"),
    "lost_s": ("told so before", "s"),
    "largest_x_m": ("largest x", "m"),
}


class DeskSummary(Summary):
    """The results of `fly --app`."""

    command = "fly --app"

    app: str
    source: str
    settings: str
    events: str | None
    flight: EventsFile
    seed: int
    measures: dict[MeasureName, Number]
    broken: list[MeasureName]
    console: str

    @property
    def good(self) -> bool:
        """Whether every measure is within the bounds of the events file."""
        return not self.broken


def desk_text(summary: DeskSummary) -> str:
    """Format a summary: the answer, a measure per line with its bound, and what the app printed."""
    rows = []
    for key, value in summary.measures.items():
        bound = summary.flight.bounds.get(key)
        if np.isfinite(value) or bound is not None:
            name, unit = WORDS[key]
            rows.append((name, digits(value), unit, _bound(bound), "BROKEN" if key in summary.broken else ""))
    flown = summary.flight.trajectory if summary.events is None else echo(summary.events)
    count = len(summary.flight.bounds)
    verdict = f"{len(summary.broken)} of {count} bounds BROKEN" if summary.broken else f"{count} bounds kept"
    said = verdict if count else "flown"
    answer = f"app of {echo(summary.source)} on the desk's Crazyflie, {flown}: {said}"
    lines = [sentence(answer), *table(("", "", "", "bound", ""), rows, (0, 2, 3, 4))]
    return "\n".join([*lines, *(f"console: {line}" for line in summary.console.splitlines() if line)])


def _bound(bound: BoundSection | None) -> str:
    if bound is None:
        return ""
    shown = [f">= {bound.least:g}"] if bound.least is not None else []
    return ", ".join([*shown, *([f"<= {bound.most:g}"] if bound.most is not None else [])])


def write_trace(trace: DeskTrace, path: Path) -> None:
    """Write a flight as CSV with the columns `COLUMNS`, in the firmware's frame."""
    parts = (trace.time_s, trace.position_m, trace.target_m, trace.command_rad, trace.lost)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows(np.column_stack(parts).tolist())


def draw_flight(trace: DeskTrace, file: EventsFile, title: str, stem: Path) -> tuple[Path, Path]:
    """Draw height, distance to the target, and the command over time; lines mark events."""
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 5.0), layout="constrained")
        height, distance, command = figure.subplots(3, 1, sharex=True)
        flown, target = LOOKS[0].line, LOOKS[1].line
        height.plot(trace.time_s, trace.position_m[:, 2], label="flown", **flown)
        height.plot(trace.time_s, trace.target_m[:, 2], label="target", **target)
        off = trace.position_m - trace.target_m
        distance.plot(trace.time_s, np.hypot(off[:, 0], off[:, 1]), **flown)
        for index, (name, look) in enumerate(zip(("roll", "pitch"), LOOKS, strict=False)):
            command.plot(trace.time_s, trace.command_rad[:, index], label=name, **look.line)
        for axes in (height, distance, command):
            for event in file.event:
                axes.axvline(event.at_s, color=QUIET, linewidth=THIN)
        height.set(title=title, ylabel="height, m")
        distance.set(ylabel="distance, m", ylim=(0.0, None))
        command.set(ylabel="command, rad", xlabel="time, s")
        height.legend()
        command.legend()
        return save(figure, stem)
