"""Every line and branch of the generated C is run by the cases, or the reason why not is listed."""

import json
from pathlib import Path

import pytest

from benchmarks.sign_decisions import in_scalar
from mambo_nmpc.codegen.settings import presets
from mambo_nmpc.codegen.settings.controller_toml import with_option
from mambo_nmpc.sil.verify.check import Outcome, Result
from tests.support import coverage
from tests.support.cases import settings_case
from tests.support.subjects import subject
from tests.support.tools import require

DEAD = (
    "src/nmpc.c",
    "    nmpc_status_t status = NMPC_OK;\n\n    if (!(is_good",
    "    nmpc_status_t status = NMPC_OK;\n\n    if (status == NMPC_BAD_THRUST) {\n"
    "        return NMPC_BAD_COMMAND;\n    }\n    if (!(is_good",
)
LOOP = "for (part = 1; (changes != 0U) && (part < NMPC_PREDICTION_HORIZON); part++) {"


def explained_outside_the_self_test(result: Result) -> list[str]:
    """Return the lines whose gaps needed a reason."""
    gaps = (row["gap"] for row in result.figures["explained"])
    return [gap.partition(": ")[2].partition(": ")[2] for gap in gaps if "self_test" not in gap]


@pytest.fixture(autouse=True)
def _tools() -> None:
    require("gcc", "gcc")
    require("gcov", "gcc")


def test_every_line_is_run_and_every_branch_taken(tmp_path: Path) -> None:
    """What no case reaches is explained: beside the self-test, that the bound of a loop is not used up."""
    result = coverage.check(subject(presets.load("mambo"), tmp_path))
    assert result.outcome is Outcome.PASSED, result.evidence
    assert result.figures["branches"] > 100
    assert json.loads(json.dumps(result.figures)) == result.figures
    assert explained_outside_the_self_test(result) == [LOOP]


@pytest.mark.long
@pytest.mark.parametrize("name", [*presets.names(), "case 7 of another name"])
def test_every_line_is_run_whatever_the_settings(name: str, tmp_path: Path) -> None:
    """Every preset; the reasons are found under another prefix too."""
    settings = presets.load(name) if name in presets.names() else settings_case(7, "float64")
    if name not in presets.names():
        settings = with_option(settings, "code.prefix", "left_wing")
    result = coverage.check(subject(settings, tmp_path))
    assert result.outcome is Outcome.PASSED, result.evidence


@pytest.mark.long
def test_floats_around_whole_numbers_are_run(tmp_path: Path) -> None:
    """In fixed point nmpc_float.c is played too; no gap of it needs a reason."""
    result = coverage.check(subject(in_scalar(presets.load("mambo"), "fixed"), tmp_path))
    assert result.outcome is Outcome.PASSED, result.evidence
    assert explained_outside_the_self_test(result) == [LOOP]


def test_floats_that_differ_from_their_numbers_fail(tmp_path: Path) -> None:
    """A scale that is wrong shows in the replay."""
    fault = (
        "src/nmpc_float.c",
        "number_of(state->yaw_rad, NMPC_YAW_SCALE)",
        "number_of(state->yaw_rad, 1.0f)",
    )
    result = coverage.check(subject(in_scalar(presets.load("mambo"), "fixed"), tmp_path, fault))
    assert result.outcome is Outcome.FAILED
    assert "the self-test fails" in result.evidence


def test_a_dead_line_and_its_branch_fail_by_name(tmp_path: Path) -> None:
    """The evidence names the first; the file beside it has rows to paste, once they are explained."""
    made = subject(presets.load("mambo"), tmp_path, DEAD)
    result = coverage.check(made)
    assert result.outcome is Outcome.FAILED
    assert any("never run: return NMPC_BAD_COMMAND;" in gap for gap in result.figures["unexplained"])
    assert any("never taken: if (status == NMPC_BAD_THRUST)" in gap for gap in result.figures["unexplained"])
    assert "Reason(" in (made.folder / "unexplained.txt").read_text()


def test_counting_must_not_change_a_bit(tmp_path: Path) -> None:
    """A build that computes something else says nothing about the lines of this one."""
    fault = (
        "src/nmpc.c",
        "self->command_rad[1] = self->plan_rad[1];",
        "self->command_rad[1] = self->plan_rad[0];",
    )
    result = coverage.check(subject(presets.load("mambo"), tmp_path, fault))
    assert result.outcome is Outcome.FAILED
    assert "the build that counts" in result.evidence


def test_without_gcov_the_check_is_incomplete(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It names what to install, and never passes."""
    made = subject(presets.load("mambo"), tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    result = coverage.check(made)
    assert result.outcome is Outcome.INCOMPLETE
    assert "Debian's package gcc" in result.evidence
