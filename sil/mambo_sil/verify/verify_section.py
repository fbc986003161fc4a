"""The section of the report on a verification."""

from pathlib import Path

from mambo_sil.results.section import Section
from mambo_sil.verify.check import CheckOutcome
from mambo_sil.verify.verify_report import VerifySummary


def verify_section(_folder: Path, summary: VerifySummary) -> Section:
    """Return the section of a verification."""
    passed = sum(check.outcome is CheckOutcome.PASSED for check in summary.checks)
    finding = f"{summary.verdict}: {passed} of {len(summary.checks)} checks passed"
    finding += f"; not run: {', '.join(summary.not_run)}" if summary.not_run else ""
    title = f"Verification of {summary.source}"
    return Section("verify", title, summary.verdict is CheckOutcome.PASSED, finding, summary)
