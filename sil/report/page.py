"""Render result folders as one HTML page, which depends on nothing but the folders."""

from collections.abc import Sequence
from pathlib import Path

from mambo_nmpc.sil.report.kinds import read_summary, section
from mambo_nmpc.sil.show.page import render_page


def report_page(folders: Sequence[Path]) -> str:
    """Return the HTML page of `folders`, in their order; raises ResultsError and TraceError."""
    summaries = [read_summary(folder) for folder in folders]
    sections = [section(folder, summary) for folder, summary in zip(folders, summaries, strict=True)]
    context = {
        "shown": [(str(folder), one) for folder, one in zip(folders, sections, strict=True)],
        "generators": sorted({summary.generator for summary in summaries}),
        "moves": any(one.moves for one in sections),
    }
    return render_page("report.html.j2", context)
