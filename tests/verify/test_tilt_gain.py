"""A controller that learns its tilt gain: every check passes it, and a fault in the gain is found."""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Final

import pytest

from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.verify import fuzzing, rules
from mambo_sil.verify.calls import Outcomes, Tape, answers
from mambo_sil.verify.cases import random_tapes
from mambo_sil.verify.check import CheckOutcome
from tests.support import proven
from tests.support.height import height_case
from tests.support.quadratic import quadratic_case
from tests.support.subjects import Harm, played_fault, subject
from tests.support.tools import require

KINDS: Final = {"small angles": height_case(5, "float32"), "thrust vector": height_case(6, "float32")} | {
    f"level {k}": quadratic_case(k, "float32") for k in (0,)
}
"""With a height, limits and guard, with small angles and with the thrust vector; and without a height."""
FAULTS: Final = {
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
    "a command at the limit is learnt from": Harm("nmpc.c", r" - NMPC_TILT_GAIN_FREE;", ";"),
    "the gain has no limits": Harm("nmpc.c", r"(#define NMPC_TILT_GAIN_MIN) [^ \n]*", r"\1 0.1f"),
    "the means start at rest": Harm(
        "nmpc.c",
        r"learnt->slow_m_step2\[angle\] = attitude->tilt_m_step2\[angle\];",
        "learnt->slow_m_step2[angle] = (nmpc_real_t)0;",
    ),
    "the floor is learnt from": Harm(
        "nmpc.c", r" \|\| \(state->grounded != 0\)\) \{\n            tilt_gain", ") {\n            tilt_gain"
    ),
    "a reset keeps the gain": Harm("nmpc.c", r"    tilt_gain_clear\(&self->tilt_gain\);\n", ""),
    "a bounded command is the model's": Harm(
        "nmpc.c", r"tilt_gain_meant\(&self->tilt_gain, 0, change_rad\[0\]\)", "change_rad[0]"
    ),
    "the largest move is that of the settings": Harm(
        "nmpc.c", r"tilt_gain_share\(learnt, NMPC_RIGHT\)", "NMPC_TILT_GAIN_ONE"
    ),
}


def learning(kind: str, scalar: str) -> Settings:
    """Return settings of a kind, with a tilt gain that is learnt."""
    learnt = with_option(KINDS[kind], "observer.tilt_gain", "learnt")
    return with_option(learnt, "code.scalar", scalar)


@lru_cache(maxsize=1)
def played(settings: Settings) -> tuple[Sequence[Tape], Sequence[Outcomes]]:
    """Return few random tapes, and what the reference answers."""
    tapes = random_tapes(settings, 60)
    return tapes, answers(settings, tapes)


@pytest.mark.first_is_quick
@pytest.mark.sampled(2)
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
@pytest.mark.parametrize("kind", KINDS)
def test_random_calls_have_the_bits_of_the_reference(kind: str, scalar: str, tmp_path: Path) -> None:
    """Commands, gains, means, and what is saturated."""
    settings = learning(kind, scalar)
    assert played_fault(subject(settings, tmp_path), "-O0", played=played(settings)) is None


@pytest.mark.first_is_quick
@pytest.mark.sampled(4)
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_the_tilt_gain_is_found(fault: str, tmp_path: Path) -> None:
    """By other bits than those of the reference."""
    settings = learning("small angles", "float32")
    found = played_fault(subject(settings, tmp_path, FAULTS[fault]), "-O0", played=played(settings))
    assert found is not None
    assert found.startswith("tape ")


@pytest.mark.long
def test_no_call_breaks_a_promise(tmp_path: Path) -> None:
    """Whatever the drone does, no command leaves the tilt limit, and a held one stays."""
    require("clang", "clang")
    result = fuzzing.check(subject(learning("thrust vector", "float32"), tmp_path), runs=1_000)
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.thorough
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_no_rule_is_broken(scalar: str, tmp_path: Path) -> None:
    """MISRA C, but for the deviations that the manual lists."""
    require("cppcheck", "cppcheck")
    result = rules.check(subject(learning("small angles", scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.long
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_it_is_proven(scalar: str, tmp_path: Path) -> None:
    """No run-time error, and no command beyond the limits of tilt and thrust."""
    require("frama-c", "frama-c-base")
    result = proven.check(subject(learning("small angles", scalar), tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence
