"""The kinds of results: the record that a command writes, and the section of the report that shows it."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from mambo_codegen.errors import echo
from mambo_sil.board.footprint.footprint_report import FootprintSummary
from mambo_sil.board.footprint.footprint_section import footprint_section, sweep_section
from mambo_sil.board.footprint.sweep import SweepSummary
from mambo_sil.board.pil.pil_report import BoardFlightSummary
from mambo_sil.board.pil.pil_section import board_section
from mambo_sil.errors import ResultsError
from mambo_sil.experiment.campaign.campaign_report import CampaignSummary, UnfinishedCampaign
from mambo_sil.experiment.campaign.campaign_section import campaign_section
from mambo_sil.experiment.faults.fault_flights import FaultsSummary
from mambo_sil.experiment.faults.faults_section import faults_section
from mambo_sil.experiment.regress.regress_report import RegressSummary
from mambo_sil.experiment.regress.regress_section import regress_section
from mambo_sil.experiment.table2.sensed import SensedSummary
from mambo_sil.experiment.table2.table2 import Table2Summary
from mambo_sil.experiment.table2.table2_section import sensed_section, table2_section
from mambo_sil.flight.flight_report import FlySummary, ReplaySummary
from mambo_sil.flight.flight_section import fly_section, replay_section
from mambo_sil.model.identify.identify_record import IdentifySummary
from mambo_sil.model.identify.identify_section import identify_section
from mambo_sil.model.replay.replay_report import LogReplaySummary
from mambo_sil.model.replay.replay_section import log_replay_section
from mambo_sil.results.folders import SUMMARY
from mambo_sil.results.section import Section
from mambo_sil.results.summary import Summary
from mambo_sil.verify.verify_report import VerifySummary
from mambo_sil.verify.verify_section import verify_section

_FINISHED: Final[dict[type[Summary], Callable[[Path, Any], Section]]] = {
    FlySummary: fly_section,
    ReplaySummary: replay_section,
    BoardFlightSummary: board_section,
    Table2Summary: table2_section,
    SensedSummary: sensed_section,
    FootprintSummary: footprint_section,
    SweepSummary: sweep_section,
    FaultsSummary: faults_section,
    VerifySummary: verify_section,
    RegressSummary: regress_section,
    CampaignSummary: campaign_section,
    IdentifySummary: identify_section,
    LogReplaySummary: log_replay_section,
}
_SECTIONS: Final = _FINISHED | {UnfinishedCampaign: campaign_section}

_UNFINISHED: Final = "campaign.json"
"""The file that a campaign writes first; it writes its summary last."""


def section(folder: Path, summary: Summary) -> Section:
    """Return the section of the report on a result folder; raises ResultsError and TraceError."""
    return _SECTIONS[type(summary)](folder, summary)


def read_summary(folder: Path) -> Summary:
    """Read the summary in a result folder; raises ResultsError."""
    if (folder / SUMMARY).is_file():
        return _read(folder / SUMMARY, *_FINISHED)
    if (folder / _UNFINISHED).is_file():
        return _read(folder / _UNFINISHED, UnfinishedCampaign)
    what = f"has no {SUMMARY}" if folder.is_dir() else "is not a folder"
    commands = ", ".join(kind.command for kind in _FINISHED)
    raise ResultsError(f"{echo(str(folder))}: {what}; name a result folder of {commands}")


def _read(path: Path, *kinds: type[Summary]) -> Summary:
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
        raise ResultsError(f"{name}: command = {echo(str(command))} must be one of {commands}")
    try:
        return kind.model_validate({"generator": None} | document)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"])
        raise ResultsError(
            f"{name}: {echo(key)} is not what {command} writes: {first['msg']}; run {command} again"
        ) from error
