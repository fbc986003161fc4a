"""The results of a verification: record and result."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pydantic import Field

from mambo_codegen.errors import echo
from mambo_codegen.settings.controller_toml import to_toml
from mambo_codegen.settings.model import Settings
from mambo_sil.results.blocks import CommandResult, Details, Facts, Listing, Note, ResultTable
from mambo_sil.results.folders import SUMMARY
from mambo_sil.results.summary import ReportedSummary
from mambo_sil.verify.check import CHECKS, CheckOutcome

PAGE: Final = "verify.html"


@dataclass(frozen=True)
class Verified:
    """A check that ran, and its result; `figures` are for programs."""

    name: str
    about: str
    outcome: CheckOutcome
    evidence: str
    figures: Mapping[str, Any]
    tools: Mapping[str, str]


class VerifySummary(ReportedSummary):
    """The results of `verify`; `files` has the SHA-256 of every file in the folder."""

    command = "verify"

    source: str
    digest: str
    scalar: str
    verdict: CheckOutcome
    not_run: list[str]
    checks: list[Verified]
    tools: dict[str, str]
    settings: str
    files: dict[str, str] = Field(default_factory=dict)

    def result(self, _folder: Path, /) -> CommandResult:
        """Return the result: a row for each check."""
        rows = [(one.name, one.outcome, one.evidence, one.about) for one in self.checks]
        tools = {tool: version or "version unknown" for tool, version in self.tools.items()}
        about = (
            f"{self.generator}, settings {self.digest}, {self.scalar}. The checked C is in controller/, the "
        )
        about += f"output of the tools in checks/, the SHA-256 of every file in {SUMMARY}."
        return CommandResult(
            f"Verification of {echo(self.source)}",
            self.verdict is CheckOutcome.PASSED,
            [_finding(self)],
            [
                Note(about),
                ResultTable(("check", "result", "evidence", "what it shows"), rows, range(4), (3,)),
                Details("Tools and settings", [Facts(tools), Listing(self.settings)]),
            ],
            echo(self.source),
        )


def verdict(found: Sequence[Verified]) -> CheckOutcome:
    """Return the worst outcome of all checks."""
    outcomes = {one.outcome for one in found}
    worst_first = (CheckOutcome.FAILED, CheckOutcome.INCOMPLETE, CheckOutcome.PASSED)
    return next(outcome for outcome in worst_first if outcome in outcomes)


def _finding(summary: VerifySummary) -> str:
    """Return the result in one line: how many checks passed, failed, lacked a tool, and which did not run."""
    counted = Counter(one.outcome for one in summary.checks)
    said = f"{counted[CheckOutcome.PASSED]} of {len(summary.checks)} checks passed"
    for outcome in (CheckOutcome.FAILED, CheckOutcome.INCOMPLETE):
        said += f", {counted[outcome]} {outcome}" if counted[outcome] else ""
    return said + (f"; not run: {', '.join(summary.not_run)}" if summary.not_run else "")


def summarise(found: Sequence[Verified], source: str, settings: Settings) -> VerifySummary:
    """Return the summary of all checks, without the digests of the files."""
    return VerifySummary(
        source=source,
        digest=settings.short_digest,
        scalar=settings.code.scalar,
        verdict=verdict(found),
        not_run=_left_out(found),
        checks=list(found),
        tools=dict(sorted((tool, version) for one in found for tool, version in one.tools.items())),
        settings=to_toml(settings),
    )


def _left_out(found: Sequence[Verified]) -> list[str]:
    ran = {one.name for one in found}
    return [entry.name for entry in CHECKS if entry.name not in ran]
