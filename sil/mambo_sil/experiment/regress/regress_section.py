"""The section of the report on a suite."""

from pathlib import Path

from mambo_sil.experiment.regress.regress_plots import limits_panel
from mambo_sil.experiment.regress.regress_report import (
    MOST_SHOWN,
    RegressSummary,
    finding,
    group_rows,
    remarks,
)
from mambo_sil.results.section import Section


def regress_section(folder: Path, summary: RegressSummary) -> Section:
    """Return the section of a suite."""
    content = {
        "folder": str(folder),
        "controller": f"{summary.controller}, settings {summary.settings[:16]}, "
        f"vehicle {' and '.join(summary.vehicles)}",
        "rows": list(group_rows(summary)),
        "failed": summary.failed[:MOST_SHOWN],
        "more": max(len(summary.failed) - MOST_SHOWN, 0),
        "remarks": remarks(summary),
        "picture": limits_panel(summary),
    }
    title = f"Regression tests, {summary.suite} with {summary.controller}"
    return Section("regress", title, not summary.failed, finding(summary), content)
