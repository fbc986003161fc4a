"""Rate feedback of a controller with a 1-norm."""

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

from mambo_codegen.methods.one_norm.controller import OneNormController, OneNormStep
from mambo_codegen.methods.one_norm.horizon import horizon_tables
from mambo_codegen.methods.one_norm.method import OneNorm
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings

ONE_NORM = presets.load("mambo-1norm")
FEEDBACK_S = {"roll": 0.04, "pitch": 0.02}


def damped() -> Settings:
    """Return preset mambo-1norm with feedback of both rates."""
    settings = with_option(ONE_NORM, "code.scalar", "float64")
    for angle, feedback_s in FEEDBACK_S.items():
        settings = with_option(settings, f"damping.{angle}_rate_feedback_s", feedback_s)
    return settings


def steps(tilts_rad: list[list[float]]) -> list[OneNormStep]:
    """Step a fresh controller at rest near its target, with these angles of roll and pitch."""
    controller = OneNormController(OneNorm(damped()))
    return [
        controller.step(np.array([[0.01, 0.0, 0.0, 0.0, *tilt, 0.3]]), np.zeros((1, 4)), [9.81])
        for tilt in tilts_rad
    ]


def added(step: OneNormStep) -> NDArray[np.float64]:
    """Return what the rates added to the first moves (2,)."""
    return np.asarray(step.command_rad[0] - step.plan_rad[0, 0])


def test_the_rates_add_to_the_first_moves() -> None:
    """Feedback times the change of the angle over an update period; nothing in the first step."""
    first, second = steps([[0.01, 0.02], [0.012, 0.017]])
    assert np.array_equal(added(first), [0.0, 0.0])
    np.testing.assert_allclose(added(second), [0.04 * 0.002 / 0.01, -0.02 * 0.003 / 0.01], rtol=1e-9)


def test_the_command_stays_within_the_tilt_limit() -> None:
    """However quickly the drone turns."""
    _, second = steps([[-1.0, 1.0], [1.0, -1.0]])
    assert second.command_rad.tolist() == [[0.35, -0.35]]


def test_a_reset_forgets_the_angles() -> None:
    """The next step has no rate."""
    controller = OneNormController(OneNorm(damped()))
    state = np.array([[0.0, 0.0, 0.0, 0.0, 0.1, 0.1, 0.0]])
    controller.step(state, np.zeros((1, 4)), [9.81])
    controller.reset([[0.0, 0.0]])
    assert np.array_equal(added(controller.step(-state, np.zeros((1, 4)), [9.81])), [0.0, 0.0])


def test_feedback_shortens_the_lag_of_the_prediction() -> None:
    """The tables are those of lags that are shorter by as much."""
    model = ONE_NORM.model
    shorter = with_option(ONE_NORM, "model.roll_lag_s", model.roll_lag_s - 0.04)
    shorter = with_option(shorter, "model.pitch_lag_s", model.pitch_lag_s - 0.02)
    assert horizon_tables(damped()).angles == horizon_tables(shorter).angles


def test_more_feedback_than_lag_is_refused() -> None:
    """With the key, the rule and the value that it depends on."""
    settings = with_option(ONE_NORM, "model.roll_lag_s", 0.03)
    with pytest.raises(
        ValidationError, match=r"must be 0 or at least 0.041 with damping.roll_rate_feedback_s"
    ):
        Settings.model_validate(settings.model_dump() | {"damping": {"roll_rate_feedback_s": 0.04}})
