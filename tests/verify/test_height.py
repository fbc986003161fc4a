"""A controller of the height: every check passes it, and a fault in its third axis is found."""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings.model import Settings
from mambo_sil.verify import fuzzing, rules, sanitizers
from mambo_sil.verify.calls import NULL_SELF, ApiFunction, Outcomes, Tape, answers, calls
from mambo_sil.verify.cases import random_tapes
from mambo_sil.verify.check import CheckOutcome
from tests.support import proven
from tests.support.alarms import Alarm, Fault, harmed
from tests.support.height import height_case
from tests.support.subjects import Harm, played_fault, subject
from tests.support.tools import require

LIMITED = 1
"""The corner with floor, ceiling, speed and a target whose acceleration is tracked."""
FAULTS = {
    "the floor is not felt": Harm("nmpc.c", r"\(state->grounded != 0\)", "(state->grounded > 1)"),
    "least and most thrust are one": Harm(
        "nmpc.c", r"NMPC_THRUST_MAX_M_STEP2 \* share", "NMPC_THRUST_MIN_M_STEP2 * share"
    ),
    "the ceiling is not minded": Harm(
        "nmpc.c", r"confine\(bounds->ceiling_m", "confine(height_m + bounds->up_m"
    ),
    "the gain is not learnt": Harm("nmpc.c", r"height->gain = confine\([^;]*;", ""),
    "the tilt does not count": Harm(
        "nmpc.c", r"(?s)NMPC_SHARED nmpc_real_t height_tilt.*?\{\n", r"\g<0>    roll_rad = pitch_rad;\n"
    ),
    "a refused thrust is set": Harm(
        "nmpc.c", r"(?s)(nmpc_set_thrust\(.*?)        return NMPC_BAD_THRUST;\n", r"\1"
    ),
    "level without a controller is no thrust": Harm(
        "nmpc.c", r"command->thrust_m_s2 = NMPC_HOVER_M_S2;", "command->thrust_m_s2 = (nmpc_real_t)0;"
    ),
}
UNPROVEN = {
    "the thrust leaves its limits": Fault(
        "take_numbers",
        Harm(
            "nmpc.c",
            r"height->thrust_m_s2 = confine\((.*), NMPC_THRUST_MIN_M_S2, NMPC_THRUST_MAX_M_S2\);",
            r"height->thrust_m_s2 = \1;",
        ),
        Alarm("proof/nmpc_proof.c", "thrust_is_within_the_limits", "user assertion"),
    ),
}


@lru_cache(maxsize=1)
def played(settings: Settings) -> tuple[Sequence[Tape], Sequence[Outcomes]]:
    """Return few random tapes, and what the reference answers."""
    nothing = np.zeros((1, 1))
    tapes = [*random_tapes(settings, 60), calls(settings, ApiFunction.STEP, nothing, NULL_SELF)]
    return tapes, answers(settings, tapes)


def test_the_cases_have_outcomes_of_every_status() -> None:
    """Thrusts that are set and refused, contact with the floor, and the limit of the height acting."""
    settings = height_case(LIMITED, "float32")
    tapes = random_tapes(settings, 200)
    outcomes = np.concatenate(answers(settings, tapes))
    assert set(outcomes["status"]) == {int(status) for status in Status} - {
        Status.BAD_WEIGHT,
        Status.NULL_POINTER,
    }
    assert {16, 17} <= set(outcomes["active"])
    assert len(np.unique(outcomes["thrust_m_s2"])) > 200


@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_random_calls_have_the_bits_of_the_reference(scalar: str, tmp_path: Path) -> None:
    """The thrust, all that is stored, and in fixed point the interface in floats."""
    settings = height_case(LIMITED, scalar)
    assert played_fault(subject(settings, tmp_path), "-O0", played=played(settings)) is None


@pytest.mark.first_is_quick
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_the_third_axis_is_found(fault: str, tmp_path: Path) -> None:
    """By other bits than those of the reference."""
    settings = height_case(LIMITED, "float32")
    found = played_fault(subject(settings, tmp_path, FAULTS[fault]), "-O0", played=played(settings))
    assert found is not None
    assert found.startswith("tape ")


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize("scalar", ["fixed", "float32"])
def test_every_case_has_the_bits_of_the_reference(scalar: str, tmp_path: Path) -> None:
    """Under the sanitizers of addresses, memory and undefined behaviour."""
    require("clang", "clang")
    result = sanitizers.check(subject(height_case(LIMITED, scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.long
def test_no_call_breaks_a_promise(tmp_path: Path) -> None:
    """With a reported thrust, contact with the floor and limits of the height."""
    require("clang", "clang")
    result = fuzzing.check(subject(height_case(LIMITED, "float32"), tmp_path), runs=20_000)
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_no_rule_is_broken(scalar: str, tmp_path: Path) -> None:
    """MISRA C, but for the deviations that the manual lists."""
    require("cppcheck", "cppcheck")
    result = rules.check(subject(height_case(LIMITED, scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.long
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_it_is_proven(scalar: str, tmp_path: Path) -> None:
    """No run-time error, and no command beyond the limits of tilt and thrust."""
    require("frama-c", "frama-c-base")
    result = proven.check(subject(height_case(LIMITED, scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.long
@pytest.mark.parametrize("name", UNPROVEN)
def test_a_fault_raises_an_alarm(name: str, tmp_path: Path) -> None:
    """The proof says of the thrust what the header says."""
    require("frama-c", "frama-c-base")
    faults = {name: UNPROVEN[name]}
    its = harmed(height_case(LIMITED, "float32"), tmp_path, faults)
    assert proven.unnoticed(its, faults) == []
