"""The proof: no alarm whatever the settings, an alarm for every fault that it is there to exclude."""

import subprocess
from pathlib import Path

import pytest

from mambo_nmpc.codegen.flags import proofs
from mambo_nmpc.codegen.settings import presets
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.verify.check import CheckOutcome
from mambo_nmpc.sil.verify.proof import check, read_properties
from tests.support.cases import settings_case
from tests.support.one_norm import ONE_NORM
from tests.support.subjects import Harm, subject
from tests.support.tools import require

STEP, OPTIMIZER, COST, MATH = "src/nmpc.c", "src/nmpc_optimizer.c", "src/nmpc_cost.c", "src/nmpc_math.h"
HARMS = {
    "NaN passes a range check": Harm(
        MATH, r"\(value >= minimum\);\n(.*)\(value <= maximum\)", r"!(value < minimum);\n\1!(value > maximum)"
    ),
    "infinity passes a range check": Harm(MATH, r"\(value <= maximum\)", "1"),
    "a refused call writes": Harm(STEP, r"    if \(\(state != NULL\)", r"    self->converged = 0U;\n\g<0>"),
    "the heading goes unchecked": Harm(STEP, r"nmpc_within\(state->yaw_rad, NMPC_YAW_RANGE_RAD\)", "1"),
    "a weight goes unchecked": Harm(STEP, r"nmpc_between\(weights->effort, [^;]*?LIMIT\)", "1"),
    "the plan leaves the tilt limit": Harm(
        OPTIMIZER, r"nmpc_larger\((move_rad - [^,]*), -NMPC_TILT_LIMIT_RAD\)", r"\1"
    ),
    "a reset is not clamped": Harm(
        STEP, r"nmpc_clamp\(command->pitch_rad, NMPC_TILT_LIMIT_RAD\)", "command->pitch_rad"
    ),
    "a null pointer is followed": Harm(STEP, r"\(state != NULL\) && ", ""),
    "the cost starts uninitialised": Harm(STEP, r"    self->cost = \(nmpc_sum_t\)0;\n", ""),
    "one move too many": Harm(STEP, r"k < NMPC_MOVES", "k <= NMPC_MOVES"),
    "a table is read past its end": Harm(
        COST,
        r"\(NMPC_LAST_STEP - 1U\) - nmpc_lowest_set_bit",
        "(NMPC_LAST_STEP + 1U) - nmpc_lowest_set_bit",
    ),
    "a bad input leaves the command unset": Harm(
        STEP, r"(?s)    command->roll_rad = self->command_rad\[0\];\n(?=.*return status)", ""
    ),
}


@pytest.fixture(autouse=True)
def _frama_c() -> None:
    require("frama-c", "frama-c-base")


def of_scalar(name: str, scalar: str) -> Settings:
    """Return a preset in another scalar type."""
    return Settings.model_validate(presets.load(name).model_dump() | {"code": {"scalar": scalar}})


@pytest.mark.long
@pytest.mark.parametrize("scalar", ["float32", "float64", "fixed"])
@pytest.mark.parametrize("name", presets.names())
def test_a_preset_is_proven(name: str, scalar: str, tmp_path: Path) -> None:
    """Every promise of the driver holds, and what Frama-C said stays as evidence."""
    its = subject(of_scalar(name, scalar), tmp_path)
    result = check(its)
    assert result.outcome is CheckOutcome.PASSED, result.evidence
    promises = 4 if scalar == "fixed" else 8 if its.settings.cost.norm == "quadratic" else 6
    assert result.figures["promises"] == result.figures["promises_proven"] == promises
    for proof in proofs(scalar, its.settings.cost.norm):
        assert "Valid" in {one.status for one in read_properties(its.folder / f"{proof}.csv")}
        assert "ANALYSIS SUMMARY" in (its.folder / f"{proof}.txt").read_text("utf-8")


FIXED_HARMS = {
    "the heading goes unchecked": HARMS["the heading goes unchecked"],
    "the plan leaves the tilt limit": HARMS["the plan leaves the tilt limit"],
    "a rest that does not fit": Harm(
        "src/nmpc_math.c", r"NMPC_ROUNDED\(fine_rad, 40 - NMPC_SINE_BITS\)", "NMPC_ROUNDED(fine_rad, 8)"
    ),
    "errors have a bit too many": Harm(
        "include/nmpc_config.h", r"(#define NMPC_ERROR_BITS) \d+", r"\1 NMPC_ACCELERATION_BITS - 1"
    ),
}


@pytest.mark.long
@pytest.mark.parametrize("harm", FIXED_HARMS)
def test_a_fault_of_fixed_point_raises_an_alarm(harm: str, tmp_path: Path) -> None:
    """What overflows in the middle of a step is found as what a caller hands in."""
    result = check(subject(of_scalar("mambo-1norm", "fixed"), tmp_path, FIXED_HARMS[harm]))
    assert result.outcome is CheckOutcome.FAILED, result.evidence


@pytest.mark.long
@pytest.mark.parametrize("index", [0, 1, 2, 3, 5, 6, 9, 14])
def test_settings_of_every_kind_are_proven(index: int, tmp_path: Path) -> None:
    """Horizons, variants, warm starts and limits change; the options of the proof do not."""
    scalar = ("float32", "float64", "fixed")[index % 3]
    result = check(subject(settings_case(index, scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.parametrize(
    "harm",
    [pytest.param(harm, marks=[] if index == 0 else [pytest.mark.long]) for index, harm in enumerate(HARMS)],
)
def test_a_fault_raises_an_alarm(harm: str, tmp_path: Path) -> None:
    """Each is what a slip of the hand would make, and none goes through."""
    result = check(subject(ONE_NORM, tmp_path, HARMS[harm]))
    assert result.outcome is CheckOutcome.FAILED
    (alarm, *_) = result.figures["alarms"]
    assert alarm["place"] in result.evidence
    assert ".c:" in alarm["place"] or ".h:" in alarm["place"]


def test_code_that_cannot_be_read_fails(tmp_path: Path) -> None:
    """No report is no proof."""
    result = check(subject(ONE_NORM, tmp_path, Harm(STEP, r"\bstatic\b", "statik")))
    assert result.outcome is CheckOutcome.FAILED
    assert "frama-c failed" in result.evidence


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        (r"while \(any_int != 0\)", "while (0)"),
        pytest.param(r"        check\(&controller\);\n", "", marks=pytest.mark.long),
    ],
)
def test_promises_that_are_never_reached_fail(right: str, wrong: str, tmp_path: Path) -> None:
    """A driver that ends before its promises, or leaves one out, proves nothing."""
    result = check(subject(ONE_NORM, tmp_path, Harm("proof/nmpc_proof.c", right, wrong)))
    assert result.outcome is CheckOutcome.FAILED
    assert "Dead" in result.evidence or "not reached" in result.evidence


@pytest.mark.long
@pytest.mark.parametrize("harm", [None, "the heading goes unchecked"])
@pytest.mark.parametrize("amalgamate", [False, True])
def test_make_proof_comes_to_the_same_verdict(harm: str | None, tmp_path: Path, *, amalgamate: bool) -> None:
    """The command of the bundle, in both layouts, ends in an error unless everything is proven."""
    require("make", "make")
    harms = [HARMS[harm]] if harm else []
    its = subject(ONE_NORM, tmp_path, *harms, amalgamate=amalgamate)
    done = subprocess.run(["make", "proof"], cwd=its.bundle, capture_output=True, text=True, check=False)
    assert (done.returncode == 0) == (harm is None), done.stdout
