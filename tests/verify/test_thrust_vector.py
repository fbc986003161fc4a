"""A controller with the thrust vector: every check passes it, and a fault in it is found."""

from pathlib import Path

import pytest

from mambo_sil.verify import fuzzing, rules
from mambo_sil.verify.check import CheckOutcome
from tests.support import proven
from tests.support.height import height_case
from tests.support.subjects import Harm, few_played, played_fault, subject
from tests.support.tools import require

VECTOR = 6
"""The corner with the thrust vector, trim, gains, limits, guard, rate feedback and a tracked target."""
FAULTS = {
    "pitch counts without the roll": Harm(
        "nmpc.c", r"forward = sine\[1\] \* cosine\[0\];", "forward = sine[1];"
    ),
    "roll knows no pitch": Harm("nmpc.c", r"arc_tangent\(right \* cosine\)", "arc_tangent(right)"),
    "a steep slope has no arc of its own": Harm(
        "nmpc.c", r"angle_rad = NMPC_QUARTER_TURN - angle_rad;", "angle_rad = angle_rad + angle_rad;"
    ),
    "the share has another least": Harm("nmpc.c", r"(#define NMPC_LEAST_SHARE) [^ ]*", r"\1 0.9f"),
    "the thrust leaves all": Harm("nmpc.c", r"return \(left_m_step2 < limit_m_step2\) \?", "return (0) ?"),
    "no word of the thrust": Harm("nmpc.c", r"by_thrust = NMPC_LIMIT_THRUST;", ""),
    "a bounded command is told as it was": Harm(
        "nmpc.c",
        r"attitude_change_command\(attitude, asked_rad",
        "attitude_change_command(attitude, self->command_rad",
    ),
}


@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_random_calls_have_the_bits_of_the_reference(scalar: str, tmp_path: Path) -> None:
    """Commands, what limits act, and all that is stored."""
    settings = height_case(VECTOR, scalar)
    assert played_fault(subject(settings, tmp_path), "-O0", played=few_played(settings)) is None


@pytest.mark.first_is_quick
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_the_thrust_vector_is_found(fault: str, tmp_path: Path) -> None:
    """By other bits than those of the reference."""
    settings = height_case(VECTOR, "float32")
    found = played_fault(subject(settings, tmp_path, FAULTS[fault]), "-O0", played=few_played(settings))
    assert found is not None
    assert found.startswith("tape ")


@pytest.mark.long
def test_no_call_breaks_a_promise(tmp_path: Path) -> None:
    """With attitudes up to upside down."""
    require("clang", "clang")
    result = fuzzing.check(subject(height_case(VECTOR, "float32"), tmp_path), runs=5_000)
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.sampled(4)
@pytest.mark.long
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_no_rule_is_broken(scalar: str, tmp_path: Path) -> None:
    """MISRA C, but for the deviations that the manual lists."""
    require("cppcheck", "cppcheck")
    result = rules.check(subject(height_case(VECTOR, scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.long
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_it_is_proven(scalar: str, tmp_path: Path) -> None:
    """No run-time error, and no command beyond the limits of tilt and thrust."""
    require("frama-c", "frama-c-base")
    result = proven.check(subject(height_case(VECTOR, scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence
