"""The section of the report on an identification."""

from pathlib import Path

from mambo_sil.model.identify.identify_plots import fit_panel
from mambo_sil.model.identify.identify_record import CURVES, IdentifySummary
from mambo_sil.model.identify.identify_report import AXIS_ROWS, axis_cells, finding, motion_rows, noise_rows
from mambo_sil.results.section import Section


def identify_section(folder: Path, summary: IdentifySummary) -> Section:
    """Return the section of an identification; raises ResultsError."""
    curves = folder / CURVES
    there = curves.is_file()
    content = {
        "heads": AXIS_ROWS,
        "axes": [(name, axis, axis_cells(axis)) for name, axis in summary.axes.items()],
        "facts": dict([*motion_rows(summary), *noise_rows(summary)]),
        "logs": summary.logs,
        "remarks": summary.remarks,
        "picture": fit_panel(curves, summary) if there else None,
    }
    missing = [] if there else [CURVES]
    title = f"Identification from {', '.join(log.name for log in summary.logs)}"
    return Section("identify", title, summary.good, finding(summary), content, missing)
