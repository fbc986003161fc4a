"""`model.thrust = "hover"`: a controller with a 1-norm that predicts with the thrust of hover."""

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_codegen.methods.one_norm.controller import OneNormController
from mambo_codegen.methods.one_norm.method import OneNorm
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.support.cases import SCALARS

THRUSTS_M_S2 = [9.81, 6.0, 14.0, 9.81]


def one_norm(scalar: str, thrust: str) -> Settings:
    """Return preset mambo-1norm with the thrust."""
    settings = with_option(presets.load("mambo-1norm"), "code.scalar", scalar)
    return with_option(settings, "model.thrust", thrust)


def commands(settings: Settings, thrusts_m_s2: list[float]) -> NDArray[np.float64]:
    """Return the commands (n, 2) of a fresh controller on the way to its target, at these thrusts."""
    controller = OneNormController(OneNorm(settings))
    state, target = np.array([[0.01, -0.02, 0.01, 0.02, 0.02, -0.03, 0.4]]), np.zeros((1, 4))
    return np.concatenate([controller.step(state, target, [given]).command_rad for given in thrusts_m_s2])


@pytest.mark.parametrize("scalar", SCALARS)
def test_no_measured_thrust_changes_a_command(scalar: str) -> None:
    """Every command has the bits of that with the thrust of hover; with a measured thrust they differ."""
    measured = one_norm(scalar, "measured")
    hover = commands(measured, [9.81] * len(THRUSTS_M_S2))
    assert np.array_equal(commands(one_norm(scalar, "hover"), THRUSTS_M_S2), hover)
    assert not np.array_equal(commands(measured, THRUSTS_M_S2), hover)


def test_a_thrust_out_of_range_is_refused_all_the_same() -> None:
    """As with the other norm, which predicts with the thrust of hover too."""
    controller = OneNormController(OneNorm(one_norm("float32", "hover")))
    step = controller.step(np.zeros((1, 7)), np.zeros((1, 4)), [0.0])
    assert step.status.tolist() == [Status.BAD_THRUST]


def test_the_digest_of_settings_without_it_stays() -> None:
    """The values in use do not name it: a controller of an earlier version has the same digest."""
    preset = presets.load("mambo-1norm")
    assert "thrust" not in preset.in_use["model"]
    assert one_norm("float32", "hover").digest != preset.digest


@pytest.mark.parametrize(
    ("key", "value"), [("thrust_acceleration_min_m_s2", 12.0), ("thrust_acceleration_max_m_s2", 8.0)]
)
def test_in_a_range_without_hover_it_is_the_nearest_thrust(key: str, value: float) -> None:
    """As in the self-test and the example of the bundle."""
    measured, hover = (
        with_option(one_norm("float32", way), f"ranges.{key}", value) for way in ("measured", "hover")
    )
    assert np.array_equal(commands(hover, [value, value]), commands(measured, [value, value]))
