"""Design: what is derived from settings is derived once."""

from dataclasses import FrozenInstanceError

import pytest

from mambo_codegen.design import Design
from mambo_codegen.settings.controller_toml import with_option
from tests.support.cases import SCALARS
from tests.support.one_norm import ONE_NORM

MAMBO = ONE_NORM


@pytest.mark.parametrize("scalar", SCALARS)
@pytest.mark.parametrize("name", ["tables", "numbers", "limits", "trigonometry"])
def test_everything_is_derived_once(name: str, scalar: str) -> None:
    """Whoever is handed a design reads the same object."""
    design = Design(with_option(MAMBO, "code.scalar", scalar))
    assert getattr(design, name) is getattr(design, name)


def test_a_design_is_a_value() -> None:
    """Equal settings make equal designs, whatever has been derived already; nothing can be put in."""
    one, other = Design(MAMBO), Design(ONE_NORM)
    assert one.limits.tilt == other.limits.tilt
    assert (one, hash(one)) == (Design(MAMBO), hash(other))
    assert one != Design(with_option(MAMBO, "cost.effort_weight", 2.0))
    with pytest.raises(FrozenInstanceError):
        one.settings = MAMBO  # type: ignore[misc]
