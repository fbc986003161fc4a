"""Pictures of a campaign: indices over all flights, and the improvement flight by flight."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import matplotlib as mpl
import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullLocator

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.experiment.campaign.campaign_flights import CRASHED
from mambo_sil.experiment.campaign.statistics import COMPARED, Table, index_values
from mambo_sil.results.pictures import PlainLogFormatter, inline, save
from mambo_sil.results.style import COLUMN_INCHES, PAGE_INCHES, QUIET, THIN, Look, looks, style

_LABELS: Final = ("IAE, m s", "ISE, m² s", "ITSE, m² s²", "ITAE, m s²")
_SHOWN: Final = {
    "iae_m_s": "IAE, m s",
    "max_error_m": "largest error, m",
    "rms_error_m": "rms error, m",
    "command_variation_rad": "command variation, rad",
}
"""Indices that a page compares controllers by, with labels."""

_MOST_POINTS: Final = 20_000
"""Flights that a curve shows, more than an axis has points; of a million it shows every fiftieth."""


def draw_campaign(table: Table, names: Sequence[str], stem: Path) -> tuple[Path, Path]:
    """Draw cumulative distributions of each index and of its ratio to the first controller's.

    Writes stem.png and stem.svg. Because of crashed flights a curve ends below 1; with few but very
    large values it leaves the panel.
    """
    rows = 1 if len(names) == 1 else 2
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 0.4 + 1.9 * rows), layout="constrained")
        panels = figure.subplots(rows, len(COMPARED), squeeze=False, sharey=True)
        for axes, index, label in zip(panels[0], COMPARED, _LABELS, strict=True):
            for name, look in looks(names).items():
                _draw_shares(axes, index_values(table, name, index), look, name)
            axes.set(xscale="log", xlabel=label, ylim=(0.0, 1.0))
            _show_most(axes)
            _label_plainly(axes)
        figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=len(names))
        for axes, index, label in zip(panels[-1] if rows > 1 else (), COMPARED, _LABELS, strict=False):
            for name in names[1:]:
                theirs, ours = index_values(table, names[0], index), index_values(table, name, index)
                with np.errstate(invalid="ignore", divide="ignore"):
                    _draw_shares(axes, theirs / ours, looks(names)[name], name)
            axes.axvline(1.0, color=QUIET, linewidth=THIN)
            axes.set(xscale="log", xlabel=f"{label.partition(',')[0]}: improvement on {names[0]}")
            _show_most(axes)
            _label_plainly(axes)
        for axes in panels[:, 0]:
            axes.set_ylabel("share of flights")
        return save(figure, stem)


def _show_most(axes: Axes) -> None:
    """Limit the logarithmic x axis to 95 % of the values of every curve, and a little more."""
    curves = [np.asarray(line.get_xdata()) for line in axes.lines if len(np.asarray(line.get_xdata())) > 2]
    curves = [curve[curve > 0.0] for curve in curves if (curve > 0.0).any()]
    if curves:
        low = min(np.quantile(curve, 0.025) for curve in curves)
        high = max(np.quantile(curve, 0.975) for curve in curves)
        axes.set_xlim(low / 1.5, 1.5 * high)


def _label_plainly(axes: Axes) -> None:
    """Put three to five ticks on the logarithmic x axis, labelled as 20 and not as 2 x 10^1."""
    low, high = axes.get_xlim()
    ticks: list[float] = []
    for digits in ((1,), (1, 3), (1, 2, 5), range(1, 10), range(10, 100)):
        scale = 0.1 if digits == range(10, 100) else 1.0
        ticks = [scale * digit * 10.0**decade for decade in range(-12, 13) for digit in digits]
        ticks = [tick for tick in ticks if low <= tick <= high]
        if len(ticks) >= 3:
            break
    axes.set_xticks(ticks[:: -(-len(ticks) // 5) or 1])
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_locator(NullLocator())


def _draw_shares(axes: Axes, values: FloatArray, look: Look, name: str, whole: float = 1.0) -> None:
    """Draw the share of flights (0 to `whole`) up to each finite value; infinite ones count in the total."""
    counted = values[~np.isnan(values)]
    shares = whole * np.arange(1, len(counted) + 1) / max(len(counted), 1)
    ordered = np.sort(counted)
    shown = np.flatnonzero(np.isfinite(ordered))
    if len(shown) > _MOST_POINTS:
        shown = shown[np.linspace(0, len(shown) - 1, _MOST_POINTS).astype(np.int64)]
    axes.step(ordered[shown], shares[shown], where="post", label=name, **look.line)


def distribution_panels(table: Table, controllers: Sequence[str]) -> list[Markup]:
    """Return a picture of each compared index: cumulative distributions over flights, one per controller."""
    pictures: list[Markup] = []
    with style(), mpl.rc_context({"text.parse_math": False}):  # a controller's name is no formula
        for index, label in _SHOWN.items():
            figure = Figure(figsize=(COLUMN_INCHES, 2.7), layout="constrained")
            axes = figure.subplots()
            for name, look in looks(controllers).items():
                if {f"{name}_{index}", f"{name}_{CRASHED}"} <= table.keys():
                    _draw_shares(axes, index_values(table, name, index), look, name, whole=100.0)
            if not axes.lines:
                continue
            axes.set(xlabel=label, ylabel="flights below, %", xscale="log", ylim=(0, 102))
            axes.xaxis.set_major_formatter(PlainLogFormatter())
            axes.xaxis.set_minor_formatter(PlainLogFormatter())
            axes.legend(loc="best")
            pictures.append(inline(figure, f"Distribution of {label}, for {', '.join(controllers)}"))
    return pictures
