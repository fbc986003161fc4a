"""Pictures of footprints and sweeps: as files, and for a page."""

import math
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Final

import matplotlib as mpl
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator

from mambo_codegen.boards import Board
from mambo_sil.board.footprint.measure import Footprint
from mambo_sil.board.footprint.sweep import Point, budgets
from mambo_sil.results.pictures import PlainLogFormatter, inline, save
from mambo_sil.results.style import COLUMN_INCHES, COMMAND, FLOWN, PAGE_INCHES, QUIET, SMALL, THIN, style

_SWEPT: Final = {
    "flash_bytes": "flash, B",
    "ram_bytes": "RAM, B",
    "time_ms": "time of a step, ms (upper estimate)",
    "iae_m_s": "IAE, m s",
}
"""Quantities of a `Point` that are plotted, and their axis labels."""


def draw_footprints(footprints: Sequence[Footprint], stem: Path) -> tuple[Path, Path]:
    """Draw every measured value as a share of its budget, a bar each; write stem.png and stem.svg."""
    with style(), mpl.rc_context({"text.parse_math": False}):  # a board's name is no formula
        figure = Figure(figsize=(PAGE_INCHES, 0.8 + 0.8 * len(footprints)), layout="constrained")
        axes = figure.subplots()
        labels, shares, colours, texts = [], [], [], []
        for footprint in reversed(footprints):
            for limit in reversed(footprint.limits):
                labels.append(f"{footprint.board.name}  {limit.name}")
                shares.append(100 * limit.share)
                colours.append(FLOWN if limit.share <= 1 else COMMAND)
                texts.append(f" {_format(limit.value)} of {_format(limit.budget)} {limit.unit}")
        bars = axes.barh(labels, shares, color=colours, zorder=2)
        axes.bar_label(bars, texts, fontsize=SMALL)
        axes.axvline(100, color=QUIET, linewidth=THIN)
        axes.set(
            xlabel="share of the budget, %",
            xlim=(0, 1.35 * max(100, *shares)),
            ylim=(-0.8, len(labels) - 0.2),
        )
        return save(figure, stem)


def _format(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def draw_sweep(
    points: Sequence[Point], board: Board, update_period_s: float, stem: Path
) -> tuple[Path, Path]:
    """Draw flash, RAM, time and IAE against the prediction horizon; write stem.png and stem.svg.

    Colour: control horizon. Line style: iterations. Dots: within budget. Dashed grey line: the budget.
    """
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 5.6), layout="constrained")
        limits = budgets(board, update_period_s)
        for axes, quantity in zip(figure.subplots(2, 2).flat, _SWEPT, strict=True):
            _draw_swept(axes, points, quantity, limits.get(quantity))
        handles, labels = axes.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=min(4, len(labels)))
        figure.suptitle(board.title, parse_math=False)
        return save(figure, stem)


def _draw_swept(axes: Axes, points: Sequence[Point], quantity: str, limit: float | None) -> None:
    """Draw one quantity of `_SWEPT` against the prediction horizon, and its limit if that is near."""
    controls = sorted({point.control for point in points})
    iterations = sorted({point.iterations for point in points})
    for (row, control), (column, count) in product(enumerate(controls), enumerate(iterations)):
        line = [p for p in points if (p.control, p.iterations) == (control, count)]
        x, y = [p.prediction for p in line], [getattr(p, quantity) for p in line]
        colour, dashes = f"C{row}", ("-", "--", "-.", ":")[column % 4]
        label = f"{control} {'move' if control == 1 else 'moves'}, {count} iterations"
        axes.plot(x, y, color=colour, linestyle=dashes, label=label)
        fits = [(p.prediction, getattr(p, quantity)) for p in line if p.fits]
        axes.plot(*zip(*fits, strict=True) if fits else ([], []), "o", color=colour)
    if limit is not None and limit < 3 * max(getattr(p, quantity) for p in points):
        axes.axhline(limit, color=QUIET, linestyle=(0, (6, 3)), linewidth=THIN)
    axes.set(xlabel="prediction horizon", ylabel=_SWEPT[quantity])
    axes.xaxis.set_major_locator(FixedLocator(_ticks(sorted({point.prediction for point in points}))))
    if quantity in ("iae_m_s", "time_ms"):
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter(PlainLogFormatter())
        axes.yaxis.set_minor_formatter(PlainLogFormatter())


def _ticks(horizons: Sequence[int]) -> list[int]:
    """Return the swept horizons, or every second, third ... of more than ten."""
    return list(horizons[:: -(-len(horizons) // 10)])


def sweep_panels(points: Sequence[Point], budgets: Mapping[str, float]) -> list[Markup]:
    """Return a picture of each swept quantity against the prediction horizon; the first has the legend."""
    pictures: list[Markup] = []
    with style():
        for quantity, label in _SWEPT.items():
            if all(math.isnan(getattr(point, quantity)) for point in points):
                continue
            figure = Figure(figsize=(COLUMN_INCHES, 2.9), layout="constrained")
            axes = figure.subplots()
            _draw_swept(axes, points, quantity, budgets.get(quantity))
            if not pictures:
                figure.legend(loc="outside lower center", ncols=2)
            pictures.append(
                inline(figure, f"{label} against the prediction horizon; the table has the values")
            )
    return pictures
