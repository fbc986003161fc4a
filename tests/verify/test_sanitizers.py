"""The generated C under sanitizers, called with inputs of every kind: nothing undefined, ever."""

import json
from pathlib import Path

import pytest

from mambo_codegen.settings import presets
from mambo_sil.verify import sanitizers
from mambo_sil.verify.check import CheckOutcome
from tests.support.cases import CORNER_HORIZONS, settings_case
from tests.support.one_norm import ONE_NORM
from tests.support.subjects import subject
from tests.support.tools import require

SETTINGS = {name: presets.load(name) for name in presets.names()} | {
    f"case {index}": settings_case(index, ("float32", "float64")[index % 2])
    for index in range(len(CORNER_HORIZONS))
}
FAULTS = {
    "a move too many": (
        "nmpc.c",
        "for (k = 0; k < NMPC_MOVES; k++) {\n        self->plan_rad[k] = self->command_rad",
        "for (k = 0; k <= NMPC_MOVES; k++) {\n        self->plan_rad[k] = self->command_rad",
    ),
}


@pytest.fixture(autouse=True)
def _compilers() -> None:
    require("gcc", "gcc")
    require("clang", "clang")


def test_nothing_undefined_happens(tmp_path: Path) -> None:
    """All cases under three builds with sanitizers: no report, and the bits of the reference."""
    result = sanitizers.check(subject(ONE_NORM, tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence
    assert result.figures["calls"] > 15_000
    assert json.loads(json.dumps(result.figures)) == result.figures
    assert len(result.figures["builds"]) == len(sanitizers.BUILDS)


@pytest.mark.sampled(4)
@pytest.mark.long
@pytest.mark.parametrize("name", SETTINGS)
def test_nothing_undefined_happens_whatever_the_settings(name: str, tmp_path: Path) -> None:
    """Every preset, and the corners of the horizon with float32 and float64 by turns."""
    result = sanitizers.check(subject(SETTINGS[name], tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence


@pytest.mark.long
@pytest.mark.parametrize("fault", FAULTS)
def test_what_is_undefined_is_reported(fault: str, tmp_path: Path) -> None:
    """Faults that parity may not see, for the memory beyond happens to be harmless."""
    result = sanitizers.check(subject(ONE_NORM, tmp_path, FAULTS[fault]))
    assert result.outcome is CheckOutcome.FAILED
    assert "runtime error" in result.evidence or "AddressSanitizer" in result.evidence


@pytest.mark.long
def test_memory_that_is_read_before_it_is_written_is_reported(tmp_path: Path) -> None:
    """A weight that nmpc_init leaves out."""
    fault = ("nmpc.c", "    self->weights.effort = NMPC_EFFORT_WEIGHT;\n", "")
    result = sanitizers.check(subject(ONE_NORM, tmp_path, fault))
    assert result.outcome is CheckOutcome.FAILED
    assert any("MemorySanitizer" in found for found in result.figures["faults"]), result.evidence
