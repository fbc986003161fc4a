"""The picture of the suite envelope with several controllers, which no command draws."""

import math
from itertools import product
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.figure import Figure

from mambo_sil.experiment.regress.regress_report import RegressSummary
from mambo_sil.flight.names import PD_NAMES
from mambo_sil.results.folders import SUMMARY
from mambo_sil.results.pictures import PlainLogFormatter, save
from mambo_sil.results.style import GRID, PAGE_INCHES, looks, style

_CURVES: Final = {
    "eight": "eight, 0.5 rad/s",
    "circle": "circle, 1 rad/s",
    "fast-circle": "circle, 1.5 rad/s",
    "step-2m": "step of 2 m",
    "step-5m": "step of 5 m",
}
_STATES: Final = {"": "true state", "-sensors": "through sensors"}
_METRIC: Final = "iae_m_s"
_SHOWN_M_S: Final = (0.1, 200.0)
"""IAE that the picture shows; a drone that has lost its target is drawn at the upper edge."""


def draw_envelope(results: Path) -> None:
    """Draw the IAE over the heading, a panel per group, a line per controller; write envelope.png and .svg.

    `results` has a folder of `regress` for each controller.
    """
    folders = sorted((path.parent for path in results.glob(f"*/{SUMMARY}")), key=_order)
    summaries = {
        folder.name: RegressSummary.model_validate_json((folder / SUMMARY).read_text("utf-8"))
        for folder in folders
    }
    found = {name: _iae(summary) for name, summary in summaries.items()}
    bounds = _bounds(next(iter(summaries.values())))
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 3.6), layout="constrained")
        panels = figure.subplots(len(_STATES), len(_CURVES), sharex=True, sharey=True)
        for axes, ((state, seen), (curve, title)) in zip(
            panels.flat, product(_STATES.items(), _CURVES.items()), strict=True
        ):
            group = f"{curve}{state}"
            for name, look in looks(list(found)).items():
                iae_m_s = found[name][group]
                heading_deg = np.linspace(-180.0, 180.0, len(iae_m_s))
                axes.plot(heading_deg, iae_m_s, label=name, **look.line)
            axes.axhspan(bounds[group], _SHOWN_M_S[1], color=GRID, linewidth=0)
            axes.set(yscale="log", ylim=_SHOWN_M_S, xlim=(-180, 180), xticks=(-180, -90, 0, 90, 180))
            axes.set_xticklabels(("-180", "", "0", "", "180"))
            if not state:
                axes.set_title(title)
            if curve == next(iter(_CURVES)):
                axes.set_ylabel(f"IAE, m s: {seen}")
        panels[0, 0].yaxis.set_major_formatter(PlainLogFormatter())  # shared
        figure.supxlabel("heading, degrees (grey area: above the bound of the suite)", size="medium")
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
        save(figure, results / "envelope")


def _iae(summary: RegressSummary) -> dict[str, list[float]]:
    """Return the IAE of each group's flights, in the order of the headings, within what is shown."""
    found: dict[str, list[float]] = {}
    for flight in summary.flights:
        iae_m_s = float(flight.metrics[_METRIC])
        least, most = _SHOWN_M_S
        shown = min(max(iae_m_s, least), most) if math.isfinite(iae_m_s) else most
        found.setdefault(flight.group, []).append(shown)
    return found


def _bounds(summary: RegressSummary) -> dict[str, float]:
    """Return the bound on the IAE of each group."""
    return {
        flight.group: check.limit
        for flight in summary.flights
        for check in flight.checks
        if check.metric == _METRIC
    }


def _order(folder: Path) -> tuple[int, str]:
    """Order the PDs first, then as their names."""
    return (PD_NAMES.index(folder.name) if folder.name in PD_NAMES else len(PD_NAMES), folder.name)
