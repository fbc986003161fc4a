"""A controller with a quadratic cost: every check passes it, and fails it with a fault in its C."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from mambo_nmpc.codegen.reference import Status
from mambo_nmpc.sil.verify import bits, dialects, fuzzing, proof, rules, sanitizers
from mambo_nmpc.sil.verify.cases import cases
from mambo_nmpc.sil.verify.check import CheckOutcome, Result, Subject
from tests.support.quadratic import quadratic_settings
from tests.support.subjects import Harm, subject
from tests.support.tools import require

STEP, MATH = "src/nmpc.c", "src/nmpc_math.h"
ATTITUDE, OBSERVER, OPTIMIZER = "src/nmpc_attitude.c", "src/nmpc_observer.c", "src/nmpc_optimizer.c"
FEW_RUNS = 20_000

UNPROVEN = {
    "NaN passes a range check": Harm(
        MATH, r"\(value >= minimum\);\n(.*)\(value <= maximum\)", r"!(value < minimum);\n\1!(value > maximum)"
    ),
    "infinity passes a range check": Harm(MATH, r"\(value <= maximum\)", "1"),
    "the heading goes unchecked": Harm(STEP, r"nmpc_within\(state->yaw_rad, NMPC_YAW_RANGE_RAD\)", "1"),
    "a refused state is used": Harm(STEP, r"\(has_state != 0\) \? state : NULL", "state"),
    "a refused target is used": Harm(
        STEP, r"\(\(has_target != 0\) && \(has_thrust != 0\)\) \? target : NULL", "target"
    ),
    "the command leaves the tilt limit": Harm(
        STEP, r"nmpc_clamp\((nmpc_attitude_roll[^;]*), NMPC_TILT_LIMIT_RAD\)", r"\1"
    ),
    "a set command is not clamped": Harm(
        STEP,
        r"command_rad\[0\] = nmpc_clamp\(command->roll_rad, NMPC_TILT_LIMIT_RAD\)",
        "command_rad[0] = command->roll_rad",
    ),
    "the model has no limit": Harm(
        ATTITUDE, r"return nmpc_clamp\(sum, NMPC_ATTITUDE_LIMIT_M_STEP2\)", "return sum"
    ),
    "a null pointer is followed": Harm(STEP, r"\(state != NULL\) && ", ""),
    "a row is read past its end": Harm(OPTIMIZER, r"k < NMPC_STATES", "k <= NMPC_STATES"),
    "the model starts uninitialised": Harm(ATTITUDE, r"    self->attitude.cosine = NMPC_ONE;\n", ""),
    "a bad input leaves the command unset": Harm(
        STEP, r"(?s)    command->roll_rad = self->command_rad\[0\];\n(?=.*return status)", ""
    ),
}
FAULTS: dict[str, tuple[Callable[[Subject], Result], Harm]] = {
    "a warning": (dialects.check, Harm(STEP, r"    int axis;\n", r"    int unused;\n\g<0>")),
    "a rule": (
        rules.check,
        Harm(STEP, r"    return status;\n\}", "    goto end;\nend:\n    return status;\n}"),
    ),
    "another bit": (bits.check, Harm(OBSERVER, r"NMPC_VELOCITY_BY_POSITION", "NMPC_VELOCITY_BY_VELOCITY")),
    "another state": (bits.check, Harm(OPTIMIZER, r"row\[k\] \* state\[k\]", "row[k] * state[k - 1]")),
    "a flag that stays": (bits.check, Harm(STEP, r"    self->saturated = 0U;\n", "")),
    "an outage a step too long": (
        bits.check,
        Harm(STEP, r"\(NMPC_OUTAGE_STEPS \+ 1U\)", "(NMPC_OUTAGE_STEPS + 2U)"),
    ),
    "a state past its end": (sanitizers.check, Harm(OPTIMIZER, r"k < NMPC_STATES", "k <= NMPC_STATES")),
    "memory read before it is written": (
        sanitizers.check,
        Harm(ATTITUDE, r"    self->attitude.cosine = NMPC_ONE;\n", ""),
    ),
    "a refused state leaves a trace": (
        lambda its: fuzzing.check(its, runs=FEW_RUNS),
        Harm(STEP, r"\(has_state != 0\) \? state : NULL", "state"),
    ),
    "a refused command is set": (
        lambda its: fuzzing.check(its, runs=FEW_RUNS),
        Harm(
            STEP,
            r"(?s)(nmpc_set_command\(.*?)    if \(!is_good_command\(command\)\) \{\n",
            r"\1    if (0) {\n",
        ),
    ),
}


def test_the_cases_have_outcomes_of_every_status() -> None:
    """All statuses but that of weights, a command at its limit, and an outage longer than the estimate."""
    outcomes = np.concatenate(cases(quadratic_settings())[1])
    assert set(outcomes["status"]) == {int(status) for status in Status} - {Status.BAD_WEIGHT}
    assert set(outcomes["saturated"]) == {0, 1}
    assert set(outcomes["missed"]) == set(range(52))


@pytest.mark.parametrize(
    ("check", "tool", "package"),
    [
        pytest.param(dialects.check, "clang", "clang", id="warnings"),
        pytest.param(rules.check, "cppcheck", "cppcheck", id="rules"),
        pytest.param(bits.check, "clang", "clang", id="bits"),
        pytest.param(proof.check, "frama-c", "frama-c-base", id="proof", marks=pytest.mark.long),
        pytest.param(sanitizers.check, "clang", "clang", id="sanitizers", marks=pytest.mark.long),
        pytest.param(fuzzing.check, "clang", "clang", id="fuzzing", marks=pytest.mark.long),
    ],
)
@pytest.mark.parametrize("scalar", ["float32", pytest.param("float64", marks=pytest.mark.long)])
def test_a_check_passes(
    check: Callable[[Subject], Result], tool: str, package: str, scalar: str, tmp_path: Path
) -> None:
    """Nothing is found, in either format of floats."""
    require(tool, package)
    result = check(subject(quadratic_settings(scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.long
@pytest.mark.parametrize("variant", ["one move", "measured", "untracked", "given"])
def test_other_settings_are_proven(variant: str, tmp_path: Path) -> None:
    """One free move, a measured attitude of old measurements, no tracker and no feedback, an acceleration."""
    require("frama-c", "frama-c-base")
    document = quadratic_settings().model_dump()
    match variant:
        case "one move":
            document["horizon"]["ramp_s"] = 0.0
        case "measured":
            document["model"]["attitude"] = "measured"
            document["observer"]["age_s"] = 0.03
        case "given":
            document["target"]["acceleration"] = "given"
        case _:
            document["target"]["acceleration"] = "none"
            document["damping"]["roll_rate_feedback_s"] = 0.0
    result = proof.check(subject(type(quadratic_settings()).model_validate(document), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.long
@pytest.mark.parametrize("harm", UNPROVEN)
def test_a_fault_raises_an_alarm(harm: str, tmp_path: Path) -> None:
    """Each is what a slip of the hand would make, and none goes through."""
    require("frama-c", "frama-c-base")
    result = proof.check(subject(quadratic_settings(), tmp_path, UNPROVEN[harm]))
    assert result.outcome is CheckOutcome.FAILED
    assert result.figures["alarms"], result.evidence


@pytest.mark.parametrize(
    "fault",
    [pytest.param(name, marks=[] if name == "another bit" else [pytest.mark.long]) for name in FAULTS],
)
def test_a_check_finds_a_fault(fault: str, tmp_path: Path) -> None:
    """The check that is there for it fails."""
    require("clang", "clang")
    require("cppcheck", "cppcheck")
    check, harm = FAULTS[fault]
    result = check(subject(quadratic_settings(), tmp_path, harm))
    assert result.outcome is CheckOutcome.FAILED, result.evidence
