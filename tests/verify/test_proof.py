"""The proof: no alarm whatever the settings, an alarm for every fault; its record holds for one C alone."""

import subprocess
from pathlib import Path

import pytest

from mambo_codegen.methods import method_of
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.verify.check import CheckOutcome, Subject
from mambo_sil.verify.proof import check, read_properties
from tests.support import proven
from tests.support.alarms import (
    INFINITY_PASSES,
    NAN_PASSES,
    NULL_FOLLOWED,
    UNCHECKED_HEADING,
    UNLIMITED_CLAMP,
    UNSET_COMMAND,
    Alarm,
    Fault,
    harmed,
    runs,
)
from tests.support.cases import settings_case
from tests.support.one_norm import ONE_NORM
from tests.support.subjects import Harm, subject
from tests.support.tools import require

CONTROLLER, DRIVER = "nmpc.c", "proof/nmpc_proof.c"
ROLL = Alarm(DRIVER, "roll_is_within_the_limit", "user assertion")
UNINITIALISED = Harm(CONTROLLER, r"    self->cost = \(nmpc_sum_t\)0;\n", "")
UNLIMITED = Harm(CONTROLLER, r"larger\((move_rad - [^,]*), -limit_rad\)", r"\1")
FAULTS = {
    "NaN passes a range check": Fault(
        "refuse_nan",
        NAN_PASSES,
        Alarm(CONTROLLER, "prediction->gain_x_m_step2_rad[NMPC_ROLL] =", "mem_access"),
    ),
    "a refused call writes": Fault(
        "refuse_nan",
        Harm(CONTROLLER, r"    if \(\(state != NULL\)", r"    self->converged = 0U;\n\g<0>"),
        Alarm(CONTROLLER, "self->converged = 0U;", "mem_access"),
    ),
    "the heading goes unchecked": Fault(
        "refuse_nan",
        UNCHECKED_HEADING,
        Alarm(CONTROLLER, "prediction->gain_x_m_step2_rad[NMPC_ROLL] =", "mem_access"),
    ),
    "a weight goes unchecked": Fault(
        "refuse_nan",
        Harm(
            CONTROLLER,
            r"within\(weights->effort,[^;{]*?effort >= \(nmpc_real_t\)0\)",
            "(weights->tracking >= (nmpc_real_t)0)",
        ),
        Alarm(CONTROLLER, "self->weights = *weights;", "mem_access"),
    ),
    "a null pointer is followed": Fault(
        "refuse_nan",
        NULL_FOLLOWED,
        Alarm(CONTROLLER, "within(position_m[0]", "mem_access"),
    ),
    "infinity passes a range check": Fault(
        "take_numbers",
        INFINITY_PASSES,
        Alarm(CONTROLLER, "(angle_rad - (count * NMPC_QUARTER_TURN_RAD))", "is_nan"),
    ),
    "a bad input leaves the command unset": Fault(
        "take_numbers",
        UNSET_COMMAND,
        ROLL,
    ),
    "the plan leaves the tilt limit": Fault("take_numbers", UNLIMITED, ROLL),
    "a clamp that does not limit": Fault("take_numbers", UNLIMITED_CLAMP, ROLL),
    "the cost starts uninitialised": Fault(
        "take_numbers", UNINITIALISED, Alarm(DRIVER, "(void)stored[i];", "initialization")
    ),
    "a reset is not clamped": Fault(
        "take_numbers",
        Harm(CONTROLLER, r"clamp\(command->pitch_rad, tilt_limit\(self\)\)", "command->pitch_rad"),
        Alarm(DRIVER, "pitch_is_within_the_limit", "user assertion"),
    ),
    "one move too many": Fault(
        "take_numbers",
        Harm(
            CONTROLLER,
            r"k < (NMPC_MOVES; k\+\+\) \{\n        self->plan_rad\[k\] = self->command)",
            r"k <= \1",
        ),
        Alarm(CONTROLLER, "self->plan_rad[k] = self->command_rad", "index_bound"),
    ),
    "a table is read past its end": Fault(
        "take_numbers",
        Harm(
            CONTROLLER,
            r"\(NMPC_LAST_STEP - 1U\) - lowest_set_bit",
            "(NMPC_LAST_STEP + 1U) - lowest_set_bit",
        ),
        Alarm(CONTROLLER, "response_sum[i][k]", "index_bound"),
    ),
}
AT_ONCE = (
    ("one move too many", "a table is read past its end"),
    ("infinity passes a range check", "a bad input leaves the command unset"),
)
"""Faults that one proof shows at once; each of the others has a proof of its own."""

FIXED_FAULTS = {
    "the heading goes unchecked": Fault(
        "take_numbers",
        UNCHECKED_HEADING,
        Alarm(CONTROLLER, "sine_cosine(", "precondition of sine_cosine"),
    ),
    "errors have a bit too many": Fault(
        "take_numbers",
        Harm("nmpc.h", r"(#define NMPC_ERROR_BITS) \d+", r"\1 NMPC_ACCELERATION_BITS - 1"),
        Alarm(CONTROLLER, "NMPC_ACCELERATION_BITS - NMPC_ERROR_BITS", "shift"),
    ),
    "the plan leaves the tilt limit": Fault("take_numbers", UNLIMITED, ROLL),
    "a rest that does not fit": Fault(
        "turn_everywhere",
        Harm(
            CONTROLLER,
            r"NMPC_ROUNDED\(fine_rad, NMPC_FINE_BITS - NMPC_SINE_BITS\)",
            "NMPC_ROUNDED(fine_rad, 8)",
        ),
        Alarm(CONTROLLER, "NMPC_ROUNDED(fine_rad, 8)", "signed_downcast"),
    ),
}
FIXED_AT_ONCE = (("the heading goes unchecked", "errors have a bit too many"),)
COMMENT = Harm(CONTROLLER, r"    return status;\n", r"    /* Done. */\n\g<0>")
CONTRACT = Harm(DRIVER, r"/\*@ assert [^*]*<=[^*]*\*/", "")
INDEX = Harm(CONTROLLER, r"= self->plan_rad\[1\]", "= self->plan_rad[0]")
FEW_HEADINGS = Harm(DRIVER, r"quadrant = -653; quadrant <= 653", "quadrant = 0; quadrant <= 0")
"""An alarm for one heading is an alarm for all."""
MOST_WORK = 20
"""Moves times iterations of a search that Frama-C interprets in seconds."""


@pytest.fixture(autouse=True)
def _frama_c() -> None:
    require("frama-c", "frama-c-base")


def of_scalar(name: str, scalar: str) -> Settings:
    """Return a preset in another scalar type."""
    return Settings.model_validate(presets.load(name).model_dump() | {"code": {"scalar": scalar}})


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "scalar"),
    [
        *((name, "float32") for name in presets.names()),
        ("mambo-1norm", "float64"),
        *((name, "fixed") for name in presets.names() if name != "table1-printed"),
    ],
)
def test_a_preset_is_proven(name: str, scalar: str, tmp_path: Path) -> None:
    """Every promise of the driver holds, and what Frama-C said stays as evidence.

    With float64, whose C is that of float32 with another type, one preset of a 1-norm (`test_quadratic` has
    settings of a quadratic cost); in fixed point not that which differs from another by two signs. One is
    checked as a user does it; of the others what `tests.support.proven` leaves to be proven.
    """
    its = subject(of_scalar(name, scalar), tmp_path)
    whole = (name, scalar) == ("mambo-1norm", "float32")
    result = check(its) if whole else proven.check(its)
    assert result.outcome is CheckOutcome.PASSED, result.evidence
    promises = 5 if scalar == "fixed" else 11 if its.settings.controller.method == "quadratic" else 8
    assert result.figures["promises"] == result.figures["promises_proven"] == promises
    for proof in method_of(its.settings).proofs if whole else ():
        assert "Valid" in {one.status for one in read_properties(its.folder / f"{proof}.csv")}
        assert "ANALYSIS SUMMARY" in (its.folder / f"{proof}.txt").read_text("utf-8")


def of_few_steps(settings: Settings) -> Settings:
    """Return settings of the same C with a short horizon, which Frama-C interprets in a second."""
    document = settings.model_dump()
    document["horizon"] |= {"prediction": 3, "control": 1}
    document["optimizer"] |= {"iterations": 2}
    return Settings.model_validate(document)


@pytest.mark.long
@pytest.mark.parametrize("names", runs(FIXED_FAULTS, FIXED_AT_ONCE), ids=", ".join)
def test_a_fault_of_fixed_point_raises_an_alarm(names: tuple[str, ...], tmp_path: Path) -> None:
    """What overflows in the middle of a step is found as what a caller hands in."""
    settings = of_few_steps(of_scalar("mambo-1norm", "fixed"))
    faults = {name: FIXED_FAULTS[name] for name in names}
    assert proven.unnoticed(harmed(settings, tmp_path, faults, FEW_HEADINGS), faults) == []


@pytest.mark.long
@pytest.mark.parametrize("index", [0, 1, 2, 3, 5, 6, 9, 14])
def test_settings_of_every_kind_are_proven(index: int, tmp_path: Path) -> None:
    """Horizons, variants, warm starts and limits change; the options of the proof do not.

    A long search ends early, since all its iterations are the same C; the presets and case 14 have 5 and 10.
    """
    scalar = ("float32", "float64", "fixed")[index % 3]
    settings = settings_case(index, scalar)
    if settings.horizon.control * settings.optimizer.iterations > MOST_WORK:
        settings = with_option(settings, "optimizer.iterations", 3)
    result = proven.check(subject(settings, tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.first_is_quick
@pytest.mark.parametrize("names", runs(FAULTS, AT_ONCE), ids=", ".join)
def test_a_fault_raises_an_alarm(names: tuple[str, ...], tmp_path: Path) -> None:
    """Each is what a slip of the hand would make, and none goes through."""
    faults = {name: FAULTS[name] for name in names}
    assert proven.unnoticed(harmed(of_few_steps(ONE_NORM), tmp_path, faults), faults) == []


@pytest.mark.long
def test_an_alarm_fails_the_check_and_is_named_by_file_and_line(tmp_path: Path) -> None:
    """The evidence has the first alarms, the figures all."""
    result = check(subject(of_few_steps(ONE_NORM), tmp_path, UNINITIALISED))
    assert result.outcome is CheckOutcome.FAILED
    (alarm, *_) = result.figures["alarms"]
    assert alarm["place"] in result.evidence
    assert ".c:" in alarm["place"] or ".h:" in alarm["place"]


def test_code_that_cannot_be_read_fails(tmp_path: Path) -> None:
    """No report is no proof."""
    result = check(
        subject(of_few_steps(ONE_NORM), tmp_path, Harm(CONTROLLER, r"\bstatic const\b", "statik const"))
    )
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
    result = check(subject(of_few_steps(ONE_NORM), tmp_path, Harm("proof/nmpc_proof.c", right, wrong)))
    assert result.outcome is CheckOutcome.FAILED
    assert "Dead" in result.evidence or "not reached" in result.evidence


@pytest.mark.long
@pytest.mark.parametrize("harm", [None, UNCHECKED_HEADING], ids=["right", "wrong"])
def test_make_proof_comes_to_the_same_verdict(harm: Harm | None, tmp_path: Path) -> None:
    """The command of the bundle ends in an error unless everything is proven."""
    require("make", "make")
    its = subject(of_few_steps(ONE_NORM), tmp_path, *([harm] if harm else []))
    done = subprocess.run(["make", "proof"], cwd=its.bundle, capture_output=True, text=True, check=False)
    assert (done.returncode == 0) == (harm is None), done.stdout


@pytest.fixture
def record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give the test a record of its own, which is empty."""
    monkeypatch.setattr(proven, "RECORD", tmp_path / "proven.txt")
    monkeypatch.delenv(proven.ANEW, raising=False)
    return tmp_path / "proven.txt"


def short(folder: Path, *harms: Harm) -> Subject:
    """Return a subject in a folder of its own."""
    folder.mkdir()
    return subject(with_option(ONE_NORM, "horizon.prediction", 5), folder, *harms)


def test_the_digest_depends_on_code_and_contracts_and_on_nothing_else(tmp_path: Path) -> None:
    """Not on comments."""
    right = proven.digest(short(tmp_path / "right"))
    assert proven.digest(short(tmp_path / "again")) == right
    assert proven.digest(short(tmp_path / "comment", COMMENT)) == right
    others = [
        proven.digest(short(tmp_path / name, harm))
        for name, harm in {"contract": CONTRACT, "index": INDEX}.items()
    ]
    assert len({right, *others}) == 3


@pytest.mark.usefixtures("record")
def test_c_that_the_record_lacks_is_proven(tmp_path: Path) -> None:
    """Frama-C finds that this one cannot be read."""
    wrong = short(tmp_path / "wrong", Harm(CONTROLLER, r"\bstatic const\b", "statik const"))
    result = proven.check(wrong)
    assert result.outcome is CheckOutcome.FAILED
    assert "frama-c failed" in result.evidence


def test_c_that_the_record_has_is_not_proven_again(tmp_path: Path, record: Path) -> None:
    """Unless all proofs are to be made."""
    wrong = short(tmp_path / "wrong", Harm(CONTROLLER, r"\bstatic const\b", "statik const"))
    record.write_text(f"{proven.digest(wrong)} 7 some test\n", "utf-8")
    assert proven.check(wrong).figures == {"promises": 7, "promises_proven": 7}
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(proven.ANEW, "anew")
        assert proven.check(wrong).outcome is CheckOutcome.FAILED
    assert record.read_text("utf-8").count("\n") == 1


def test_faults_that_the_record_has_are_not_tried_again(tmp_path: Path, record: Path) -> None:
    """But another line or kind of alarm is; this one none raises."""
    faults = {"none": Fault("refuse_nan", UNCHECKED_HEADING, Alarm(CONTROLLER, "no such line", "mem_access"))}
    wrong = short(tmp_path / "wrong", UNCHECKED_HEADING)
    assert proven.unnoticed(wrong, faults) == ["none"]
    record.write_text(f"{proven.alarm_digest(wrong, faults)} 1 some test\n", "utf-8")
    assert proven.unnoticed(wrong, faults) == []
    others = {"none": faults["none"]._replace(alarm=Alarm(CONTROLLER, "no such line", "shift"))}
    assert proven.unnoticed(wrong, others) == ["none"]


def test_what_a_test_proves_takes_the_place_of_what_it_proved_before(record: Path) -> None:
    """So the record grows by no line when the C changes; lines of other tests stay."""
    record.write_text("0a 7 some test\n", "utf-8")
    for key in ("1b", "2c"):
        proven._record(key, 5)
    first, second = record.read_text("utf-8").splitlines()
    assert first == "0a 7 some test"
    assert second.startswith("2c 5 tests/verify/test_proof.py::test_what_a_test_proves_takes")
