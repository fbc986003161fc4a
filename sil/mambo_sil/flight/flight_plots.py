"""Pictures of flights as in the paper's Fig. 3: path, error, commands; as files and for a page."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from mambo_sil.flight.animation import animate
from mambo_sil.flight.metrics import horizontal_error_m
from mambo_sil.flight.traces import Trace
from mambo_sil.results.pictures import inline, save
from mambo_sil.results.style import BROAD, COLUMN_INCHES, COMMAND, FLOWN, TARGET, THIN, style

_LABELS: Final = ("y (east), m", "error, m", "roll, rad", "pitch, rad")


def draw_flights(flights: Mapping[str, Trace], stem: Path) -> tuple[Path, Path]:
    """Draw the first flight of each trace as one column with the same scales in all columns.

    Writes stem.png and stem.svg.
    """
    with style():
        figure = Figure(figsize=(COLUMN_INCHES * len(flights), 7.2), layout="constrained")
        rows = figure.subplots(4, len(flights), squeeze=False, sharey="row", height_ratios=(1.9, 1, 1, 1))
        for column, (title, trace) in zip(rows.T, flights.items(), strict=True):
            _draw_column(column, trace, title)
        _share_scales(rows[0])
        rows[0, 0].invert_yaxis()  # shared: seen from above, with north to the right
        _label_column(rows[:, 0])
        return save(figure, stem)


def _draw_column(column: NDArray[Any], trace: Trace, title: str) -> None:
    """Draw the first flight of a trace in four axes (4,): path, error, roll, pitch.

    Target and commands are broad lines below the flown ones, so that both stay visible.
    """
    path, error, *angles = column
    path.plot(*trace.target[:, 0, :2].T, color=TARGET, linewidth=BROAD, label="target")
    path.plot(*trace.position_m[:, 0, :2].T, color=FLOWN, label="flown")
    path.set_title(title, loc="left", pad=20, parse_math=False)  # above the legend
    path.set(xlabel="x (north), m", aspect="equal")
    error.plot(trace.time_s, horizontal_error_m(trace)[:, 0], color=FLOWN)
    error.set_ylim(0, None)
    for axis, axes in enumerate(angles):
        axes.plot(
            trace.time_s, trace.command_rad[:, 0, axis], color=COMMAND, linewidth=BROAD, label="command"
        )
        axes.plot(trace.time_s, trace.euler_rad[:, 0, axis], color=FLOWN, linewidth=THIN, label="flown")
    angles[-1].set_xlabel("time, s")


def _label_column(column: NDArray[Any]) -> None:
    for axes, label in zip(column, _LABELS, strict=True):
        axes.set_ylabel(label)
    for axes in (column[0], column[2]):
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, borderaxespad=0.1)


def page_pictures(flights: Mapping[str, Trace]) -> dict[str, Any]:
    """Return animation and pictures of flights for a page, if there are any flights."""
    return {
        "animation": animate(flights) if flights else None,
        "columns": flight_columns(flights) if flights else [],
    }


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
    figure = Figure(figsize=(COLUMN_INCHES, 6.6), layout="constrained")
    column = figure.subplots(len(_LABELS), 1, height_ratios=(1.9, 1, 1, 1))
    _draw_column(column, trace, "")
    figure.suptitle(title, parse_math=False)  # above the legend, whatever the path's shape
    _label_column(column)
    return figure


def _share_scales(row: Sequence[Axes]) -> None:
    x = [value for axes in row for value in axes.get_xlim()]
    y = [value for axes in row for value in axes.get_ylim()]
    for axes in row:
        axes.set(xlim=(min(x), max(x)), ylim=(min(y), max(y)))
