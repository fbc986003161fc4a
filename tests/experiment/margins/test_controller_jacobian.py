"""The linear system of a controller of the height: where it is taken, and for which load."""

import numpy as np
import pytest

from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.errors import FlightError
from mambo_sil.experiment.margins.controller_jacobian import linear_controller
from tests.support.height_settings import height_settings


def test_a_narrow_fence_changes_nothing_midway() -> None:
    """Between walls 10 cm apart the four matrices are those without walls, to 1e-6 of their largest number.

    At a wall, and outside, the climb is limited on one side.
    """
    free = height_settings()
    walled = with_option(with_option(free, "limits.fence.ceiling_m", 1.1), "limits.fence.floor_m", 1.0)
    found, expected = linear_controller(walled), linear_controller(free)
    for name in ("a", "b", "c", "d"):
        right = getattr(expected, name)
        assert getattr(found, name) == pytest.approx(right, rel=0.0, abs=1e-6 * np.abs(right).max())


@pytest.mark.parametrize(
    ("settings", "load"),
    [
        (height_settings(delay_s=0.0), 1.2),
        (height_settings(delay_s=0.05), 1.2),
        (with_option(height_settings(), "observer.age_s", 0.024), 1.1),
    ],
    ids=["thrust without delay", "thrust with delay", "old state"],
)
def test_a_load_that_is_learnt_multiplies_the_thrust(settings: Settings, load: float) -> None:
    """The controller's estimates ask for as many times more thrust as the drone is heavier.

    A drone whose thrust or state were not as late as the settings say would not come to rest.
    """
    light, heavy = (np.abs(linear_controller(settings, one).c[2]).max() for one in (1.0, load))
    assert heavy == pytest.approx(load * light, rel=1e-4)


def test_a_drone_that_falls_is_not_at_hover() -> None:
    """Also one whose controller learns nothing, which need not be at its target."""
    with pytest.raises(FlightError, match=r"hovers with 3 times the expected thrust does not hold"):
        linear_controller(height_settings(learn="none"), 3.0)
