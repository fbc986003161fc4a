"""Pictures of flights as in the paper's Fig. 3: path, error, commands; as files and for a page."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from mambo_nmpc.sil.flight.metrics import horizontal_error_m
from mambo_nmpc.sil.flight.traces import Trace
from mambo_nmpc.sil.show.plots import COMMAND, FLOWN, PANEL_INCHES, TARGET, inline, save, style

_LABELS: Final = ("y (east), m", "error, m", "roll, rad", "pitch, rad")

_HEIGHT_INCHES: Final = 8.2


def draw_flights(flights: Mapping[str, Trace], stem: Path) -> tuple[Path, Path]:
    """Draw the first flight of each trace as one column with the same scales in all columns.

    Writes stem.png and stem.svg.
    """
    with style():
        figure = Figure(figsize=(PANEL_INCHES * len(flights), _HEIGHT_INCHES), layout="constrained")
        rows = figure.subplots(4, len(flights), squeeze=False, sharey="row", height_ratios=(1.9, 1, 1, 1))
        for column, (title, trace) in zip(rows.T, flights.items(), strict=True):
            _draw_column(column, trace, title)
        for axes, label in zip(rows[:, 0], _LABELS, strict=True):
            axes.set_ylabel(label)
        _share_scales(rows[0])
        rows[0, 0].invert_yaxis()  # shared: seen from above, with north to the right
        for axes in (rows[0, 0], rows[2, 0]):
            axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, borderaxespad=0.1)
        return save(figure, stem)


def _draw_column(column: NDArray[Any], trace: Trace, title: str) -> None:
    """Draw the first flight of a trace in four axes (4,): path, error, roll, pitch."""
    _draw_path(column[0], trace, title)
    _draw_error(column[1], trace)
    _draw_angle(column[2], trace, axis=0)
    _draw_angle(column[3], trace, axis=1)
    column[3].set_xlabel("time, s")


def _draw_path(axes: Axes, trace: Trace, title: str) -> None:
    """Draw path and target; the target is a broad line below the path, so that both stay visible."""
    target, flown = trace.target[:, 0], trace.position_m[:, 0]
    axes.plot(target[:, 0], target[:, 1], color=TARGET, linewidth=4, label="target")
    axes.plot(flown[:, 0], flown[:, 1], color=FLOWN, label="flown")
    axes.set_title(title, loc="right", parse_math=False)
    axes.set(xlabel="x (north), m", aspect="equal")


def _draw_error(axes: Axes, trace: Trace) -> None:
    axes.plot(trace.time_s, horizontal_error_m(trace)[:, 0], color=FLOWN)
    axes.set_ylim(0, None)


def _draw_angle(axes: Axes, trace: Trace, axis: int) -> None:
    """Draw angle and command; the command is a broader line below the angle, so that both stay visible."""
    axes.plot(trace.time_s, trace.command_rad[:, 0, axis], color=COMMAND, linewidth=2, label="command")
    axes.plot(trace.time_s, trace.euler_rad[:, 0, axis], color=FLOWN, linewidth=0.9, label="flown")


def flight_columns(flights: Mapping[str, Trace]) -> list[Markup]:
    """Return one picture per flight: path, error, roll and pitch, with the same scales in all."""
    with style():
        figures = [_column(title, trace) for title, trace in flights.items()]
        for row in zip(*(figure.axes for figure in figures), strict=True):
            _share_scales(row)
        for figure in figures:
            figure.axes[0].invert_yaxis()  # seen from above, with north to the right
        return [
            inline(figure, f"{title}: path seen from above, distance to the target, roll and pitch over time")
            for title, figure in zip(flights, figures, strict=True)
        ]


def _column(title: str, trace: Trace) -> Figure:
    figure = Figure(figsize=(PANEL_INCHES, 7.6), layout="constrained")
    column = figure.subplots(len(_LABELS), 1, height_ratios=(1.9, 1, 1, 1))
    _draw_column(column, trace, "")
    figure.suptitle(title, fontsize=10, parse_math=False)  # above the legend, whatever the path's shape
    for axes, label in zip(column, _LABELS, strict=True):
        axes.set_ylabel(label)
    for axes in (column[0], column[2]):
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, borderaxespad=0.1)
    return figure


def _share_scales(row: Sequence[Axes]) -> None:
    x = [value for axes in row for value in axes.get_xlim()]
    y = [value for axes in row for value in axes.get_ylim()]
    for axes in row:
        axes.set(xlim=(min(x), max(x)), ylim=(min(y), max(y)))
