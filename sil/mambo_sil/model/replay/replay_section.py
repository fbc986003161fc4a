"""The section of the report on a replay of a log."""

from pathlib import Path

from mambo_sil.model.replay.replay_plots import replay_panel
from mambo_sil.model.replay.replay_report import CURVES, LogReplaySummary, finding, rows
from mambo_sil.results.section import Section


def log_replay_section(folder: Path, summary: LogReplaySummary) -> Section:
    """Return the section of a replay; raises ResultsError."""
    curves = folder / CURVES
    there = curves.is_file()
    content = {
        "facts": {
            "controller": f"settings {summary.settings[:16]} of {summary.source}",
            **dict(rows(summary)),
        },
        "remarks": summary.remarks,
        "picture": replay_panel(curves) if there else None,
    }
    missing = [] if there else [CURVES]
    return Section("replay", f"Replay of {summary.log}", summary.good, finding(summary), content, missing)
