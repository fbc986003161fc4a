"""A controller with a quadratic cost: every check passes it, and fails it with a fault in its C."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.verify import bits, dialects, fuzzing, rules, sanitizers
from mambo_sil.verify.cases import cases
from mambo_sil.verify.check import CheckOutcome, Result, Subject
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
from tests.support.quadratic import quadratic_settings
from tests.support.subjects import Harm, subject
from tests.support.tools import require

CONTROLLER, DRIVER = "nmpc.c", "proof/nmpc_proof.c"
FEW_RUNS = 20_000

UNPROVEN = {
    "NaN passes a range check": Fault(
        "refuse_nan",
        NAN_PASSES,
        Alarm(CONTROLLER, "self->command_rad[0] = roll_rad;", "mem_access"),
    ),
    "the heading goes unchecked": Fault(
        "refuse_nan",
        UNCHECKED_HEADING,
        Alarm(DRIVER, "step_refuses_nan", "user assertion"),
    ),
    "a refused state is used": Fault(
        "refuse_nan",
        Harm(CONTROLLER, r"            good_state = NULL;\n", ""),
        Alarm(CONTROLLER, "attitude_measure(", "precondition of attitude_measure"),
    ),
    "a refused target is used": Fault(
        "refuse_nan",
        Harm(CONTROLLER, r"(NMPC_BAD_TARGET;\n)            good_target = NULL;\n", r"\1"),
        Alarm(CONTROLLER, "limits_are_free(", "precondition of limits_are_free"),
    ),
    "a null pointer is followed": Fault(
        "refuse_nan",
        NULL_FOLLOWED,
        Alarm(CONTROLLER, "within(position_m[0]", "mem_access"),
    ),
    "infinity passes a range check": Fault(
        "take_numbers",
        INFINITY_PASSES,
        Alarm(CONTROLLER, "sine_cosine(", "precondition of sine_cosine"),
    ),
    "the command leaves the tilt limit": Fault(
        "take_numbers",
        Harm(CONTROLLER, r"clamp\((attitude_roll\([^;]*feedback_rad\[0\]), self->bounds\.tilt_rad\)", r"\1"),
        Alarm(DRIVER, "roll_is_within_the_limit", "user assertion"),
    ),
    "a clamp that does not limit": Fault(
        "take_numbers", UNLIMITED_CLAMP, Alarm(DRIVER, "roll_is_within_the_limit", "user assertion")
    ),
    "a set command is not clamped": Fault(
        "take_numbers",
        Harm(
            CONTROLLER,
            r"    pitch_rad = clamp\(command->pitch_rad, self->bounds\.tilt_rad\)",
            "    pitch_rad = command->pitch_rad",
        ),
        Alarm(DRIVER, "pitch_is_within_the_limit", "user assertion"),
    ),
    "the model has no limit": Fault(
        "take_numbers",
        Harm(CONTROLLER, r"return clamp\(sum, NMPC_ATTITUDE_LIMIT_M_STEP2\)", "return sum"),
        Alarm(CONTROLLER, "(first * cosine)", "is_nan"),
    ),
    "a row is read past its end": Fault(
        "take_numbers",
        Harm(CONTROLLER, r"k < NMPC_STATES", "k <= NMPC_STATES"),
        Alarm(CONTROLLER, "row[k] * state[k]", "mem_access"),
    ),
    "the model starts uninitialised": Fault(
        "take_numbers",
        Harm(CONTROLLER, r"    attitude->cosine = NMPC_ONE;\n", ""),
        Alarm(CONTROLLER, "* attitude->cosine)", "initialization"),
    ),
    "a bad input leaves the command unset": Fault(
        "take_numbers",
        UNSET_COMMAND,
        Alarm(DRIVER, "roll_is_within_the_limit", "user assertion"),
    ),
}
AT_ONCE = (
    ("the command leaves the tilt limit", "a set command is not clamped"),
    ("a row is read past its end", "the model starts uninitialised"),
    ("the model has no limit", "a bad input leaves the command unset"),
)
"""Faults that one proof shows at once; each of the others has a proof of its own."""


class Options(NamedTuple):
    """What changes the C of a quadratic cost; without a limit of speed there is none at all."""

    scalar: str
    ramp_s: float
    attitude: str
    acceleration: str
    speed_m_s: float


OTHERS = [
    Options("float32", 0.0, "measured", "given", 2.0),
    Options("float64", 0.0, "predicted", "none", 5.0),
    Options("float64", 0.0, "measured", "tracked", 0.0),
    Options("float64", 0.4, "measured", "none", 0.0),
    Options("float32", 0.4, "predicted", "given", 0.0),
]
WITH_LIMITS = {
    "a refused target is used",
    "the command leaves the tilt limit",
    "a set command is not clamped",
}
"""Faults of lines that a controller without limits lacks or has otherwise."""

FAULTS: dict[str, tuple[Callable[[Subject], Result], Harm]] = {
    "a warning": (dialects.check, Harm(CONTROLLER, r"    int axis;\n", r"    int unused;\n\g<0>")),
    "a rule": (
        rules.check,
        Harm(CONTROLLER, r"    return status;\n\}", "    goto end;\nend:\n    return status;\n}"),
    ),
    "another bit": (
        bits.check,
        Harm(CONTROLLER, r"\(NMPC_VELOCITY_BY_POSITION", "(NMPC_VELOCITY_BY_VELOCITY"),
    ),
    "another state": (bits.check, Harm(CONTROLLER, r"row\[k\] \* state\[k\]", "row[k] * state[k - 1]")),
    "a flag that stays": (bits.check, Harm(CONTROLLER, r"    self->has_target = 0U;\n", "")),
    "an outage a step too long": (
        bits.check,
        Harm(CONTROLLER, r"\(NMPC_OUTAGE_STEPS \+ 1U\)", "(NMPC_OUTAGE_STEPS + 2U)"),
    ),
    "a state past its end": (sanitizers.check, Harm(CONTROLLER, r"k < NMPC_STATES", "k <= NMPC_STATES")),
    "memory read before it is written": (
        sanitizers.check,
        Harm(CONTROLLER, r"    attitude->cosine = NMPC_ONE;\n", ""),
    ),
    "a refused state leaves a trace": (
        lambda its: fuzzing.check(its, runs=FEW_RUNS),
        Harm(CONTROLLER, r"            good_state = NULL;\n", ""),
    ),
    "a refused command is set": (
        lambda its: fuzzing.check(its, runs=FEW_RUNS),
        Harm(
            CONTROLLER,
            r"(?s)(nmpc_set_command\(.*?)    if \(!is_good_command\(command\)\) \{\n",
            r"\1    if (0) {\n",
        ),
    ),
}


def without_limits(settings: Settings) -> Settings:
    """Return `settings` without limits of speed and braking."""
    return with_option(with_option(settings, "limits.speed_m_s", 0.0), "limits.braking_m_s2", 0.0)


@pytest.mark.long
def test_the_cases_have_outcomes_of_every_status() -> None:
    """All statuses but that of weights, a command at its limit, and an outage longer than the estimate."""
    outcomes = np.concatenate(cases(without_limits(quadratic_settings()))[1])
    assert set(outcomes["status"]) == {int(status) for status in Status} - {
        Status.BAD_WEIGHT,
        Status.BAD_LIMITS,
    }
    assert set(outcomes["saturated"]) == {0, 1}
    assert set(outcomes["missed"]) == set(range(52))


@pytest.mark.long
def test_the_cases_have_limits_of_every_kind() -> None:
    """Limits that are set and refused, each limit acting, and commands after an outage."""
    outcomes = np.concatenate(cases(with_option(quadratic_settings(), "limits.speed_m_s", 2.0))[1])
    assert set(outcomes["status"]) == {int(status) for status in Status} - {Status.BAD_WEIGHT}
    assert set(outcomes["active"]) >= {0, 1, 2, 5, 6}
    assert set(outcomes["missed"]) >= set(range(52))


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("scalar", "check", "tool", "package"),
    [
        pytest.param("float32", dialects.check, "clang", "clang", id="float32-warnings"),
        pytest.param("float32", bits.check, "clang", "clang", id="float32-bits"),
        pytest.param(
            "fixed", sanitizers.check, "clang", "clang", id="fixed-sanitizers", marks=pytest.mark.long
        ),
        *(
            pytest.param("float64", check, tool, tool, id=f"float64-{name}", marks=pytest.mark.long)
            for name, check, tool in (
                ("warnings", dialects.check, "clang"),
                ("rules", rules.check, "cppcheck"),
                ("bits", bits.check, "clang"),
                ("sanitizers", sanitizers.check, "clang"),
                ("fuzzing", partial(fuzzing.check, runs=fuzzing.RUNS // 5), "clang"),
            )
        ),
    ],
)
def test_a_check_passes(
    scalar: str, check: Callable[[Subject], Result], tool: str, package: str, tmp_path: Path
) -> None:
    """Nothing is found; the other checks of float32, and the proofs, are in the tests of all presets."""
    require(tool, package)
    result = check(subject(quadratic_settings(scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.long
@pytest.mark.parametrize("chosen", OTHERS, ids=lambda chosen: " ".join(map(str, chosen)))
def test_other_settings_are_proven(chosen: Options, tmp_path: Path) -> None:
    """One or two moves, a measured attitude of old measurements, each acceleration, with and without limits.

    With the presets, any two of these options occur together.
    """
    require("frama-c", "frama-c-base")
    document = quadratic_settings(chosen.scalar).model_dump()
    document["horizon"]["ramp_s"] = chosen.ramp_s
    document["model"]["attitude"] = chosen.attitude
    document["observer"]["age_s"] = 0.03 if chosen.attitude == "measured" else 0.0
    document["target"]["acceleration"] = chosen.acceleration
    if chosen.acceleration != "tracked":
        document["damping"]["roll_rate_feedback_s"] = 0.0
    document["limits"]["speed_m_s"] = chosen.speed_m_s
    settings = Settings.model_validate(document)
    result = proven.check(subject(settings if chosen.speed_m_s else without_limits(settings), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.first_is_quick
@pytest.mark.parametrize("names", runs(UNPROVEN, AT_ONCE), ids=", ".join)
def test_a_fault_raises_an_alarm(names: tuple[str, ...], tmp_path: Path) -> None:
    """Each is what a slip of the hand would make, and none goes through.

    A fault that needs no limits is made without them, which Frama-C interprets in a third of the time.
    """
    require("frama-c", "frama-c-base")
    settings, faults = quadratic_settings(), {name: UNPROVEN[name] for name in names}
    if WITH_LIMITS.isdisjoint(names):
        settings = without_limits(settings)
    assert proven.unnoticed(harmed(settings, tmp_path, faults), faults) == []


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize("fault", FAULTS)
def test_a_check_finds_a_fault(fault: str, tmp_path: Path) -> None:
    """The check that is there for it fails."""
    require("clang", "clang")
    require("cppcheck", "cppcheck")
    check, harm = FAULTS[fault]
    result = check(subject(quadratic_settings(), tmp_path, harm))
    assert result.outcome is CheckOutcome.FAILED, result.evidence
