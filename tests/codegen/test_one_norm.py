"""A controller with a 1-norm: outages, weights that it takes, rate feedback, and the thrust of hover."""

from typing import Any, Final

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

from mambo_codegen.methods import method_of
from mambo_codegen.methods.one_norm.controller import OneNormController, OneNormStep
from mambo_codegen.methods.one_norm.horizon import horizon_tables
from mambo_codegen.methods.one_norm.method import OneNorm
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.support.cases import SCALARS
from tests.support.strategies import Values

PRESET: Final = presets.preset("mambo-1norm")
QUICK: Final[Values] = {"optimizer.iterations": 1}
"""A short search."""
HOVER: Final[Values] = {"model.thrust": "hover"}
THRUSTS_M_S2: Final = [9.81, 6.0, 14.0, 9.81]


def one_norm(values: Values) -> Settings:
    """Return preset mambo-1norm with other values."""
    settings = PRESET
    for path, value in values.items():
        settings = with_option(settings, path, value)
    return settings


DAMPED: Final = one_norm(
    {
        "code.scalar": "float64",
        "damping.roll_rate_feedback_s": 0.04,
        "damping.pitch_rate_feedback_s": 0.02,
    }
)
"""With feedback of both rates."""


@pytest.mark.parametrize(("period_s", "steps"), [(0.001, 250), (0.1, 5), (0.3, 2), (0.7, 1)])
def test_the_command_is_level_half_a_second_after_the_last_state(period_s: float, steps: int) -> None:
    """To the nearest step, of which there are at most 250, at least one; without limits it is held."""
    for limited in (True, False):
        settings = one_norm(
            QUICK | {"horizon.update_period_s": period_s, "limits.speed_m_s": 2.0 if limited else 0.0}
        )
        method, target = method_of(settings), np.zeros((1, 4))
        controller: Any = method.reference_controller(1)
        target[0, :2] = 5.0
        for _ in range(3):
            controller.step(np.zeros((1, 7)), target, [9.81])
        lost = [controller.step(np.full((1, 7), np.nan), target, [9.81]) for _ in range(steps + 1)]
        held = [bool(np.any(one.command_rad != 0)) for one in lost]
        assert held == [True] * (steps - 1) + [not limited] * 2
        assert method.outage_steps == (steps if limited else None)


@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_weights_are_taken_up_to_their_limits(scalar: str) -> None:
    """Each by itself, to 1 in a thousand."""
    settings = one_norm(QUICK | {"code.scalar": scalar})
    most = np.array(method_of(settings).weight_limits)
    assert most.shape == (2,)
    weights = [most * share for share in ((0.999, 0.999), (1.001, 0.999), (0.999, 1.001), (0.0, 0.0))]
    controller: Any = method_of(settings).reference_controller(4)
    expected = [Status.OK, Status.BAD_WEIGHT, Status.BAD_WEIGHT, Status.OK]
    assert controller.set_weights(weights).tolist() == expected
    assert most[0] > settings.cost.tracking_weight
    assert most[1] > settings.cost.effort_weight


def steps(tilts_rad: list[list[float]]) -> list[OneNormStep]:
    """Step a fresh controller at rest near its target, with these angles of roll and pitch."""
    controller = OneNormController(OneNorm(DAMPED))
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
    controller = OneNormController(OneNorm(DAMPED))
    state = np.array([[0.0, 0.0, 0.0, 0.0, 0.1, 0.1, 0.0]])
    controller.step(state, np.zeros((1, 4)), [9.81])
    controller.reset([[0.0, 0.0]])
    assert np.array_equal(added(controller.step(-state, np.zeros((1, 4)), [9.81])), [0.0, 0.0])


def test_feedback_shortens_the_lag_of_the_prediction() -> None:
    """The tables are those of lags that are shorter by as much."""
    model = PRESET.model
    lags_s = {"model.roll_lag_s": model.roll_lag_s - 0.04, "model.pitch_lag_s": model.pitch_lag_s - 0.02}
    assert horizon_tables(DAMPED).angles == horizon_tables(one_norm(lags_s)).angles


def test_more_feedback_than_lag_is_refused() -> None:
    """With the key, the rule and the value that it depends on."""
    settings = one_norm({"model.roll_lag_s": 0.03})
    with pytest.raises(
        ValidationError, match=r"must be 0 or at least 0.041 with damping.roll_rate_feedback_s"
    ):
        Settings.model_validate(settings.model_dump() | {"damping": {"roll_rate_feedback_s": 0.04}})


def commands(settings: Settings, thrusts_m_s2: list[float]) -> NDArray[np.float64]:
    """Return the commands (n, 2) of a fresh controller on the way to its target, at these thrusts."""
    controller = OneNormController(OneNorm(settings))
    state, target = np.array([[0.01, -0.02, 0.01, 0.02, 0.02, -0.03, 0.4]]), np.zeros((1, 4))
    return np.concatenate([controller.step(state, target, [given]).command_rad for given in thrusts_m_s2])


@pytest.mark.parametrize("scalar", SCALARS)
def test_no_measured_thrust_changes_a_command(scalar: str) -> None:
    """Every command has the bits of that with the thrust of hover; with a measured thrust they differ."""
    measured = one_norm({"code.scalar": scalar})
    hover = commands(measured, [9.81] * len(THRUSTS_M_S2))
    assert np.array_equal(commands(one_norm(HOVER | {"code.scalar": scalar}), THRUSTS_M_S2), hover)
    assert not np.array_equal(commands(measured, THRUSTS_M_S2), hover)


def test_a_thrust_out_of_range_is_refused_all_the_same() -> None:
    """As with the other norm, which predicts with the thrust of hover too."""
    controller = OneNormController(OneNorm(one_norm(HOVER)))
    step = controller.step(np.zeros((1, 7)), np.zeros((1, 4)), [0.0])
    assert step.status.tolist() == [Status.BAD_THRUST]


def test_the_digest_of_settings_without_it_stays() -> None:
    """The values in use do not name it: a controller of an earlier version has the same digest."""
    assert "thrust" not in PRESET.in_use["model"]
    assert one_norm(HOVER).digest != PRESET.digest


@pytest.mark.parametrize(
    ("key", "value"), [("thrust_acceleration_min_m_s2", 12.0), ("thrust_acceleration_max_m_s2", 8.0)]
)
def test_in_a_range_without_hover_it_is_the_nearest_thrust(key: str, value: float) -> None:
    """As in the self-test and the example of the bundle."""
    measured, hover = (one_norm(values | {f"ranges.{key}": value}) for values in ({}, HOVER))
    assert np.array_equal(commands(hover, [value, value]), commands(measured, [value, value]))
