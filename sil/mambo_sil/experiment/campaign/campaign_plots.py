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
from mambo_sil.experiment.campaign.statistics import Table, index_values
from mambo_sil.results.pictures import PlainLogFormatter, inline, save
from mambo_sil.results.style import COLUMN_INCHES, PAGE_INCHES, QUIET, THIN, Look, add_headline, looks, style

_SHOWN: Final = {
    "iae_m_s": "IAE, m s",
    "max_error_m": "largest error, m",
    "rms_error_m": "rms error, m",
    "command_variation_rad": "command variation, rad",
}
"""Indices that a page compares controllers by, with labels."""

_MOST_POINTS: Final = 20_000
"""Flights that a curve shows, more than an axis has points; of a million it shows every fiftieth."""


def draw_campaign(
    table: Table, names: Sequence[str], message: str, about: str, stem: Path
) -> tuple[Path, Path]:
    """Draw cumulative distributions of the main indices, and of the first controller's IAE by another's.

    Writes stem.png and stem.svg. Because of crashed flights a curve ends below 100 %; with few but very large
    values it leaves the panel.
    """
    shown = (*_DRAWN, None) if len(names) > 1 else _DRAWN
    with style(), mpl.rc_context({"text.parse_math": False}):  # a controller's name is no formula
        figure = Figure(figsize=(PAGE_INCHES, 1.0 + 2.0 * -(-len(shown) // 2)), layout="constrained")
        add_headline(figure, message, about)
        grid = figure.subplots(-(-len(shown) // 2), 2, squeeze=False, sharey=True)
        panels = grid.flat
        for axes, index in zip(panels, shown, strict=False):
            for name, look in list(looks(names).items())[0 if index else 1 :]:
                values = index_values(table, name, index or "iae_m_s")
                if index is None:
                    with np.errstate(invalid="ignore", divide="ignore"):
                        values = index_values(table, names[0], "iae_m_s") / values
                _draw_shares(axes, values, look, _counted(name, table), whole=100.0)
            axes.set(xscale="log", ylim=(0.0, 102.0), xlabel=_MORE.format(names[0]))
            if index is not None:
                axes.set_xlabel(_LESS.format(_SHOWN[index]))
            else:
                axes.axvline(1.0, color=QUIET, linewidth=THIN)
            _show_most(axes)
            _label_plainly(axes)
        for axes in panels:  # that has nothing to show
            axes.remove()
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=len(names))
        for axes in grid[:, 0]:
            axes.set_ylabel("flights below, %")
        return save(figure, stem)


_DRAWN: Final = ("iae_m_s", "max_error_m", "command_variation_rad")
_LESS: Final = "\N{LEFTWARDS ARROW} better: {}"
_MORE: Final = "times closer than {} (by IAE): better \N{RIGHTWARDS ARROW}"


def _counted(name: str, table: Table) -> str:
    """Return a controller with how many of its flights crashed."""
    crashed = int((table[f"{name}_{CRASHED}"] > 0.0).sum())
    return f"{name}: {crashed} crashed" if crashed else name


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
