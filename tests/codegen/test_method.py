"""Methods: what is derived from settings is derived once."""

from dataclasses import FrozenInstanceError

import pytest

from mambo_codegen.methods import method_of
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from tests.support.cases import SCALARS
from tests.support.one_norm import ONE_NORM

MAMBO = ONE_NORM


@pytest.mark.parametrize("scalar", SCALARS)
@pytest.mark.parametrize("preset", ["mambo", "mambo-1norm"])
@pytest.mark.parametrize("name", ["numbers", "limits", "trigonometry"])
def test_everything_is_derived_once(name: str, preset: str, scalar: str) -> None:
    """Whoever is handed a method reads the same object."""
    method = method_of(with_option(presets.preset(preset), "code.scalar", scalar))
    assert getattr(method, name) is getattr(method, name)


def test_a_method_is_a_value() -> None:
    """Equal settings make equal methods, whatever has been derived already; nothing can be put in."""
    one, other = method_of(MAMBO), method_of(ONE_NORM)
    assert one.limits.tilt == other.limits.tilt
    assert (one, hash(one)) == (method_of(MAMBO), hash(other))
    assert one != method_of(with_option(MAMBO, "cost.effort_weight", 2.0))
    with pytest.raises(FrozenInstanceError):
        one.settings = MAMBO  # type: ignore[misc]
