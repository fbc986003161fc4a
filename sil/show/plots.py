"""Pictures of flights, after the paper's Fig. 3: path, error, commands; PNG and SVG."""

import contextlib
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from mambo_nmpc.sil.flight.metrics import horizontal_error_m
from mambo_nmpc.sil.flight.traces import Trace

TARGET, FLOWN, COMMAND = "#c4c4c4", "#0072B2", "#E69F00"
"""Colours that stay apart for colour-blind readers and in grey (Okabe and Ito)."""

COLUMN_LABELS: Final = ("y (east), m", "error, m", "roll, rad", "pitch, rad")

_STYLE: Final[dict[Any, Any]] = {
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.1,
    "legend.frameon": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "mambo-nmpc",
}
_COLUMN_INCHES: Final = 4.2
_HEIGHT_INCHES: Final = 8.2


def draw_flights(flights: Mapping[str, Trace], stem: Path) -> tuple[Path, Path]:
    """Draw the first flight of each trace as a column under its title; write stem.png and stem.svg.

    The columns share their scales, so that they can be compared by eye.
    """
    with style():
        figure = Figure(figsize=(_COLUMN_INCHES * len(flights), _HEIGHT_INCHES), layout="constrained")
        rows = figure.subplots(4, len(flights), squeeze=False, sharey="row", height_ratios=(1.9, 1, 1, 1))
        for column, (title, trace) in zip(rows.T, flights.items(), strict=True):
            draw_column(column, trace, title)
        for axes, label in zip(rows[:, 0], COLUMN_LABELS, strict=True):
            axes.set_ylabel(label)
        _share_horizontal_scale(rows[0])
        rows[0, 0].invert_yaxis()  # shared: seen from above, with north to the right
        for axes in (rows[0, 0], rows[2, 0]):
            axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, borderaxespad=0.1)
        png, svg = stem.with_suffix(".png"), stem.with_suffix(".svg")
        figure.savefig(png, dpi=160, metadata={"Software": None})
        figure.savefig(svg, metadata={"Date": None, "Creator": None})
    return png, svg


@contextlib.contextmanager
def style() -> Iterator[None]:
    """Draw in our style, whatever the user's matplotlibrc says, and without a word on missing glyphs."""
    with mpl.rc_context(), warnings.catch_warnings():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        warnings.filterwarnings("ignore", "Glyph .* missing", UserWarning)
        yield


def draw_column(column: NDArray[Any], trace: Trace, title: str) -> None:
    """Draw the first flight of a trace in four axes (4,): path, error, roll, pitch."""
    _draw_path(column[0], trace, title)
    _draw_error(column[1], trace)
    _draw_angle(column[2], trace, axis=0)
    _draw_angle(column[3], trace, axis=1)
    column[3].set_xlabel("time, s")


def _draw_path(axes: Axes, trace: Trace, title: str) -> None:
    """Draw the target as a broad line beneath: it stays visible however often it is flown around."""
    target, flown = trace.target[:, 0], trace.position_m[:, 0]
    axes.plot(target[:, 0], target[:, 1], color=TARGET, linewidth=4, label="target")
    axes.plot(flown[:, 0], flown[:, 1], color=FLOWN, label="flown")
    axes.set_title(title, loc="right", parse_math=False)
    axes.set(xlabel="x (north), m", aspect="equal")


def _draw_error(axes: Axes, trace: Trace) -> None:
    axes.plot(trace.time_s, horizontal_error_m(trace)[:, 0], color=FLOWN)
    axes.set_ylim(0, None)


def _draw_angle(axes: Axes, trace: Trace, axis: int) -> None:
    """Draw the command as a broader line beneath: both show where they agree, and where one chatters."""
    axes.plot(trace.time_s, trace.command_rad[:, 0, axis], color=COMMAND, linewidth=2, label="command")
    axes.plot(trace.time_s, trace.euler_rad[:, 0, axis], color=FLOWN, linewidth=0.9, label="flown")


def _share_horizontal_scale(row: NDArray[Any]) -> None:
    limits = np.array([axes.get_xlim() for axes in row])
    for axes in row:
        axes.set_xlim(limits[:, 0].min(), limits[:, 1].max())
