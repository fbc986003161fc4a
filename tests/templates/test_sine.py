"""Sine and cosine of the C keep the error that nmpc.c states; their coefficients are the best ones."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import mpmath
import pytest

from mambo_codegen.bundle.flags import COMPILE_FLAGS
from mambo_codegen.bundle.render import render
from mambo_codegen.numbers.trigonometry import MINIMAX_COSINE, MINIMAX_SINE, SINE_ERRORS
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from tests.support.bundles import place
from tests.support.shell import shell
from tests.support.tools import require

PROGRAM = Path(__file__).with_name("sine_errors.c")


@pytest.mark.parametrize("scalar", ["fixed", pytest.param("float32", marks=pytest.mark.long)])
def test_no_angle_exceeds_the_stated_error(scalar: str, tmp_path: Path) -> None:
    """Every float32 from 2^-13 rad to 1024 rad; one in 101 angles of fixed point; the bound is tight."""
    require("gcc", "gcc")
    settings = with_option(presets.preset("mambo"), "code.scalar", scalar)
    place(render(settings, with_digest=False), tmp_path)
    shell("gcc", *COMPILE_FLAGS, "-w", "-I.", PROGRAM, "-o", "errors", "-lm", folder=tmp_path)
    largest = max(map(float, shell(tmp_path / "errors", folder=tmp_path).split()))
    assert 0.8 * SINE_ERRORS[scalar] < largest <= SINE_ERRORS[scalar]


def error_of(coefficients: tuple[str, ...], r: Any) -> Any:
    """Return the error at r of a polynomial of sine, or of cosine if its first coefficient is near -1/2."""
    terms = [mpmath.mpf(coefficient) for coefficient in coefficients]
    power, exact = (2, mpmath.cos(r) - 1) if terms[0] < -0.4 else (3, mpmath.sin(r) - r)
    return exact - sum(term * r ** (power + (2 * k)) for k, term in enumerate(terms))


@pytest.mark.parametrize("coefficients", [MINIMAX_SINE, *MINIMAX_COSINE.values()])
def test_no_other_coefficients_have_a_smaller_error(coefficients: tuple[str, ...]) -> None:
    """The largest error occurs once more than there are coefficients, with both signs (Chebyshev)."""
    with mpmath.workdps(40):
        angles = [1.0005 * mpmath.pi / 4 * step / 2000 for step in range(1, 2001)]
        errors = [error_of(coefficients, r) for r in angles]
    largest = max(map(abs, errors))
    peaks = [error for error in errors if abs(error) > 0.99 * largest]
    assert sum(one * other < 0 for one, other in pairwise(peaks)) == len(coefficients)
