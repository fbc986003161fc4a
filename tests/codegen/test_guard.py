"""The guard: budgets that bound how much commands vary, and coarse gains."""

import numpy as np
import pytest

from mambo_codegen.errors import InvalidSettingsError
from mambo_codegen.methods import method_of
from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.settings.controller_toml import parse, with_option
from mambo_codegen.settings.model import Settings
from tests.support.cases import SCALARS
from tests.support.height_settings import height_settings
from tests.support.parity import inputs_of_steps
from tests.support.quadratic import TWO_MOVES, quadratic_settings, settings_of

GUARDED = settings_of(TWO_MOVES | {"guard.tilt_budget_rad": 1.5})


def guarded_height(scalar: str) -> Settings:
    """Return settings with a height whose guard soon has nothing left."""
    settings = with_option(height_settings(), "code.scalar", scalar)
    return with_option(
        settings, "guard", {"thrust_budget_m_s2": 5.0, "thrust_budget_m_s3": 20.0, "tilt_budget_rad_s": 1.0}
    )


@pytest.mark.parametrize("scalar", SCALARS)
def test_commands_vary_by_no_more_than_the_budget_and_what_it_gains(scalar: str) -> None:
    """Over n steps by full + n rho at most, roll, pitch and thrust, whatever is measured and wanted."""
    settings = guarded_height(scalar)
    guard, n, steps = settings.guard, 50, 100
    assert guard is not None
    controller = Quadratic(settings).reference_controller(n)
    commands = []
    for inputs in inputs_of_steps(settings, n, steps, seed=3):
        step = controller.step(inputs.state, inputs.target, inputs.thrust)
        assert step.thrust_m_s2 is not None
        commands.append(np.column_stack([step.command_rad, step.thrust_m_s2]))
    varied = np.cumsum(np.abs(np.diff(commands, axis=0)), axis=0).astype(np.float64)
    full = np.array([guard.tilt_budget_rad, guard.tilt_budget_rad, guard.thrust_budget_m_s2])
    rho = 0.01 * np.array([guard.tilt_budget_rad_s, guard.tilt_budget_rad_s, guard.thrust_budget_m_s3])
    most = full + (np.arange(1, steps)[:, np.newaxis, np.newaxis] * rho)
    levelled = np.any(np.all(np.array(commands)[:, :, :2] == 0, axis=2)[1:], axis=0)
    found = varied[:, ~levelled] - most
    assert (found <= 1e-4).all()
    assert (found[-1] > -0.05 * most[-1]).any(axis=0).all(), "each budget is spent by some controller"


def test_a_swing_from_end_to_end_is_free() -> None:
    """After a rest the command jumps from one tilt limit to the other at once, as without a guard."""
    without = Settings.model_validate(GUARDED.model_dump(exclude={"guard"}))
    commands = []
    for settings in (GUARDED, without):
        controller = method_of(settings).reference_controller(1)
        for sign in (1.0, -1.0):
            state, target = np.zeros((1, 7)), np.zeros((1, 9))
            target[0, :2] = 5.0 * sign
            commands.append(controller.step(state, target, [9.81]).command_rad)
    assert (np.array(commands[:2]) == np.array(commands[2:])).all()
    assert np.abs(commands[1] - commands[0]).min() > 1.9 * GUARDED.limits.tilt_rad


def test_coarse_gains_are_those_of_a_filter_for_noisier_positions() -> None:
    """Of the same Kalman filter with guard.position_noise, never finer than the controller's own."""
    coarse = Quadratic(GUARDED).observer.coarse_gain
    noisier = Quadratic(with_option(GUARDED, "observer.position_noise", 0.03)).observer
    assert coarse is not None
    assert (coarse == noisier.gain).all()
    still = Quadratic(with_option(GUARDED, "observer.position_noise", 0.1)).observer
    assert still.coarse_gain is not None
    assert (still.coarse_gain == still.gain).all()


def test_without_a_measured_position_the_estimate_follows_less() -> None:
    """A position that jumps moves the estimate of a controller that was told so less, until a reset."""
    controller = Quadratic(GUARDED).reference_controller(2)
    target = np.zeros((2, 9))
    for _ in range(5):
        controller.step(np.zeros((2, 7)), target, [9.81, 9.81])
    assert (controller.set_position_measured(np.array([True, False])) == 0).all()
    jumped = np.zeros((2, 7))
    jumped[:, 0] = 0.001
    controller.step(jumped, target, [9.81, 9.81])
    fine, coarse = controller.memory.estimate.position_m[:, 0]
    assert 0 < coarse < 0.5 * fine
    controller.reset(np.zeros((2, 2)))
    assert not controller.memory.is_coarse.any()


def test_a_budget_holds_a_swing_at_least() -> None:
    """Twice the tilt limit, if the setting says less; and with a 1-norm there is no guard."""
    found = Quadratic(with_option(GUARDED, "guard.tilt_budget_rad", 0.1)).guard
    assert found is not None
    assert found.tilt_budget_rad == 2 * GUARDED.limits.tilt_rad
    assert found.thrust_budget_m_s2 == 12.0
    with pytest.raises(InvalidSettingsError, match=r'must be "quadratic" with \[guard\]'):
        parse("[guard]\n", "controller.toml")


def test_a_budget_of_the_thrust_is_of_what_is_delivered() -> None:
    """Its commands vary by more where the thrust is less than the commanded one."""
    found = Quadratic(with_option(guarded_height("float64"), "height.thrust_gain", 0.8)).guard
    assert found is not None
    assert 0.8 * np.array([found.thrust_budget_m_s2, found.thrust_growth_m_s2]) == pytest.approx([5.0, 0.2])


def test_without_the_section_there_is_no_guard() -> None:
    """The preset has none, and its reference says so."""
    with pytest.raises(ValueError, match="the settings have no guard"):
        Quadratic(quadratic_settings()).reference_controller().set_position_measured(np.array([True]))
