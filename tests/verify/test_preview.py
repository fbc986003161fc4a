"""A controller that is told what comes: every check passes it, and a fault in it is found."""

from pathlib import Path

import pytest

from mambo_sil.verify import fuzzing, rules
from mambo_sil.verify.check import CheckOutcome
from tests.support import proven
from tests.support.height import height_case
from tests.support.subjects import Harm, few_played, played_fault, subject
from tests.support.tools import require

PREVIEW = 9
"""The corner with a preview, the thrust vector, limits, a wall and a guard."""
FAULTS = {
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
}


@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_random_calls_have_the_bits_of_the_reference(scalar: str, tmp_path: Path) -> None:
    """Commands, and in fixed point the interface in floats."""
    settings = height_case(PREVIEW, scalar)
    assert played_fault(subject(settings, tmp_path), "-O0", played=few_played(settings)) is None


@pytest.mark.first_is_quick
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_what_comes_is_found(fault: str, tmp_path: Path) -> None:
    """By other bits than those of the reference."""
    settings = height_case(PREVIEW, "float32")
    found = played_fault(subject(settings, tmp_path, FAULTS[fault]), "-O0", played=few_played(settings))
    assert found is not None
    assert found.startswith("tape ")


@pytest.mark.long
def test_no_call_breaks_a_promise(tmp_path: Path) -> None:
    """A preview that is not finite or out of range is refused as an acceleration is."""
    require("clang", "clang")
    result = fuzzing.check(subject(height_case(PREVIEW, "float32"), tmp_path), runs=5_000)
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.sampled(4)
@pytest.mark.long
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_no_rule_is_broken(scalar: str, tmp_path: Path) -> None:
    """MISRA C, but for the deviations that the manual lists."""
    require("cppcheck", "cppcheck")
    result = rules.check(subject(height_case(PREVIEW, scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.long
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_it_is_proven(scalar: str, tmp_path: Path) -> None:
    """No run-time error, no number that is not finite, and no command beyond its limits, for any preview."""
    require("frama-c", "frama-c-base")
    result = proven.check(subject(height_case(PREVIEW, scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence
