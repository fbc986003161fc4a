"""Controllers of the height, with guard, thrust vector, preview: they pass checks, their faults do not."""

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

CORNERS = {"preview": 9, "height": 1, "thrust vector": 6, "guard": 5}
"""Of `tests.support.height`; the samples leave out the guard, which the thrust vector has too."""
FAULTS = {
    "height": {
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
    },
    "guard": {
        "a budget is never spent": Harm("nmpc.c", r"\*budget = \(rest[^;]*;", "*budget = allowed;"),
        "a budget gains nothing": Harm("nmpc.c", r"\*budget \+ growth", "*budget"),
        "the model is not told": Harm("nmpc.c", r"if \(is_bounded != 0\)", "if (is_bounded > 1)"),
        "the thrust of a mixer counts": Harm(
            "nmpc.c",
            r"height->commanded_m_s2, height->thrust_m_s2\)",
            "height->thrust_m_s2, height->thrust_m_s2)",
        ),
        "a reset fills no budget": Harm("nmpc.c", r"    self->budget_rad\[1\] = [^;]*;\n", ""),
        "a word on the position is not heard": Harm("nmpc.c", r"which = 1;", "which = 0;"),
        "what reverses is believed": Harm(
            "nmpc.c", r"\(product < \(nmpc_real_t\)0\) \? -product", "(0) ? -product"
        ),
        "what is not believed is not forgotten": Harm(
            "nmpc.c", r"square = doubt \* doubt", "square = doubt - doubt"
        ),
    },
    "thrust vector": {
        "pitch counts without the roll": Harm(
            "nmpc.c", r"forward = sine\[1\] \* cosine\[0\];", "forward = sine[1];"
        ),
        "roll knows no pitch": Harm("nmpc.c", r"arc_tangent\(right \* cosine\)", "arc_tangent(right)"),
        "a steep slope has no arc of its own": Harm(
            "nmpc.c", r"angle_rad = NMPC_QUARTER_TURN - angle_rad;", "angle_rad = angle_rad + angle_rad;"
        ),
        "the share has another least": Harm("nmpc.c", r"(#define NMPC_LEAST_SHARE) [^ ]*", r"\1 0.9f"),
        "the thrust leaves all": Harm(
            "nmpc.c", r"return \(left_m_step2 < limit_m_step2\) \?", "return (0) ?"
        ),
        "no word of the thrust": Harm("nmpc.c", r"by_thrust = NMPC_LIMIT_THRUST;", ""),
        "a bounded command is told as it was": Harm(
            "nmpc.c",
            r"attitude_change_command\(attitude, asked_rad",
            "attitude_change_command(attitude, self->command_rad",
        ),
    },
    "preview": {
        "the last acceleration is not checked": Harm(
            "nmpc.c", r"\n *&& within\(target->preview_m_s2\[5\]\[2\], [^)]*\)", ""
        ),
        "now is not turned": Harm(
            "nmpc.c",
            r"target->acceleration_m_s2\[0\], target->acceleration_m_s2\[1\], &state",
            "target->acceleration_m_s2[1], target->acceleration_m_s2[0], &state",
        ),
        "what comes is of one time": Harm(
            "nmpc.c", r"target->preview_m_s2\[time\]\[0\], target", "target->preview_m_s2[0][0], target"
        ),
        "the height knows nothing of what comes": Harm(
            "nmpc.c", r"values\[7 \+ time\] = target->preview_m_s2\[time\]\[2\];", ""
        ),
        "without a target the height follows the last one": Harm(
            "nmpc.c", r"values\[7 \+ time\] = \(nmpc_real_t\)0;", "values[7 + time] = NMPC_GRAVITY_M_STEP2;"
        ),
        "a limit does not bend what comes": Harm(
            "nmpc.c",
            r"limited->preview_m_s2\[time\]\[axis\] = limited[^;]*;",
            "limited->preview_m_s2[time][axis] = (nmpc_real_t)0;",
        ),
    },
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
    settings = height_case(CORNERS["height"], "float32")
    tapes = random_tapes(settings, 200)
    outcomes = np.concatenate(answers(settings, tapes))
    assert set(outcomes["status"]) == {int(status) for status in Status} - {
        Status.BAD_WEIGHT,
        Status.NULL_POINTER,
    }
    assert {16, 17} <= set(outcomes["active"])
    assert len(np.unique(outcomes["thrust_m_s2"])) > 200


@pytest.mark.parametrize(
    ("corner", "scalar"),
    [
        pytest.param(corner, scalar, marks=pytest.mark.long if scalar == "fixed" else ())
        for corner in CORNERS
        for scalar in ("float32", "fixed")
    ],
)
def test_random_calls_have_the_bits_of_the_reference(corner: str, scalar: str, tmp_path: Path) -> None:
    """Commands, what limits act, all that is stored, and in fixed point the interface in floats."""
    settings = height_case(CORNERS[corner], scalar)
    assert played_fault(subject(settings, tmp_path), "-O0", played=played(settings)) is None


@pytest.mark.parametrize(
    ("corner", "fault"),
    [
        pytest.param(corner, fault, marks=pytest.mark.long if number else ())
        for corner, faults in FAULTS.items()
        for number, fault in enumerate(faults)
    ],
)
def test_a_fault_is_found(corner: str, fault: str, tmp_path: Path) -> None:
    """By other bits than those of the reference."""
    settings = height_case(CORNERS[corner], "float32")
    its = subject(settings, tmp_path, FAULTS[corner][fault])
    found = played_fault(its, "-O0", played=played(settings))
    assert found is not None
    assert found.startswith("tape ")


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize("scalar", ["fixed", "float32"])
def test_every_case_has_the_bits_of_the_reference(scalar: str, tmp_path: Path) -> None:
    """Under the sanitizers of addresses, memory and undefined behaviour."""
    require("clang", "clang")
    result = sanitizers.check(subject(height_case(CORNERS["height"], scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.long
@pytest.mark.parametrize(
    ("corner", "runs"), [("height", 20_000), ("thrust vector", 5_000), ("preview", 5_000)]
)
def test_no_call_breaks_a_promise(corner: str, runs: int, tmp_path: Path) -> None:
    """With contact with the floor and limits of the height, attitudes up to upside down, any preview."""
    require("clang", "clang")
    result = fuzzing.check(subject(height_case(CORNERS[corner], "float32"), tmp_path), runs=runs)
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.sampled(4)
@pytest.mark.long
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
@pytest.mark.parametrize("corner", CORNERS)
def test_no_rule_is_broken(corner: str, scalar: str, tmp_path: Path) -> None:
    """MISRA C, but for the deviations that the manual lists."""
    require("cppcheck", "cppcheck")
    result = rules.check(subject(height_case(CORNERS[corner], scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.long
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
@pytest.mark.parametrize("corner", CORNERS)
def test_it_is_proven(corner: str, scalar: str, tmp_path: Path) -> None:
    """No run-time error, all numbers finite, commands within limits, budgets from 0 to what they hold."""
    require("frama-c", "frama-c-base")
    result = proven.check(subject(height_case(CORNERS[corner], scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.long
@pytest.mark.parametrize("name", UNPROVEN)
def test_a_fault_raises_an_alarm(name: str, tmp_path: Path) -> None:
    """The proof says of the thrust what the header says."""
    require("frama-c", "frama-c-base")
    faults = {name: UNPROVEN[name]}
    its = harmed(height_case(CORNERS["height"], "float32"), tmp_path, faults)
    assert proven.unnoticed(its, faults) == []
