"""Render result folders as one HTML page, which depends on nothing but the folders."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from mambo_codegen import extensions
from mambo_codegen.errors import echo
from mambo_codegen.plain_file import guess_name
from mambo_sil.board.footprint.footprint_report import FootprintSummary
from mambo_sil.board.footprint.sweep_report import SweepSummary
from mambo_sil.errors import ResultsError
from mambo_sil.experiment.campaign.campaign_report import CampaignSummary, UnfinishedCampaign
from mambo_sil.experiment.compare.diff_report import DiffSummary
from mambo_sil.experiment.faults.faults_report import FaultsSummary
from mambo_sil.experiment.margins.margins_record import MarginsSummary
from mambo_sil.experiment.regress.regress_report import RegressSummary
from mambo_sil.experiment.table2.sensed import SensedSummary
from mambo_sil.experiment.table2.table2 import Table2Summary
from mambo_sil.flight.flight_report import FlySummary, RepeatSummary
from mambo_sil.model.identify.identify_record import IdentifySummary
from mambo_sil.model.replay.replay_report import LogReplaySummary
from mambo_sil.results.folders import SUMMARY
from mambo_sil.results.html_page import results_page
from mambo_sil.results.summary import ReportedSummary, Summary
from mambo_sil.verify.verify_report import VerifySummary

RESULTS: Final[tuple[type[ReportedSummary], ...]] = (
    FlySummary,
    RepeatSummary,
    Table2Summary,
    SensedSummary,
    FootprintSummary,
    SweepSummary,
    FaultsSummary,
    VerifySummary,
    RegressSummary,
    CampaignSummary,
    IdentifySummary,
    LogReplaySummary,
    MarginsSummary,
    DiffSummary,
)
"""The summaries of the core's commands; the key "command" of a result folder says which it has."""

_UNFINISHED: Final = "campaign.json"
"""The file that a campaign writes first; it writes its summary last."""


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


def report_page(folders: Sequence[Path], progress: Callable[[int], None]) -> tuple[str, list[ReportedFolder]]:
    """Return the HTML page of `folders`, in their order, and its overview.

    Calls `progress` with the number of folders that are done. Raises ResultsError and TraceError.
    """
    summaries = [read_summary(folder) for folder in folders]
    shown = [(str(folder), one.result(folder)) for folder, one in zip(folders, summaries, strict=True)]
    overview = [
        ReportedFolder(folder, summary.command, one.title, one.good, one.finding, one.missing)
        for (folder, one), summary in zip(shown, summaries, strict=True)
    ]
    return results_page(shown, {summary.generator for summary in summaries}, progress), overview


def results() -> tuple[type[ReportedSummary], ...]:
    """Return the summaries that a result folder may have, those of extensions too."""
    return (*RESULTS, *extensions.load_all("report").values())


def read_summary(folder: Path) -> ReportedSummary:
    """Read the summary in a result folder; raises ResultsError."""
    if (folder / SUMMARY).is_file():
        return _read(folder / SUMMARY, *results())
    if (folder / _UNFINISHED).is_file():
        return _read(folder / _UNFINISHED, UnfinishedCampaign)
    what = f"has no {SUMMARY}" if folder.is_dir() else f"is not a folder{guess_name(folder)}"
    commands = ", ".join(kind.command for kind in results())
    raise ResultsError(f"{echo(str(folder))}: {what}; name a result folder of {commands}")


def _read(path: Path, *kinds: type[ReportedSummary]) -> ReportedSummary:
    """Read the summary at `path` as one of `kinds`; raises ResultsError."""
    name = echo(str(path))
    try:
        document: Any = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise ResultsError(f"{name}: cannot be read as JSON: {error}; run its command again") from error
    command = document.get("command") if isinstance(document, dict) else None
    kind = next((kind for kind in kinds if kind.command == command), None)
    if kind is None:
        commands = ", ".join(kind.command for kind in kinds)
        if command is None:
            raise ResultsError(f"{name}: is the result of no command; run one of {commands}")
        raise ResultsError(f"{name}: command = {echo(str(command))} must be one of {commands}")
    try:
        return kind.model_validate({"generator": None} | document)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"])
        raise ResultsError(
            f"{name}: {echo(key)} is not what {command} writes: {first['msg']}; run {command} again"
        ) from error
