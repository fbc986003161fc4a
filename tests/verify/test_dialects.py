"""The check of warnings: silent C passes, a warning in any dialect fails by file and line."""

from pathlib import Path

import pytest

from mambo_sil.verify.check import CheckOutcome
from mambo_sil.verify.dialects import DIALECTS, check
from tests.support.one_norm import ONE_NORM
from tests.support.subjects import Harm, subject
from tests.support.tools import require

HARMS = {
    "a conversion that loses digits": Harm("nmpc.c", r"\+ \(nmpc_real_t\)absolute\(", "+ (double)absolute("),
    "a declaration inside for": Harm("nmpc.c", r"    for \(k = 0;", "    for (int k = 0;"),
}


@pytest.fixture(autouse=True)
def _compilers() -> None:
    for dialect in DIALECTS.values():
        require(dialect.compiler, dialect.package)


@pytest.mark.long
def test_silent_c_passes(tmp_path: Path) -> None:
    """Every dialect is counted, and what each compiler said is kept."""
    its = subject(ONE_NORM, tmp_path)
    result = check(its)
    assert result.outcome is CheckOutcome.PASSED, result.evidence
    assert result.figures["silent"] == list(DIALECTS)
    log = (its.folder / "compilers.txt").read_text("utf-8")
    assert log.count("exit code 0") == len(DIALECTS)


@pytest.mark.long
@pytest.mark.parametrize("harm", HARMS)
def test_a_warning_fails(harm: str, tmp_path: Path) -> None:
    """It is named by dialect, file and line."""
    result = check(subject(ONE_NORM, tmp_path, HARMS[harm]))
    assert result.outcome is CheckOutcome.FAILED
    assert f"{HARMS[harm].path}:" in result.evidence
