"""A controller with a guard: every check passes it, and a fault in the guard is found."""

from pathlib import Path

import pytest

from mambo_sil.verify import rules
from mambo_sil.verify.check import CheckOutcome
from tests.support import proven
from tests.support.height import height_case
from tests.support.subjects import Harm, few_played, played_fault, subject
from tests.support.tools import require

GUARDED = 5
"""The corner with a guard, limits, and a target whose acceleration is tracked."""
FAULTS = {
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
}


@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_random_calls_have_the_bits_of_the_reference(scalar: str, tmp_path: Path) -> None:
    """Commands, budgets, what the tracker believes, and which gains are in use."""
    settings = height_case(GUARDED, scalar)
    assert played_fault(subject(settings, tmp_path), "-O0", played=few_played(settings)) is None


@pytest.mark.first_is_quick
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_the_guard_is_found(fault: str, tmp_path: Path) -> None:
    """By other bits than those of the reference."""
    settings = height_case(GUARDED, "float32")
    found = played_fault(subject(settings, tmp_path, FAULTS[fault]), "-O0", played=few_played(settings))
    assert found is not None
    assert found.startswith("tape ")


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_no_rule_is_broken(scalar: str, tmp_path: Path) -> None:
    """MISRA C, but for the deviations that the manual lists."""
    require("cppcheck", "cppcheck")
    result = rules.check(subject(height_case(GUARDED, scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.long
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_it_is_proven(scalar: str, tmp_path: Path) -> None:
    """No run-time error, no command beyond its limits, and budgets from 0 to what they hold."""
    require("frama-c", "frama-c-base")
    result = proven.check(subject(height_case(GUARDED, scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence
