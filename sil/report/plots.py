"""Pictures on a page: SVG inline, in the colours of the page's style, light or dark."""

import hashlib
import io
import math
import re
from collections.abc import Mapping, Sequence
from typing import Final

import matplotlib as mpl
import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mambo_nmpc.sil.campaign.flights import CRASHED
from mambo_nmpc.sil.campaign.statistics import Table, judged
from mambo_nmpc.sil.campaign.table import COMPARED
from mambo_nmpc.sil.flight.traces import Trace
from mambo_nmpc.sil.footprint.plots import SWEPT, PlainLogFormatter, draw_swept
from mambo_nmpc.sil.footprint.sweep import Point
from mambo_nmpc.sil.paper.table2 import PD
from mambo_nmpc.sil.show.plots import COLUMN_LABELS, COMMAND, FLOWN, TARGET, draw_column, style

_WIDTH_INCHES: Final = 4.2
_HUES: Final = ("#2ca02c", FLOWN, "#9467bd", "#8c564b", "#e377c2")
_VARIABLES: Final = {
    "#000000": "currentColor",
    "#444444": "var(--quiet)",
    "#e6e6e6": "var(--line)",
    TARGET.lower(): "var(--target)",
    FLOWN.lower(): "var(--flown)",
    COMMAND.lower(): "var(--other)",
    "#1f77b4": "var(--flown)",
    "#ff7f0e": "var(--other)",
}
"""Colours of the pictures on white, the first two of matplotlib's cycle among them, and the page's names."""


def flight_columns(flights: Mapping[str, Trace]) -> list[Markup]:
    """Return a picture for each flight: path, error, roll and pitch, on scales they share."""
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
    figure = Figure(figsize=(_WIDTH_INCHES, 7.6), layout="constrained")
    column = figure.subplots(len(COLUMN_LABELS), 1, height_ratios=(1.9, 1, 1, 1))
    draw_column(column, trace, "")
    figure.suptitle(title, fontsize=10, parse_math=False)  # above the legend, whatever the path's shape
    for axes, label in zip(column, COLUMN_LABELS, strict=True):
        axes.set_ylabel(label)
    for axes in (column[0], column[2]):
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, borderaxespad=0.1)
    return figure


def _share_scales(row: Sequence[Axes]) -> None:
    x = [value for axes in row for value in axes.get_xlim()]
    y = [value for axes in row for value in axes.get_ylim()]
    for axes in row:
        axes.set(xlim=(min(x), max(x)), ylim=(min(y), max(y)))


def sweep_panels(points: Sequence[Point], budgets: Mapping[str, float]) -> list[Markup]:
    """Return a picture of each swept quantity against the prediction horizon; the first has the legend."""
    pictures: list[Markup] = []
    with style():
        for quantity, label in SWEPT.items():
            if all(math.isnan(getattr(point, quantity)) for point in points):
                continue
            figure = Figure(figsize=(_WIDTH_INCHES, 3.4), layout="constrained")
            axes = figure.subplots()
            draw_swept(axes, points, quantity, budgets.get(quantity))
            if not pictures:
                axes.legend(fontsize=7, handlelength=2.6)
            pictures.append(
                inline(figure, f"{label} against the prediction horizon; the table has the values")
            )
    return pictures


def distributions(table: Table, controllers: Sequence[str]) -> list[Markup]:
    """Return a picture of each compared index: the share of flights up to a value, a line a controller."""
    pictures: list[Markup] = []
    with style(), mpl.rc_context({"text.parse_math": False}):  # a controller's name is no formula
        for index, label in COMPARED.items():
            figure = Figure(figsize=(_WIDTH_INCHES, 3.2), layout="constrained")
            axes = figure.subplots()
            for row, name in enumerate(controllers):
                if {f"{name}_{index}", f"{name}_{CRASHED}"} <= table.keys():
                    values = np.sort(judged(table, name, index))
                    shown = np.isfinite(values)
                    shares = 100.0 * np.arange(1, len(values) + 1) / len(values)
                    colour = COMMAND if name == PD.lower() else _HUES[row % len(_HUES)]
                    axes.step(values[shown], shares[shown], where="post", color=colour, label=name)
            if not axes.lines:
                continue
            axes.set(xlabel=label, ylabel="flights below, %", xscale="log", ylim=(0, 102))
            axes.xaxis.set_major_formatter(PlainLogFormatter())
            axes.xaxis.set_minor_formatter(PlainLogFormatter())
            axes.legend(loc="lower right")
            pictures.append(inline(figure, f"Distribution of {label}, for {', '.join(controllers)}"))
    return pictures


def inline(figure: Figure, description: str) -> Markup:
    """Return a figure as an SVG element: no background, the page's font and colours, ids of its own."""
    text = io.StringIO()
    figure.savefig(text, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<!--.*?-->|<(metadata|style).*?</\1>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'(<(?:g|svg)[^>]*?) id="[^"]*"', r"\1", svg)
    svg = re.sub(r'\sxmlns(:\w+)?="[^"]*"|\sversion="1.1"', "", svg).replace("xlink:href", "href")
    svg = re.sub(r"<[^>]*>", lambda tag: re.sub(r"(\d\.\d)\d+", r"\1", tag[0]), svg)
    svg = re.sub(r"\s*\n(?:L )?", " ", svg)
    svg = re.sub(r"font: ([\d.]+)px [^;\"]*", r"font-size: \1px", svg)
    svg = re.sub(r"; font-family: [^;\"]*", "", svg)
    svg = re.sub(r"(?<=: )#[0-9a-f]{6}", lambda colour: _VARIABLES.get(colour[0], colour[0]), svg)
    role = Markup('<svg role="img" aria-label="{}"').format(description)
    return Markup(_with_own_ids(svg).replace("<svg", role, 1))


def _with_own_ids(svg: str) -> str:
    """Return the SVG with ids made of its content: those of matplotlib vary with the last bit of a place."""
    found = list(dict.fromkeys(re.findall(r' id="([^"]+)"', svg)))
    numbered = {name: f"n{number}" for number, name in enumerate(found)}
    plain = re.sub("|".join(found), lambda name: numbered[name[0]], svg)
    digest = hashlib.sha256(plain.encode()).hexdigest()[:8]
    return re.sub("|".join(found), lambda name: f"s{digest}{numbered[name[0]]}", svg)
