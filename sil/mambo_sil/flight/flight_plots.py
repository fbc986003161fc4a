"""Pictures of flights: path, error, commands; as files and for a page.

Where a course has a height, the height is shown over time, too; where it climbs, the path also from the side.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec, GridSpecFromSubplotSpec

from mambo_sil.flight.fences import Walls, nears_limit
from mambo_sil.flight.flight_marks import NO_MARKS, FlightMarks
from mambo_sil.flight.metrics import TRANSIENT_S, horizontal_error_m, horizontal_speed_m_s
from mambo_sil.flight.traces import Trace
from mambo_sil.results.number_format import digits
from mambo_sil.results.pictures import inline, save
from mambo_sil.results.style import (
    BROAD,
    COLUMN_INCHES,
    COMMAND,
    DOT,
    FLOWN,
    INK,
    PAGE_INCHES,
    QUIET,
    TARGET,
    THIN,
    VERMILION,
    add_headline,
    style,
)

_PATH, _SIDE = "y (east), m", "height, m (side view)"
_HEIGHT, _SPEED, _ERROR = "height, m", "speed, m/s", "error, m"
_ANGLES: Final = ("roll, rad", "pitch, rad")
_TALL: Final = {_PATH: 1.9, _SIDE: 1.3}
"""Heights of panels, of which others have 1."""
_BOUND: Final[Mapping[str, Any]] = {"color": INK, "linestyle": "--", "linewidth": THIN}
"""How limits look."""

Panels = Mapping[str, Axes]
"""Axes by the labels of their ordinates."""


def draw_flight(
    trace: Trace, message: str, about: str, stem: Path, marks: FlightMarks = NO_MARKS
) -> tuple[Path, Path]:
    """Draw the first flight of a trace, its path beside what varies over time; write stem.png and stem.svg.

    Above it stands the message of the picture, and what is known about the flight.
    """
    with style():
        labels = _labels([trace], marks)
        seen = [label for label in labels if label in _TALL]
        over_time = [label for label in labels if label not in _TALL]
        figure = Figure(figsize=(PAGE_INCHES, 0.8 + 1.05 * len(over_time)), layout="constrained")
        add_headline(figure, message, about)
        halves = figure.add_gridspec(1, 2, width_ratios=(1.0, 1.2))
        heights = [_TALL[label] for label in seen]
        places = halves[0].subgridspec(len(seen), 1, height_ratios=heights)
        panels = _add_panels(figure, places, seen)
        panels |= _add_panels(figure, halves[1].subgridspec(len(over_time), 1), over_time)
        for label in over_time[:-1]:
            panels[label].sharex(panels[over_time[-1]])
            panels[label].tick_params(labelbottom=False)
        _draw(panels, trace, marks)
        panels[_PATH].invert_yaxis()  # seen from above, with north to the right
        return save(figure, stem)


def _add_panels(
    figure: Figure, places: GridSpec | GridSpecFromSubplotSpec, labels: Iterable[str]
) -> dict[str, Axes]:
    panels = {label: figure.add_subplot(places[row]) for row, label in enumerate(labels)}
    for label, axes in panels.items():
        axes.set_ylabel(label)
    return panels


def _labels(flights: Iterable[Trace], marks: FlightMarks) -> list[str]:
    """Return the panels of a flight, in their order, which several pictures share."""
    flights = list(flights)
    wanted = {
        _PATH: True,
        _SIDE: any(np.ptp(trace.target_height_m[:, 0]) > 0.0 for trace in flights),
        _ERROR: True,
        _HEIGHT: any(trace.spatial for trace in flights),
        _SPEED: any(nears_limit(trace, marks.speed_limit_m_s) for trace in flights),
        **dict.fromkeys(_ANGLES, True),
    }
    return [label for label, is_wanted in wanted.items() if is_wanted]


def _draw(panels: Panels, trace: Trace, marks: FlightMarks) -> None:
    """Draw the first flight of a trace.

    Target and commands are broad lines below the flown ones, so that both stay visible.
    """
    path = panels[_PATH]
    path.plot(*trace.target[:, 0, :2].T, color=TARGET, linewidth=BROAD, label="target")
    path.plot(*trace.position_m[:, 0, :2].T, color=FLOWN, label="flown")
    path.set(xlabel="x (north), m", aspect="equal", anchor="N")
    _draw_heights(panels, trace, marks.walls)
    _draw_error(panels[_ERROR], trace)
    if _SPEED in panels:
        panels[_SPEED].plot(trace.time_s, horizontal_speed_m_s(trace)[:, 0], color=FLOWN)
        panels[_SPEED].axhline(marks.speed_limit_m_s, **_BOUND)
        panels[_SPEED].set_ylim(0, None)
    for axis, label in enumerate(_ANGLES):
        command_rad, angle_rad = trace.command_rad[:, 0, axis], trace.euler_rad[:, 0, axis]
        panels[label].plot(trace.time_s, command_rad, color=COMMAND, linewidth=BROAD, label="command")
        panels[label].plot(trace.time_s, angle_rad, color=FLOWN, linewidth=THIN, label="flown")
    panels[_ANGLES[-1]].set_xlabel("time, s")
    for axes in (path, panels[_ANGLES[0]]):
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=3, borderaxespad=0.1)
    if marks.walls is not None:
        _draw_walls(path, marks.walls)
    if math.isfinite(marks.crash_s):
        _mark_crash(panels, trace, marks.crash_s)


def _draw_error(axes: Axes, trace: Trace) -> None:
    """Draw the horizontal error of the first flight over time; its axis is for what follows the transient."""
    error_m, started = horizontal_error_m(trace)[:, 0], trace.time_s >= TRANSIENT_S
    axes.plot(trace.time_s, error_m, color=FLOWN)
    axes.set_ylim(0, None)
    most_m, later_m = np.nanmax(error_m), np.nanmax(error_m, where=started, initial=0.0)
    if 2 * later_m < most_m and later_m > 0:
        axes.set_ylim(0, 1.4 * later_m)
        words = f"up to {digits(most_m)} m in the first {TRANSIENT_S:g} s"
        axes.text(0.99, 0.97, words, transform=axes.transAxes, ha="right", va="top", color=QUIET)


def _draw_walls(path: Axes, walls: Walls) -> None:
    """Draw the walls of a fence in a path seen from above."""
    for x_m, y_m, _ in (walls[:3], walls[3:]):
        if math.isfinite(x_m):
            path.axvline(x_m, **_BOUND)
        if math.isfinite(y_m):
            path.axhline(y_m, **_BOUND)


def _draw_heights(panels: Panels, trace: Trace, walls: Walls | None) -> None:
    """Draw the height of the first flight along x and over time, with floor and ceiling of a fence."""
    target_m, flown_m = trace.target_height_m[:, 0], -trace.position_m[:, 0, 2]
    along = {_SIDE: (trace.target[:, 0, 0], trace.position_m[:, 0, 0]), _HEIGHT: (trace.time_s, trace.time_s)}
    for label in along.keys() & panels.keys():
        targets, flown = along[label]
        panels[label].plot(targets, target_m, color=TARGET, linewidth=BROAD)
        panels[label].plot(flown, flown_m, color=FLOWN)
        for height_m in (walls[2], walls[5]) if walls else ():
            if math.isfinite(height_m):
                panels[label].axhline(height_m, **_BOUND)
    if _SIDE in panels:
        panels[_SIDE].set(xlabel="x (north), m", aspect="equal", anchor="N")


def _mark_crash(panels: Panels, trace: Trace, crash_s: float) -> None:
    """Put a cross where the drone crashed, and a line at that time."""
    place_m = trace.position_m[np.searchsorted(trace.time_s, crash_s), 0, :2]
    look: dict[str, Any] = {"color": VERMILION, "zorder": 5}
    panels[_PATH].plot(*place_m, "X", markersize=2.0 * DOT, label="crash", **look)
    panels[_PATH].legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=3, borderaxespad=0.1)
    for label, axes in panels.items():
        if label not in _TALL:
            axes.axvline(crash_s, **look)


def flight_columns(flights: Mapping[str, Trace], marks: FlightMarks = NO_MARKS) -> list[Markup]:
    """Return one picture per flight: path, height, error, roll and pitch, with the same scales in all."""
    with style():
        labels = _labels(flights.values(), marks)
        figures = [_column(title, trace, labels, marks) for title, trace in flights.items()]
        for row in zip(*(figure.axes for figure in figures), strict=True):
            _share_scales(row)
        for figure in figures:
            figure.axes[0].invert_yaxis()  # seen from above, with north to the right
        others = "".join(word for label, word in _WORDS.items() if label in labels)
        return [
            inline(
                figure,
                f"{title}: path seen from above, {others}distance to the target, roll and pitch over time",
            )
            for title, figure in zip(flights, figures, strict=True)
        ]


_WORDS: Final = {_HEIGHT: "height, ", _SPEED: "speed, "}


def _column(title: str, trace: Trace, labels: Sequence[str], marks: FlightMarks) -> Figure:
    heights = [_TALL.get(label, 1.0) for label in labels]
    figure = Figure(figsize=(COLUMN_INCHES, 1.347 * sum(heights)), layout="constrained")
    panels = _add_panels(figure, figure.add_gridspec(len(labels), 1, height_ratios=heights), labels)
    figure.suptitle(title, parse_math=False)  # above the legend, whatever the path's shape
    _draw(panels, trace, marks)
    return figure


def _share_scales(row: Sequence[Axes]) -> None:
    x = [value for axes in row for value in axes.get_xlim()]
    y = [value for axes in row for value in axes.get_ylim()]
    for axes in row:
        axes.set(xlim=(min(x), max(x)), ylim=(min(y), max(y)))
