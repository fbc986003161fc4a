"""The kinds of results: the record that a command writes, and the section of the report that shows it."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from mambo_nmpc.codegen.errors import echo
from mambo_nmpc.sil.campaign.report import CampaignSummary, UnfinishedCampaign
from mambo_nmpc.sil.campaign.section import campaign_section
from mambo_nmpc.sil.errors import ResultsError
from mambo_nmpc.sil.faults.flights import FaultsSummary
from mambo_nmpc.sil.faults.section import faults_section
from mambo_nmpc.sil.files.folders import SUMMARY
from mambo_nmpc.sil.files.summary import Summary
from mambo_nmpc.sil.flight.report import FlySummary, ReplaySummary
from mambo_nmpc.sil.flight.section import fly_section, replay_section
from mambo_nmpc.sil.footprint.report import FootprintSummary
from mambo_nmpc.sil.footprint.section import footprint_section, sweep_section
from mambo_nmpc.sil.footprint.sweep import SweepSummary
from mambo_nmpc.sil.identify.record import IdentifySummary
from mambo_nmpc.sil.identify.section import identify_section
from mambo_nmpc.sil.paper.section import sensed_section, table2_section
from mambo_nmpc.sil.paper.sensed import SensedSummary
from mambo_nmpc.sil.paper.table2 import Table2Summary
from mambo_nmpc.sil.pil.report import BoardFlightSummary
from mambo_nmpc.sil.pil.section import board_section
from mambo_nmpc.sil.regress.report import RegressSummary
from mambo_nmpc.sil.regress.section import regress_section
from mambo_nmpc.sil.replay.report import LogReplaySummary
from mambo_nmpc.sil.replay.section import log_replay_section
from mambo_nmpc.sil.show.section import Section
from mambo_nmpc.sil.verify.report import VerifySummary
from mambo_nmpc.sil.verify.section import verify_section

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
