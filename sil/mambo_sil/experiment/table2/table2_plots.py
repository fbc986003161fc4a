"""Figure 3 of the paper, flown again: path, error, roll over a lap, and the commands of one second."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from mambo_sil.flight.metrics import horizontal_error_m
from mambo_sil.flight.names import PD, PD_TITLES
from mambo_sil.flight.traces import Trace
from mambo_sil.results.pictures import PlainLogFormatter, save
from mambo_sil.results.style import BROAD, COMMAND, FLOWN, PAGE_INCHES, TARGET, THIN, style

DRAWN: Final = {
    PD: "PD of the paper",
    PD_TITLES["pd-feedforward"]: "PD with feed-forward",
    "mambo": "preset mambo",
    "mambo-1norm": "preset mambo-1norm",
}
"""Titles of the columns, by controller."""

_LAP_S: Final = (50.0, 62.6)
"""One turn of the figure of eight at 0.5 rad/s, long after the start."""
_SECOND_S: Final = (54.0, 55.0)
_EVERY: Final = 5
"""Updates from point to point of path and error: 0.05 s."""
_LEAST_ERROR_M: Final = 1e-4


def draw_figure3(flights: Mapping[str, Trace], stem: Path) -> tuple[Path, Path]:
    """Draw the first flight of each trace as a column, of the controllers in `DRAWN`.

    Writes stem.png and stem.svg.
    """
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 6.3), layout="constrained")
        rows = figure.subplots(4, len(flights), sharey="row", height_ratios=(1.25, 1, 1, 1), squeeze=False)
        for number, (column, (name, trace)) in enumerate(zip(rows.T, flights.items(), strict=True)):
            _draw_column(column, trace)
            column[0].set_title(f"({'abcd'[number]}) {DRAWN[name]}", loc="left", parse_math=False)
        rows[0, 0].invert_yaxis()  # shared: seen from above, with north to the right
        _label(rows)
        handles = {
            label: handle
            for axes in (rows[0, 0], rows[2, 0])
            for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
        }
        figure.legend(list(handles.values()), list(handles), loc="outside upper center", ncols=len(handles))
        return save(figure, stem)


def _draw_column(column: NDArray[Any], trace: Trace) -> None:
    """Draw the first flight of a trace in four axes (4,): path, error, roll over a lap, over a second."""
    path, error, lap, second = column
    path.plot(*trace.target[::_EVERY, 0, :2].T, color=TARGET, linewidth=BROAD, label="target")
    path.plot(*trace.position_m[::_EVERY, 0, :2].T, color=FLOWN, linewidth=THIN, label="flown")
    path.set(xlabel="x (north), m", aspect="equal", xlim=(-2.6, 2.6), ylim=(-1.5, 1.5))
    error_m = np.maximum(horizontal_error_m(trace)[::_EVERY, 0], _LEAST_ERROR_M)
    error.plot(trace.time_s[::_EVERY], error_m, color=FLOWN, linewidth=THIN)
    error.set(yscale="log", ylim=(_LEAST_ERROR_M, 3.0), xlim=(0.0, trace.time_s[-1]), xlabel="time, s")
    for axes, (start_s, end_s) in ((lap, _LAP_S), (second, _SECOND_S)):
        shown = (trace.time_s >= start_s - 1e-9) & (trace.time_s <= end_s + 1e-9)
        time_s, command_rad = trace.time_s[shown], trace.command_rad[shown, 0, 0]
        width = THIN if axes is lap else None
        axes.step(time_s, command_rad, where="post", color=COMMAND, linewidth=width, label="roll command")
        axes.plot(time_s, trace.euler_rad[shown, 0, 0], color=FLOWN, linestyle="dashed", label="roll")
        axes.set(xlim=(start_s, end_s), xlabel="time, s")
    second.set_xticks((_SECOND_S[0], sum(_SECOND_S) / 2.0, _SECOND_S[1]))


def _label(rows: NDArray[Any]) -> None:
    """Label the first column, and let both rows of angles have the same scale."""
    labels = ("y (east), m", "distance to the target, m", "roll, rad: a lap", "roll, rad: 1 s")
    for axes, label in zip(rows[:, 0], labels, strict=True):
        axes.set_ylabel(label)
    rows[1, 0].yaxis.set_major_formatter(PlainLogFormatter())
    low, high = rows[2, 0].get_ylim()
    rows[3, 0].set_ylim(low, high)
