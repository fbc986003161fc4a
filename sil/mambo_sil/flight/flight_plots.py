"""Pictures of flights as in the paper's Fig. 3: path, error, commands; as files and for a page.

Where a course has a height, the path is shown from the side, too, and the height over time.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from mambo_sil.flight.fences import Walls, nears_limit
from mambo_sil.flight.metrics import TRANSIENT_S, horizontal_error_m, horizontal_speed_m_s
from mambo_sil.flight.traces import Trace
from mambo_sil.results.number_format import digits
from mambo_sil.results.pictures import inline, save
from mambo_sil.results.style import BROAD, COLUMN_INCHES, COMMAND, FLOWN, INK, QUIET, TARGET, THIN, style

_LEVEL: Final = {"y (east), m": 1.9, "error, m": 1.0, "roll, rad": 1.0, "pitch, rad": 1.0}
_SPATIAL: Final = {
    "y (east), m": 1.9,
    "height from the east, m": 1.3,
    "height, m": 1.0,
    "horizontal error, m": 1.0,
    "roll, rad": 1.0,
    "pitch, rad": 1.0,
}
"""Labels of the axes of a column, and their heights relative to each other."""
_BOUND: Final[Mapping[str, Any]] = {"color": INK, "linestyle": "--", "linewidth": THIN}
"""How limits look."""
_SPEED: Final = "speed, m/s"
_ABOVE_ERROR: Final = -4
"""Row of the speed: above error, roll and pitch."""


def draw_flights(
    flights: Mapping[str, Trace], stem: Path, walls: Walls | None = None, speed_limit_m_s: float = 0.0
) -> tuple[Path, Path]:
    """Draw the first flight of each trace as one column with the same scales in all columns, and the fence.

    The speed and its limit (0: none) are shown where a flight comes near it. Writes stem.png and stem.svg.
    """
    with style():
        labels = _labels(flights, speed_limit_m_s)
        figure = Figure(
            figsize=(COLUMN_INCHES * len(flights), 1.47 * sum(labels.values())), layout="constrained"
        )
        ratios = tuple(labels.values())
        rows = figure.subplots(len(labels), len(flights), squeeze=False, sharey="row", height_ratios=ratios)
        for column, (title, trace) in zip(rows.T, flights.items(), strict=True):
            _draw_column(column, trace, title, walls, speed_limit_m_s if _SPEED in labels else 0.0)
        _share_scales(rows[0])
        rows[0, 0].invert_yaxis()  # shared: seen from above, with north to the right
        _label_column(rows[:, 0], labels)
        return save(figure, stem)


def _labels(flights: Mapping[str, Trace], speed_limit_m_s: float) -> dict[str, float]:
    """Return the labels of the axes of a column, and their relative heights."""
    labels = _SPATIAL if any(trace.spatial for trace in flights.values()) else _LEVEL
    placed = list(labels.items())
    if any(nears_limit(trace, speed_limit_m_s) for trace in flights.values()):
        placed.insert(_ABOVE_ERROR + 1, (_SPEED, 1.0))
    return dict(placed)


def _draw_column(
    column: NDArray[Any], trace: Trace, title: str, walls: Walls | None, speed_limit_m_s: float
) -> None:
    """Draw the first flight of a trace in axes (4,): path, error, roll, pitch; or (6,), with the height.

    With a speed limit the speed is above the error. Target and commands are broad lines below the flown ones,
    so that both stay visible.
    """
    if speed_limit_m_s:
        _draw_speed(column[_ABOVE_ERROR], trace, speed_limit_m_s)
        column = np.delete(column, _ABOVE_ERROR)
    path, *heights, error, roll, pitch = column
    angles = roll, pitch
    path.plot(*trace.target[:, 0, :2].T, color=TARGET, linewidth=BROAD, label="target")
    path.plot(*trace.position_m[:, 0, :2].T, color=FLOWN, label="flown")
    path.set_title(title, loc="left", pad=20, parse_math=False)  # above the legend
    path.set(xlabel="x (north), m", aspect="equal")
    if heights:
        _draw_heights(heights, trace, walls)
    _draw_error(error, trace)
    for axis, axes in enumerate(angles):
        axes.plot(
            trace.time_s, trace.command_rad[:, 0, axis], color=COMMAND, linewidth=BROAD, label="command"
        )
        axes.plot(trace.time_s, trace.euler_rad[:, 0, axis], color=FLOWN, linewidth=THIN, label="flown")
    angles[-1].set_xlabel("time, s")
    if walls is not None:
        _draw_walls(path, walls)


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


def _draw_speed(axes: Axes, trace: Trace, limit_m_s: float) -> None:
    """Draw the horizontal speed of the first flight and its limit over time."""
    axes.plot(trace.time_s, horizontal_speed_m_s(trace)[:, 0], color=FLOWN)
    axes.axhline(limit_m_s, **_BOUND)
    axes.set_ylim(0, None)


def _draw_walls(path: Axes, walls: Walls) -> None:
    """Draw the walls of a fence in a path seen from above."""
    for x_m, y_m, _ in (walls[:3], walls[3:]):
        if math.isfinite(x_m):
            path.axvline(x_m, **_BOUND)
        if math.isfinite(y_m):
            path.axhline(y_m, **_BOUND)


def _draw_heights(axes: Sequence[Axes], trace: Trace, walls: Walls | None) -> None:
    """Draw the height of the first flight along x and over time, with floor and ceiling of a fence."""
    target_m, flown_m = trace.target_height_m[:, 0], -trace.position_m[:, 0, 2]
    abscissae = (trace.target[:, 0, 0], trace.position_m[:, 0, 0]), (trace.time_s, trace.time_s)
    for place, (targets, flown) in zip(axes, abscissae, strict=True):
        place.plot(targets, target_m, color=TARGET, linewidth=BROAD)
        place.plot(flown, flown_m, color=FLOWN)
        for height_m in (walls[2], walls[5]) if walls else ():
            if math.isfinite(height_m):
                place.axhline(height_m, **_BOUND)
    axes[0].set(xlabel="x (north), m")
    axes[0].set_aspect("equal", adjustable="datalim")


def _label_column(column: NDArray[Any], labels: Mapping[str, float]) -> None:
    for axes, label in zip(column, labels, strict=True):
        axes.set_ylabel(label)
    for axes in (column[0], column[-2]):
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, borderaxespad=0.1)


def flight_columns(
    flights: Mapping[str, Trace], walls: Walls | None = None, speed_limit_m_s: float = 0.0
) -> list[Markup]:
    """Return one picture per flight: path, height, error, roll and pitch, with the same scales in all.

    Fence and speed are shown as in `draw_flights`.
    """
    with style():
        labels = _labels(flights, speed_limit_m_s)
        height = "height, " if "height, m" in labels else ""
        speed = "speed, " if _SPEED in labels else ""
        limit_m_s = speed_limit_m_s if speed else 0.0
        figures = [_column(title, trace, labels, walls, limit_m_s) for title, trace in flights.items()]
        for row in zip(*(figure.axes for figure in figures), strict=True):
            _share_scales(row)
        for figure in figures:
            figure.axes[0].invert_yaxis()  # seen from above, with north to the right
        return [
            inline(
                figure,
                f"{title}: path seen from above, {height}{speed}distance to the target, "
                "roll and pitch over time",
            )
            for title, figure in zip(flights, figures, strict=True)
        ]


def _column(
    title: str, trace: Trace, labels: Mapping[str, float], walls: Walls | None, speed_limit_m_s: float
) -> Figure:
    figure = Figure(figsize=(COLUMN_INCHES, 1.347 * sum(labels.values())), layout="constrained")
    column = figure.subplots(len(labels), 1, height_ratios=tuple(labels.values()))
    _draw_column(column, trace, "", walls, speed_limit_m_s)
    figure.suptitle(title, parse_math=False)  # above the legend, whatever the path's shape
    _label_column(column, labels)
    return figure


def _share_scales(row: Sequence[Axes]) -> None:
    x = [value for axes in row for value in axes.get_xlim()]
    y = [value for axes in row for value in axes.get_ylim()]
    for axes in row:
        axes.set(xlim=(min(x), max(x)), ylim=(min(y), max(y)))
