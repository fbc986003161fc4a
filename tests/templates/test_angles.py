"""Angles in C: sine and cosine keep the error that nmpc.c states, slewed headings the reference's bits."""

import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_codegen.bundle.flags import COMPILE_FLAGS
from mambo_codegen.bundle.render import render
from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.heading import slew_heading
from mambo_codegen.numbers.trigonometry import MINIMAX_ARC_TANGENT, MINIMAX_COSINE, MINIMAX_SINE, SINE_ERRORS
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from tests.support.bundles import place
from tests.support.cases import SCALARS
from tests.support.extension import build_extension
from tests.support.shell import shell
from tests.support.tools import require

PROGRAM = Path(__file__).with_name("sine_errors.c")
EIGHTH_TURN = 1.0005 * math.pi / 4
ODD = (np.nan, np.inf, -np.inf, 0.0, 1024.0, -1024.0, 1025.0, np.pi, -np.pi, 3.5, -3.5)


@pytest.mark.parametrize("scalar", ["fixed", pytest.param("float32", marks=pytest.mark.long)])
def test_no_angle_exceeds_the_stated_error(scalar: str, tmp_path: Path) -> None:
    """Every float32 from 2^-13 rad to 1024 rad; one in 101 angles of fixed point; the bound is tight."""
    require("gcc", "gcc")
    settings = with_option(presets.preset("mambo"), "code.scalar", scalar)
    place(render(settings, with_digest=False), tmp_path)
    shell("gcc", *COMPILE_FLAGS, "-w", "-I.", PROGRAM, "-o", "errors", "-lm", folder=tmp_path)
    largest = max(map(float, shell(tmp_path / "errors", folder=tmp_path).split()))
    assert 0.8 * SINE_ERRORS[scalar] < largest <= SINE_ERRORS[scalar]


@pytest.mark.sampled(4)
@pytest.mark.parametrize(
    ("coefficients", "first_power", "exact", "largest"),
    [
        (MINIMAX_SINE, 3, lambda r: mpmath.sin(r) - r, EIGHTH_TURN),
        *((terms, 2, lambda r: mpmath.cos(r) - 1, EIGHTH_TURN) for terms in MINIMAX_COSINE.values()),
        (MINIMAX_ARC_TANGENT, 1, mpmath.atan, 1.0),
    ],
)
def test_no_other_coefficients_have_a_smaller_error(
    coefficients: tuple[str, ...], first_power: int, exact: Callable[[Any], Any], largest: float
) -> None:
    """The largest error occurs once more than there are coefficients, with both signs (Chebyshev)."""
    with mpmath.workdps(40):
        terms = [mpmath.mpf(coefficient) for coefficient in coefficients]
        points = [largest * mpmath.mpf(step) / 2000 for step in range(1, 2001)]
        errors = [exact(x) - sum(c * x ** (first_power + 2 * k) for k, c in enumerate(terms)) for x in points]
    peaks = [error for error in errors if abs(error) > 0.99 * max(map(abs, errors))]
    assert sum(one * other < 0 for one, other in pairwise(peaks)) == len(coefficients)


@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", SCALARS)
@pytest.mark.parametrize("name", ["mambo", "table1"])
def test_slewed_headings_equal_the_reference(name: str, scalar: str) -> None:
    """Random and odd headings and changes: the same bits, within the range, and no more than the change."""
    settings = with_option(presets.preset(name), "code.scalar", scalar)
    method, lib, rng = method_of(settings), build_extension(settings).lib, np.random.default_rng(0)
    numbers = method.numbers
    n = 4000
    given = [rng.choice([4.0, 1100.0], n) * rng.uniform(-1, 1, n) for _ in range(2)] + [
        rng.uniform(-0.1, 4, n)
    ]
    odd = rng.choice(ODD, (3, n))
    previous, wanted, most = np.where(rng.random((3, n)) < 0.1, odd, given)
    with np.errstate(all="ignore"):
        expected = slew_heading(method, previous, wanted, most)
        arguments = [numbers.quantize(values[:, None], ("yaw",))[:, 0] for values in (previous, wanted, most)]
    found = [lib.nmpc_slew_heading(*(one.item() for one in row)) for row in zip(*arguments, strict=True)]
    assert numbers.to_si(np.array(found, numbers.scalar), "yaw").tobytes() == expected.tobytes()
    assert (np.abs(expected) <= 1024).all()
    good = (np.abs(previous) <= 1024) & (np.abs(wanted) <= 1024) & (most > 0)
    turned = _angle(expected[good] - previous[good])
    assert (np.abs(turned) <= np.minimum(most[good], np.pi) + 1e-3).all()
    near = good & (most >= np.pi)
    assert np.abs(_angle(expected[near] - wanted[near])).max() < 2e-3
    kept = ~good & (np.abs(previous) <= 1024) & np.isfinite(most)  # a fixed point number is never NaN
    assert np.abs(expected[kept] - previous[kept]).max() < 1e-4


def _angle(difference_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return angles (n,) less whole turns."""
    turned: NDArray[np.float64] = np.angle(np.exp(1j * difference_rad))
    return turned
