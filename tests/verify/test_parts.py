"""Controllers with height, guard, thrust vector, learnt gain: checks pass them, not their faults."""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.verify import fuzzing, rules, sanitizers
from mambo_sil.verify.calls import NULL_SELF, ApiFunction, Outcomes, Tape, answers, calls
from mambo_sil.verify.cases import random_tapes
from mambo_sil.verify.check import CheckOutcome
from mambo_sil.verify.step_inputs import StepRows
from mambo_sil.verify.target_cases import observed_motion
from tests.support import proven
from tests.support.alarms import Alarm, Fault, harmed
from tests.support.height import height_case
from tests.support.quadratic import quadratic_case
from tests.support.subjects import Harm, played_fault, subject
from tests.support.tools import require

CORNERS = {
    name: height_case(index, "float32")
    for name, index in (("height", 1), ("thrust vector", 6), ("guard", 5), ("observed", 8))
}
"""Of `tests.support.height`; the samples leave out the guard, which the thrust vector has too."""
LEARNING = {
    name: with_option(settings, "observer.tilt_gain", "learnt")
    for name, settings in (
        ("learnt gain", CORNERS["guard"]),
        ("learnt gain, thrust vector", CORNERS["thrust vector"]),
        ("learnt gain, level", quadratic_case(0, "float32")),
    )
}
"""With a height, limits and guard, with small angles and with the thrust vector; and without a height."""
CORNERS |= {"learnt gain": LEARNING["learnt gain"]}
FAULTS = {
    "height": {
        "the floor is not felt": Harm("nmpc.c", r"\(state->on_ground != 0\)", "(state->on_ground > 1)"),
        "least and most thrust are one": Harm(
            "nmpc.c", r"NMPC_THRUST_MAX_M_STEP2 \* share", "NMPC_THRUST_MIN_M_STEP2 * share"
        ),
        "the ceiling is not minded": Harm(
            "nmpc.c", r"confine\(bounds->ceiling_m", "confine(height->height_m + bounds->up_m"
        ),
        "the gain is not learnt": Harm("nmpc.c", r"height->gain = confine\([^;]*;", ""),
        "the tilt does not count": Harm(
            "nmpc.c", r"(?s)NMPC_SHARED nmpc_real_t height_tilt.*?\{\n", r"\g<0>    roll_rad = pitch_rad;\n"
        ),
        "a refused thrust is set": Harm(
            "nmpc.c", r"(?s)(nmpc_report_thrust\(.*?)        return NMPC_BAD_THRUST;\n", r"\1"
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
        "a word on the position is not heard": Harm("nmpc.c", r"\(self->is_coarse != 0U\) \? 1 : 0", "0"),
    },
    "observed": {
        "a wild set-point is believed": Harm("nmpc.c", r"if \(within\(innovation, trust\) == 0\)", "if (0)"),
        "a jump is never believed": Harm("nmpc.c", r"judged = -1;", "judged = 0;"),
        "noise lengthens no memory": Harm("nmpc.c", r"NMPC_MEMORY_PER_NOISE \* motion->noise", "0"),
        "a memory does not fall": Harm("nmpc.c", r"\(shorter > wanted\) \? shorter : wanted", "longer"),
        "what is ahead is not read": Harm(
            "nmpc.c", r"motion_change\(point->ahead_m_s2, limits\) - motion->acceleration", "0"
        ),
        "a turn turns no acceleration": Harm("nmpc.c", r"    turn_components\(&x->acceleration[^;]*;\n", ""),
        "the next velocity after a turn is fitted": Harm(
            "nmpc.c", r"has_turned = motion->missed > \(nmpc_real_t\)1", "has_turned = 0"
        ),
        "another kind begins with the noise of the last": Harm(
            "nmpc.c", r"motion->noise = \(known > 0\)[^;]*;", ""
        ),
    },
    "thrust vector": {
        "pitch counts without the roll": Harm("nmpc.c", r"\(sine\[1\] \* cosine\[0\]\)", "sine[1]"),
        "roll knows no pitch": Harm("nmpc.c", r"arc_tangent\(right \* cosine\)", "arc_tangent(right)"),
        "a steep slope has no arc of its own": Harm(
            "nmpc.c", r"angle_rad = NMPC_QUARTER_TURN - angle_rad;", "angle_rad = angle_rad + angle_rad;"
        ),
        "the share has another least": Harm("nmpc.c", r"(#define NMPC_LEAST_SHARE) [^ ]*", r"\1 0.9f"),
        "the thrust leaves all": Harm("nmpc.c", r"= \(step->left_m_step2 < most_m_step2\) \?", "= (0) ?"),
        "a long move keeps its length": Harm(
            "nmpc.c", r"smaller\(step->left_m_step2 \* inverse_root\(square\), NMPC_ONE\)", "NMPC_ONE"
        ),
        "no word of the thrust": Harm("nmpc.c", r"step->by_thrust = NMPC_LIMIT_THRUST;", ""),
        "a bounded command is told as it was": Harm(
            "nmpc.c",
            r"replace_command\(self, asked_rad",
            "replace_command(self, self->command_rad",
        ),
    },
    "learnt gain": {
        "the quick mean is slow": Harm(
            "nmpc.c", r"tilt_gain_mean\(quick_row, learnt->quick", "tilt_gain_mean(slow_row, learnt->quick"
        ),
        "a mean forgets the other way": Harm(
            "nmpc.c", r"\(row\[0\] \* mean\) \+ \(row\[1\] \* value\)", "(row[1] * mean) + (row[0] * value)"
        ),
        "an error has no sign": Harm(
            "nmpc.c", r"\? -error_m_step2 : error_m_step2", "? error_m_step2 : error_m_step2"
        ),
        "an error has no limit": Harm(
            "nmpc.c",
            r"moved_m_step2, NMPC_TILT_GAIN_MOST_M_STEP2\)",
            "moved_m_step2, NMPC_ATTITUDE_LIMIT_M_STEP2)",
        ),
        "hover is learnt from": Harm("nmpc.c", r"if \(is_moved && ", "if ("),
        "a command at the limit is learnt from": Harm("nmpc.c", r" - NMPC_TILT_GAIN_FREE\)", ")"),
        "the gain has no limits": Harm("nmpc.c", r"(#define NMPC_TILT_GAIN_MIN) [^ \n]*", r"\1 0.1f"),
        "the means start at rest": Harm(
            "nmpc.c",
            r"learnt->slow_m_step2\[angle\] = attitude->tilt_m_step2\[angle\];",
            "learnt->slow_m_step2[angle] = (nmpc_real_t)0;",
        ),
        "the floor is learnt from": Harm("nmpc.c", r"        restarts = \(restarts != 0\)[^;]*;\n", ""),
        "a reset keeps the gain": Harm("nmpc.c", r"    tilt_gain_clear\(&self->tilt_gain\);\n", ""),
        "a bounded command is the model's": Harm(
            "nmpc.c",
            r"tilt_gain_meant\(&self->tilt_gain, 0, after_rad\[0\] - before_rad\[0\]\)",
            "after_rad[0] - before_rad[0]",
        ),
        "the largest move is that of the settings": Harm(
            "nmpc.c",
            r"tilt_gain_share\(&self->tilt_gain, axis\)",
            "((axis == NMPC_RIGHT) ? NMPC_TILT_GAIN_ONE : tilt_gain_share(&self->tilt_gain, axis))",
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


def in_scalar(settings: Settings, scalar: str) -> Settings:
    """Return `settings` with another scalar type."""
    return with_option(settings, "code.scalar", scalar)


def unmoved(settings: Settings) -> Tape:
    """Return a tape of a drone that never tilts towards a target that swings: its gain falls to its limit."""
    rows, swing = StepRows(method_of(settings)), 0.03 * np.arange(200)
    inputs = rows.hovering(len(swing))
    inputs[:, rows.target][:, :2] = 0.1 * np.column_stack([np.sin(swing), np.cos(swing)])
    return calls(settings, ApiFunction.STEP, inputs)


@lru_cache(maxsize=1)
def played(settings: Settings) -> tuple[Sequence[Tape], Sequence[Outcomes]]:
    """Return few random tapes, more for a learnt gain or an observed target, and the answers."""
    nothing = np.zeros((1, 1))
    tapes = [*random_tapes(settings, 60), calls(settings, ApiFunction.STEP, nothing, NULL_SELF)]
    expected = answers(settings, tapes)
    more = {"learnt gain": lambda its: [unmoved(its)], "observed": observed_motion}
    for name, made in more.items():
        if settings != CORNERS[name]:
            continue
        long = [*made(settings)]
        tapes, expected = tapes + long, expected + answers(settings, long)
    return tapes, expected


def test_the_cases_have_outcomes_of_every_status() -> None:
    """Thrusts that are set and refused, contact with the floor, and the limit of the height acting."""
    settings = CORNERS["height"]
    tapes = random_tapes(settings, 200)
    outcomes = np.concatenate(answers(settings, tapes))
    assert set(outcomes["status"]) == {int(status) for status in Status} - {
        Status.BAD_WEIGHT,
        Status.NULL_POINTER,
    }
    assert {16, 17} <= set(outcomes["active_limits"])
    assert len(np.unique(outcomes["thrust_m_s2"])) > 200


@pytest.mark.sampled(2)
@pytest.mark.parametrize(
    ("corner", "scalar"),
    [
        pytest.param(corner, scalar, marks=[pytest.mark.long] * (scalar == "fixed" or corner in LEARNING))
        for corner in CORNERS | LEARNING
        for scalar in ("float32", "fixed")
    ],
)
def test_random_calls_have_the_bits_of_the_reference(corner: str, scalar: str, tmp_path: Path) -> None:
    """Commands, what limits act, all that is stored, and in fixed point the interface in floats."""
    settings = in_scalar((CORNERS | LEARNING)[corner], scalar)
    assert played_fault(subject(settings, tmp_path), "-O0", played=played(settings)) is None


@pytest.mark.sampled(4)
@pytest.mark.parametrize(
    ("corner", "fault"),
    [
        pytest.param(corner, fault, marks=[pytest.mark.long] * (number > 0))
        for corner, faults in FAULTS.items()
        for number, fault in enumerate(faults)
    ],
)
def test_a_fault_is_found(corner: str, fault: str, tmp_path: Path) -> None:
    """By other bits than those of the reference."""
    its = subject(CORNERS[corner], tmp_path, FAULTS[corner][fault])
    found = played_fault(its, "-O0", played=played(CORNERS[corner]))
    assert found is not None
    assert found.startswith("tape ")


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize("scalar", ["fixed", "float32"])
def test_every_case_has_the_bits_of_the_reference(scalar: str, tmp_path: Path) -> None:
    """Under the sanitizers of addresses, memory and undefined behaviour."""
    require("clang", "clang")
    result = sanitizers.check(subject(in_scalar(CORNERS["height"], scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.long
@pytest.mark.parametrize(
    ("settings", "runs"),
    [
        (CORNERS["height"], 20_000),
        (CORNERS["thrust vector"], 5_000),
        (LEARNING["learnt gain, thrust vector"], 1_000),
    ],
    ids=["height", "thrust vector", "learnt gain"],
)
def test_no_call_breaks_a_promise(settings: Settings, runs: int, tmp_path: Path) -> None:
    """With contact with the floor and limits of the height, attitudes up to upside down."""
    require("clang", "clang")
    result = fuzzing.check(subject(settings, tmp_path), runs=runs)
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.sampled(4)
@pytest.mark.long
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
@pytest.mark.parametrize("corner", CORNERS)
def test_no_rule_is_broken(corner: str, scalar: str, tmp_path: Path) -> None:
    """MISRA C, but for the deviations that the manual lists."""
    require("cppcheck", "cppcheck")
    result = rules.check(subject(in_scalar(CORNERS[corner], scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.long
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
@pytest.mark.parametrize("corner", CORNERS)
def test_it_is_proven(corner: str, scalar: str, tmp_path: Path) -> None:
    """No run-time error, all numbers finite, commands within limits, budgets from 0 to what they hold."""
    require("frama-c", "frama-c-base")
    result = proven.check(subject(in_scalar(CORNERS[corner], scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.long
@pytest.mark.parametrize("name", UNPROVEN)
def test_a_fault_raises_an_alarm(name: str, tmp_path: Path) -> None:
    """The proof says of the thrust what the header says."""
    require("frama-c", "frama-c-base")
    faults = {name: UNPROVEN[name]}
    its = harmed(CORNERS["height"], tmp_path, faults)
    assert proven.unnoticed(its, faults) == []
