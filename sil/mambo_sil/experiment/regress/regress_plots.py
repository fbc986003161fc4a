"""Pictures of a suite's results: each flight's metrics as shares of their limits."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from markupsafe import Markup
from matplotlib.figure import Figure

from mambo_sil.experiment.regress.flight_limits import Check, JudgedFlight
from mambo_sil.results.metric_names import named
from mambo_sil.results.pictures import PlainLogFormatter, inline, save
from mambo_sil.results.style import LOOKS, PAGE_INCHES, QUIET, THIN, style

_SHOWN: Final = (1e-2, 1e2)
"""Shares that the picture shows; others are drawn at its edges."""

_MOST_ROWS: Final = 60


def draw_regress(flights: Sequence[JudgedFlight], stem: Path) -> tuple[Path, Path]:
    """Draw the picture of `limits_figure`; writes stem.png and stem.svg."""
    with style():
        return save(_limits_figure(flights), stem)


def limits_panel(flights: Sequence[JudgedFlight]) -> Markup:
    """Return the same picture for a page."""
    with style():
        return inline(_limits_figure(flights), "Metrics of each flight as shares of their limits")


def _limits_figure(flights: Sequence[JudgedFlight]) -> Figure:
    """Return a row per group and metric with a dot per flight, at the metric divided by its limit."""
    rows = _rows(flights)
    figure = Figure(figsize=(PAGE_INCHES, 0.9 + 0.2 * max(len(rows), 1)), layout="constrained")
    axes = figure.subplots()
    for holds, look, label in ((True, LOOKS[0], "holds"), (False, LOOKS[1], "fails")):
        dots = [
            (share, row)
            for row, checks in enumerate(rows.values())
            for share in _shares([check for check in checks if check.holds is holds])
        ]
        axes.plot(
            [share for share, _ in dots],
            [row for _, row in dots],
            alpha=0.6,
            clip_on=False,
            **look.dots,
            label=f"{label}: {len(dots)}",
        )
    axes.axvline(1.0, color=QUIET, linewidth=THIN)
    axes.set(xscale="log", xlim=_SHOWN, xlabel="metric over its limit", yticks=range(len(rows)))
    axes.xaxis.set_major_formatter(PlainLogFormatter(*_SHOWN))
    axes.set_yticklabels(rows, parse_math=False)
    axes.set_ylim(max(len(rows), 1) - 0.5, -0.5)
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, borderaxespad=0.1)
    return figure


def _rows(flights: Sequence[JudgedFlight]) -> dict[str, list[Check]]:
    """Return the checks by group and metric; of more than `_MOST_ROWS` those closest to their limits."""
    rows: dict[str, list[Check]] = {}
    for flight in flights:
        for check in flight.checks:
            if check.limit > 0.0 or not check.holds:
                rows.setdefault(f"{flight.group}: {named(check.metric)[0]}", []).append(check)
    closest = sorted(rows, key=lambda row: max(_shares(rows[row])), reverse=True)[:_MOST_ROWS]
    return {row: checks for row, checks in rows.items() if row in closest}


def _shares(checks: Sequence[Check]) -> list[float]:
    """Return value over limit of each check, within the picture; a lost flight is at its right edge."""
    least, most = _SHOWN
    shares = (check.now / check.limit if check.limit > 0.0 else most for check in checks)
    return [min(max(share, least), most) if math.isfinite(share) else most for share in shares]
