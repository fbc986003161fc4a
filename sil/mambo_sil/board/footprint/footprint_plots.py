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
from matplotlib.ticker import MaxNLocator

from mambo_sil.board.footprint.measure import Footprint
from mambo_sil.board.footprint.sweep import Axis, Point
from mambo_sil.results.pictures import PlainLogFormatter, inline, save
from mambo_sil.results.style import (
    COLUMN_INCHES,
    COMMAND,
    FLOWN,
    PAGE_INCHES,
    QUIET,
    SMALL,
    THIN,
    add_headline,
    style,
)

_SWEPT: Final = {
    "flash_bytes": "flash, B",
    "ram_bytes": "RAM, B",
    "time_ms": "most time of a step, ms",
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
    points: Sequence[Point],
    axes: Sequence[Axis],
    budget: Mapping[str, float],
    headline: tuple[str, str],
    stem: Path,
) -> tuple[Path, Path]:
    """Draw flash, RAM, time and IAE against the first key; write stem.png and stem.svg.

    A line for each value of the second key. Dots: within budget. Dashed grey line: the budget. Crosses at the
    bottom: refused settings. All but a wide range of time or IAE begin at 0.

    `headline`: what the sweep found, and what was flown.
    """
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 5.6), layout="constrained")
        add_headline(figure, *headline)
        for panel, quantity in zip(figure.subplots(2, 2).flat, _SWEPT, strict=True):
            _draw_swept(panel, points, axes, quantity, budget.get(quantity))
        _add_legend(figure, panel, 3)
        return save(figure, stem)


def _draw_swept(
    panel: Axes, points: Sequence[Point], axes: Sequence[Axis], quantity: str, limit: float | None
) -> None:
    """Draw one quantity of `_SWEPT` against the first key, and its limit if that is near."""
    first, *rest = axes
    for row, values in enumerate(product(*(axis.values for axis in rest))):
        others = {axis.key: value for axis, value in zip(rest, values, strict=True)}
        line = [point for point in points if others.items() <= point.values.items()]
        x, y = [point.values[first.key] for point in line], [getattr(point, quantity) for point in line]
        colour, dashes = f"C{row % 10}", ("-", "--", "-.", ":")[row // 10 % 4]
        label = ", ".join(f"{key} {value:g}" for key, value in others.items())
        panel.plot(x, y, color=colour, linestyle=dashes, label=label or "_")
        fits = [(point.values[first.key], getattr(point, quantity)) for point in line if point.fits]
        panel.plot(*zip(*fits, strict=True) if fits else ([], []), "o", color=colour)
    refused = sorted({point.values[first.key] for point in points if point.refusal is not None})
    panel.plot(refused, [0.03] * len(refused), "x", color=QUIET, transform=panel.get_xaxis_transform())
    measured = [value for value in (getattr(point, quantity) for point in points) if math.isfinite(value)]
    near = limit is not None and bool(measured) and limit < 3 * max(measured)
    if limit is not None and near:
        panel.axhline(limit, color=QUIET, linestyle=(0, (6, 3)), linewidth=THIN)
    panel.set(xlabel=first.key, ylabel=f"{_SWEPT[quantity]} (less is better)")
    panel.xaxis.set_major_locator(MaxNLocator(7, integer=all(isinstance(one, int) for one in first.values)))
    if measured and max(measured) > 2.0 * min(measured) and quantity in ("iae_m_s", "time_ms"):
        panel.set_yscale("log")
        panel.yaxis.set_major_formatter(PlainLogFormatter())
        panel.yaxis.set_minor_formatter(PlainLogFormatter())
    else:
        panel.set_ylim(0.0, 1.1 * max([*measured, *([limit] if near else [])], default=1.0))


def _add_legend(figure: Figure, panel: Axes, columns: int) -> None:
    """Add the legend of the second key, if there is one."""
    handles, labels = panel.get_legend_handles_labels()
    if labels:
        figure.legend(handles, labels, loc="outside lower center", ncols=min(columns, len(labels)))


def sweep_panels(points: Sequence[Point], axes: Sequence[Axis], budget: Mapping[str, float]) -> list[Markup]:
    """Return a picture of each measured quantity against the first key; the first has the legend."""
    pictures: list[Markup] = []
    with style():
        for quantity, label in _SWEPT.items():
            if all(math.isnan(getattr(point, quantity)) for point in points):
                continue
            figure = Figure(figsize=(COLUMN_INCHES, 2.9), layout="constrained")
            panel = figure.subplots()
            _draw_swept(panel, points, axes, quantity, budget.get(quantity))
            if not pictures:
                _add_legend(figure, panel, 2)
            pictures.append(inline(figure, f"{label} against {axes[0].key}; the table has the values"))
    return pictures
