"""The results of a verification as a record, as text, as an HTML page and as a section of the report."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pydantic import Field

from mambo_codegen.errors import echo
from mambo_codegen.settings.controller_toml import to_toml
from mambo_codegen.settings.model import Settings
from mambo_sil.results.html_page import render_page
from mambo_sil.results.summary import ReportedSummary, Section
from mambo_sil.results.terminal import sentence, table
from mambo_sil.verify.check import CheckOutcome
from mambo_sil.verify.check_list import CHECKS

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

    def section(self, _folder: Path) -> Section:
        """Return the section of the report on this verification."""
        title = f"Verification of {self.source}"
        return Section("verify", title, self.verdict is CheckOutcome.PASSED, finding(self), self)


def verdict(found: Sequence[Verified]) -> CheckOutcome:
    """Return the worst outcome of all checks."""
    outcomes = {one.outcome for one in found}
    worst_first = (CheckOutcome.FAILED, CheckOutcome.INCOMPLETE, CheckOutcome.PASSED)
    return next(outcome for outcome in worst_first if outcome in outcomes)


def finding(summary: VerifySummary) -> str:
    """Return the result in one line: how many checks passed, failed, lacked a tool, and which did not run."""
    counted = Counter(one.outcome for one in summary.checks)
    said = f"{counted[CheckOutcome.PASSED]} of {len(summary.checks)} checks passed"
    for outcome in (CheckOutcome.FAILED, CheckOutcome.INCOMPLETE):
        said += f", {counted[outcome]} {outcome}" if counted[outcome] else ""
    return said + (f"; not run: {', '.join(summary.not_run)}" if summary.not_run else "")


def verify_text(summary: VerifySummary) -> str:
    """Return a summary as text: the answer, then a row for each check."""
    rows = [(one.name, one.outcome, one.evidence) for one in summary.checks]
    answer = sentence(f"{echo(summary.source)}: {finding(summary)}")
    return "\n".join([answer, "", *table(("check", "result", "evidence"), rows, (0, 1, 2))])


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


def page(summary: VerifySummary) -> str:
    """Render the summary as one HTML page that needs no other file."""
    return render_page("verify.html.j2", {"summary": summary})


def _left_out(found: Sequence[Verified]) -> list[str]:
    ran = {one.name for one in found}
    return [entry.name for entry in CHECKS if entry.name not in ran]
