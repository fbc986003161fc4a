"""Pictures of a campaign: the indices of Table II over all flights, and the improvement flight by flight."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mambo_nmpc.sil.campaign.statistics import COMPARED, Table, judged
from mambo_nmpc.sil.footprint.plots import save
from mambo_nmpc.sil.plant.arrays import FloatArray
from mambo_nmpc.sil.show.plots import style

_LABELS: Final = ("IAE, m s", "ISE, m² s", "ITSE, m² s²", "ITAE, m s²")


def draw_campaign(table: Table, names: Sequence[str], stem: Path) -> tuple[Path, Path]:
    """Draw cumulative distributions of each index and of its ratio to the first controller's.

    Writes stem.png and stem.svg. Because of crashed flights a curve ends below 1.
    """
    rows = 1 if len(names) == 1 else 2
    other = names[1] if len(names) == 2 else "another"
    with style():
        figure = Figure(figsize=(11.0, 0.6 + 2.7 * rows), layout="constrained")
        panels = figure.subplots(rows, len(COMPARED), squeeze=False, sharey=True)
        for axes, index, label in zip(panels[0], COMPARED, _LABELS, strict=True):
            for colour, name in enumerate(names):
                _draw_shares(axes, judged(table, name, index), f"C{colour}", name)
            axes.set(xscale="log", xlabel=label, ylim=(0.0, 1.0))
        panels[0, 0].legend(loc="lower right", frameon=True)
        for axes, index, label in zip(panels[-1] if rows > 1 else (), COMPARED, _LABELS, strict=False):
            for colour, name in enumerate(names[1:], start=1):
                theirs, ours = judged(table, names[0], index), judged(table, name, index)
                with np.errstate(invalid="ignore", divide="ignore"):
                    _draw_shares(axes, theirs / ours, f"C{colour}", name)
            axes.axvline(1.0, color="#444444", linewidth=0.8)
            axes.set(xscale="log", xlabel=f"{label.partition(',')[0]}: {names[0]} over {other}")
        for axes in panels[:, 0]:
            axes.set_ylabel("share of flights")
        return save(figure, stem)


def _draw_shares(axes: Axes, values: FloatArray, colour: str, name: str) -> None:
    """Draw the share of flights (0 to 1) up to each finite value; infinite ones count in the total."""
    counted = values[~np.isnan(values)]
    shares = np.arange(1, len(counted) + 1) / max(len(counted), 1)
    ordered = np.sort(counted)
    shown = np.isfinite(ordered)
    axes.step(ordered[shown], shares[shown], where="post", color=colour, label=name)
