"""The check of bits: every build has those of the reference; another bit fails it."""

import json
from pathlib import Path

import pytest

from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.verify import bits
from mambo_sil.verify.check import CheckOutcome
from tests.support.cases import settings_case
from tests.support.one_norm import ONE_NORM
from tests.support.subjects import subject
from tests.support.tools import require

MAMBO = ONE_NORM
FIXED = with_option(MAMBO, "code.scalar", "fixed")
LIMITED = with_option(with_option(FIXED, "limits.speed_m_s", 5.0), "limits.braking_m_s2", 3.0)
"""With limits the instance has an odd count of numbers, and sums of twice their size behind them."""
WRONG_COMMAND = (
    "nmpc.c",
    "self->command_rad[1] = self->plan_rad[1];",
    "self->command_rad[1] = self->plan_rad[0];",
)
WRONG_SCALE = (
    "nmpc.c",
    "quantize(state->yaw_rad, NMPC_YAW_SCALE)",
    "quantize(state->yaw_rad, 1.0f)",
)


@pytest.fixture
def _compilers() -> None:
    require("gcc", "gcc")
    require("clang", "clang")


@pytest.mark.long
@pytest.mark.usefixtures("_compilers")
@pytest.mark.parametrize(
    "settings",
    [
        pytest.param(MAMBO, marks=pytest.mark.long),
        with_option(settings_case(6, "float64"), "code.prefix", "left_wing"),
        LIMITED,
    ],
    ids=["mambo", "left_wing", "limited in fixed point"],
)
def test_every_build_has_the_bits_of_the_reference(settings: Settings, tmp_path: Path) -> None:
    """All cases, at every optimisation of both compilers, under any prefix."""
    result = bits.check(subject(settings, tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence
    assert len(result.figures["builds"]) == len(bits.BUILDS)
    assert json.loads(json.dumps(result.figures)) == result.figures


@pytest.mark.usefixtures("_compilers")
@pytest.mark.parametrize(
    ("scalar", "fault", "word"),
    [
        ("float32", WRONG_COMMAND, "command_rad"),
        pytest.param("fixed", WRONG_SCALE, "the self-test fails", marks=pytest.mark.long),
    ],
)
def test_another_bit_fails(scalar: str, fault: tuple[str, str, str], word: str, tmp_path: Path) -> None:
    """In the controller, and in the functions around it that take floats."""
    result = bits.check(subject(with_option(MAMBO, "code.scalar", scalar), tmp_path, fault))
    assert result.outcome is CheckOutcome.FAILED
    assert word in result.evidence
