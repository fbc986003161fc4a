"""The results of a flight of an app on the desk: summary, result and picture."""

import csv
import math
from pathlib import Path
from typing import Final

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from mambo_codegen.errors import echo
from mambo_extensions.crazyflie.desk.desk_events import DeskTrace
from mambo_extensions.crazyflie.desk.events_file import BoundSection, EventsFile, MeasureName
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import ResultsError
from mambo_sil.flight.passing import PassedSummary, missed_words
from mambo_sil.results.blocks import CommandResult, Picture, ResultTable, Sentence
from mambo_sil.results.number_format import digits
from mambo_sil.results.pictures import inline, save
from mambo_sil.results.style import LOOKS, PAGE_INCHES, QUIET, THIN, style
from mambo_sil.results.summary import Number, ReportedSummary

DESK_FILES: Final = ("trace.csv", "flight.png", "flight.svg")
COLUMNS: Final = (
    *("time_s", "x_m", "y_m", "z_m", "target_x_m", "target_y_m", "target_z_m"),
    *("command_roll_rad", "command_pitch_rad", "lost"),
)
WORDS: Final[dict[MeasureName, tuple[str, str]]] = {
    "lowest_m": ("lowest height", "m"),
    "highest_m": ("largest height", "m"),
    "off_m": ("largest distance to the target", "m"),
    "mean_m": ("mean distance to the target", "m"),
    "drift_m": ("of it drift, the mean distance to one side", "m"),
    "height_off_m": ("largest difference to its height", "m"),
    "iae_60_s_m_s": ("IAE of 60 s", "m s"),
    "command_rms_rad": ("command, root mean square", "rad"),
    "touch_m_s": ("fastest touch-down", "m/s"),
    "told_s": ("loss of position reported after", "s"),
    "lost_s": ("reported before the loss, for", "s"),
    "largest_x_m": ("largest x", "m"),
}


class DeskSummary(ReportedSummary):
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
    passed: list[PassedSummary] | None = None
    console: str

    @property
    def good(self) -> bool:
        """Whether every measure is within the bounds of the events file, and no point of a plan is missed."""
        return not self.broken and not any(one.missed for one in self.passed or ())

    def result(self, folder: Path, /) -> CommandResult:
        """Return the result of this flight; drawing raises ResultsError."""
        path = folder / DESK_FILES[0]
        flown = self.flight.trajectory if self.events is None else echo(self.events)
        name = f"of {echo(self.source)} on the desk's Crazyflie, {flown}"

        def picture() -> list[Markup]:
            with style():
                figure = _figure(read_trace(path), self.flight, "")
                return [inline(figure, "Height, distance to the target and command over time")]

        return CommandResult(
            f"App {name}",
            self.good if self.flight.bounds or self.passed else None,
            [_verdict(self), *([missed_words(self.passed)] if self.passed else [])],
            [
                Picture(picture, "Height, distance to the target and command.", [path]),
                ResultTable(("", "", "", "bound", ""), _rows(self), (0, 2, 3, 4)),
                *(Sentence(f"console: {line}") for line in self.console.splitlines() if line),
            ],
            f"app {name}",
        )


def _verdict(summary: DeskSummary) -> str:
    """Return in words whether bounds were kept, whether the drone stayed in the air, and how near it was."""
    count, measures = len(summary.flight.bounds), summary.measures
    kept = f"{len(summary.broken)} of {count} bounds BROKEN" if summary.broken else f"{count} bounds kept"
    mean_m, drift_m, touch_m_s = (measures[name] for name in ("mean_m", "drift_m", "touch_m_s"))
    held = "held" if touch_m_s == 0.0 else f"on the floor, at {touch_m_s:.1f} m/s"
    if not math.isfinite(mean_m):
        held, near = "LOST", ""
    else:
        near = f", {100.0 * mean_m:.1f} cm off in the mean, of it {100.0 * drift_m:.1f} cm drift"
    return f"{f'{kept}; ' if count else ''}{held}{near}"


def _rows(summary: DeskSummary) -> list[tuple[str, ...]]:
    """Return a row for each measure that has a value or a bound."""
    rows: list[tuple[str, ...]] = []
    for key, value in summary.measures.items():
        bound = summary.flight.bounds.get(key)
        if np.isfinite(value) or bound is not None:
            name, unit = WORDS[key]
            rows.append((name, digits(value), unit, _bound(bound), "BROKEN" if key in summary.broken else ""))
    return rows


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


def read_trace(path: Path) -> FloatArray:
    """Return the columns (11, n) of a trace.csv, in the order of `COLUMNS`; raises ResultsError."""
    wrong = f"{path}: is not what {DeskSummary.command} writes; run it again"
    try:
        with path.open(encoding="utf-8", newline="") as file:
            header, *rows = csv.reader(file)
        values = np.array(rows, np.float64).reshape(-1, len(COLUMNS))
    except (OSError, ValueError, csv.Error) as error:
        raise ResultsError(wrong) from error
    if tuple(header) != COLUMNS or not len(values):
        raise ResultsError(wrong)
    return values.T


def draw_flight(path: Path, events: EventsFile, title: str) -> tuple[Path, Path]:
    """Draw height, distance to the target, and the command of a trace.csv; lines mark events."""
    with style():
        return save(_figure(read_trace(path), events, title), path.with_name("flight"))


def _figure(values: FloatArray, events: EventsFile, title: str) -> Figure:
    time_s, x_m, y_m, z_m, target_x_m, target_y_m, target_z_m, *commands_rad, _lost = values
    figure = Figure(figsize=(PAGE_INCHES, 5.0), layout="constrained")
    over_time, above = figure.subfigures(1, 2, squeeze=False, width_ratios=(1.5, 1.0))[0]
    height, distance, command = over_time.subplots(3, 1, sharex=True)
    flown, target = LOOKS[0].line, LOOKS[1].line
    height.plot(time_s, z_m, label="flown", **flown)
    height.plot(time_s, target_z_m, label="target", **target)
    distance.plot(time_s, np.hypot(x_m - target_x_m, y_m - target_y_m), **flown)
    for name, command_rad, look in zip(("roll", "pitch"), commands_rad, LOOKS, strict=False):
        command.plot(time_s, command_rad, label=name, **look.line)
    for axes in (height, distance, command):
        for event in events.event:
            axes.axvline(event.at_s, color=QUIET, linewidth=THIN)
    plan = above.subplots()
    plan.plot(y_m, x_m, label="flown", **flown)
    plan.plot(target_y_m, target_x_m, label="target", **target)
    plan.set(xlabel="y (to the left), m", ylabel="x (ahead), m", aspect="equal", adjustable="datalim")
    plan.invert_xaxis()  # x ahead is up, y to the left is left: as seen by who stands behind the start
    figure.suptitle(title, parse_math=False)
    height.set(ylabel="height, m")
    distance.set(ylabel="distance, m", ylim=(0.0, None))
    command.set(ylabel="command, rad", xlabel="time, s")
    height.legend()
    command.legend()
    return figure
