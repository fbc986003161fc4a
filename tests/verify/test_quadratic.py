"""A controller with a quadratic cost: no alarm whatever the settings, an alarm for every fault."""

from pathlib import Path
from typing import NamedTuple

import pytest

from mambo_codegen.settings.model import Settings
from mambo_sil.verify.check import CheckOutcome
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

UNPROVEN = {
    "NaN passes a range check": Fault(
        "refuse_nan",
        NAN_PASSES,
        Alarm(DRIVER, "step_refuses_nan", "user assertion"),
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
        Harm(CONTROLLER, r"    step->command_rad\[0\] = limited_angle\([^;]*;\n", ""),
        Alarm(DRIVER, "roll_is_within_the_limit", "user assertion"),
    ),
    "a clamp that does not limit": Fault(
        "take_numbers", UNLIMITED_CLAMP, Alarm(DRIVER, "roll_is_within_the_limit", "user assertion")
    ),
    "a set command is not clamped": Fault(
        "take_numbers",
        Harm(
            CONTROLLER,
            r"    given_rad\[1\] = clamp\(command->pitch_rad, self->bounds\.tilt_rad\)",
            "    given_rad[1] = command->pitch_rad",
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
    """What changes the C of a quadratic cost."""

    scalar: str
    ramp_s: float
    attitude: str


OTHERS = [
    Options("float32", 0.0, "measured"),
    Options("float64", 0.0, "predicted"),
    Options("float64", 0.4, "measured"),
    Options("float32", 0.4, "predicted"),
]


@pytest.mark.long
@pytest.mark.parametrize("chosen", OTHERS, ids=lambda chosen: " ".join(map(str, chosen)))
def test_other_settings_are_proven(chosen: Options, tmp_path: Path) -> None:
    """One or two moves, a measured attitude of old measurements.

    With the presets, any two of these options occur together.
    """
    require("frama-c", "frama-c-base")
    document = quadratic_settings(chosen.scalar).model_dump()
    document["horizon"]["ramp_s"] = chosen.ramp_s
    document["model"]["start_attitude"] = chosen.attitude
    document["observer"]["measurement_age_s"] = 0.03 if chosen.attitude == "measured" else 0.0
    document["damping"]["roll_rate_feedback_s"] = 0.0
    result = proven.check(subject(Settings.model_validate(document), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.first_is_quick
@pytest.mark.parametrize("names", runs(UNPROVEN, AT_ONCE), ids=", ".join)
def test_a_fault_raises_an_alarm(names: tuple[str, ...], tmp_path: Path) -> None:
    """Each is what a slip of the hand would make, and none goes through."""
    require("frama-c", "frama-c-base")
    faults = {name: UNPROVEN[name] for name in names}
    assert proven.unnoticed(harmed(quadratic_settings(), tmp_path, faults), faults) == []
