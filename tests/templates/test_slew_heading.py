"""Slewed headings have the bits of the reference, and what nmpc.h promises of them."""

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.heading import slew_heading
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.presets import preset
from tests.support.cases import SCALARS
from tests.support.extension import build_extension

ODD = (np.nan, np.inf, -np.inf, 0.0, 1024.0, -1024.0, 1025.0, np.pi, -np.pi, 3.5, -3.5)


@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", SCALARS)
@pytest.mark.parametrize("name", ["mambo", "table1"])
def test_slewed_headings_equal_the_reference(name: str, scalar: str) -> None:
    """Random and odd headings and changes: the same bits, within the range, and no more than the change."""
    settings = with_option(preset(name), "code.scalar", scalar)
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
