"""Render result folders as one HTML page, which depends on nothing but the folders."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mambo_sil.pages.report.result_kinds import read_summary, section
from mambo_sil.results.html_page import render_page
from mambo_sil.results.summary import Summary


@dataclass(frozen=True)
class ReportedFolder:
    """What the overview of a page says of one result folder; `missing` names files that are not there."""

    folder: str
    command: str
    title: str
    good: bool | None
    finding: str
    missing: list[str]


class ReportSummary(Summary):
    """A page of results."""

    command = "report"

    page: str
    """Name of the HTML file."""
    bytes: int
    results: list[ReportedFolder]


def report_page(folders: Sequence[Path]) -> tuple[str, list[ReportedFolder]]:
    """Return the HTML page of `folders`, in their order, and its overview.

    Raises ResultsError and TraceError.
    """
    summaries = [read_summary(folder) for folder in folders]
    sections = [section(folder, summary) for folder, summary in zip(folders, summaries, strict=True)]
    context = {
        "shown": [(str(folder), one) for folder, one in zip(folders, sections, strict=True)],
        "generators": sorted({summary.generator for summary in summaries}),
        "moves": any(one.moves for one in sections),
    }
    overview = [
        ReportedFolder(str(folder), summary.command, one.title, one.good, one.finding, list(one.missing))
        for folder, summary, one in zip(folders, summaries, sections, strict=True)
    ]
    return render_page("report.html.j2", context), overview
