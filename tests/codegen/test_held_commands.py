"""A command that is held, set by the caller, or at its limit, with rate feedback and a heading that turns."""

from dataclasses import fields

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_codegen.methods import method_of
from mambo_codegen.methods.quadratic.controller import QuadraticController, QuadraticStep
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from tests.support.quadratic import told

Array = NDArray[np.float64]

BAD = np.full((1, 9), np.nan)
LIMIT_RAD = 0.35


def controller(scalar: str = "float32") -> QuadraticController:
    """Return a controller of preset mambo, which has rate feedback of 5 control steps in roll."""
    found = method_of(with_option(presets.preset("mambo"), "code.scalar", scalar)).reference_controller()
    assert isinstance(found, QuadraticController)
    return found


def step(used: QuadraticController, roll_rad: float, target: Array, *, yaw_rad: float = 0.0) -> QuadraticStep:
    """Step at rest at the origin, with a measured roll and heading."""
    return used.step(np.array([[0, 0, 0, 0, roll_rad, 0, yaw_rad]]), target, np.array([9.81]))


def east(distance_m: float) -> Array:
    """Return a target at rest to the east, which roll tilts to at heading 0."""
    return told([[0.0, distance_m, 0.0, 0.0]])


@pytest.mark.parametrize("scalar", ["float32", "float64", "fixed"])
def test_a_command_is_saturated_exactly_if_it_lies_at_the_limit(scalar: str) -> None:
    """Also if only rate feedback takes it there, not if it takes it away, and wherever else it comes from."""
    used = controller(scalar)
    step(used, 0.0, east(0.2))
    found = step(used, 0.2, east(0.2))
    assert found.command_rad[0, 0] == pytest.approx(LIMIT_RAD, rel=1e-6)
    assert found.saturated[0]
    assert not step(used, 0.2, BAD).saturated[0]
    for _ in range(50):
        found = step(used, 0.2, east(50.0))
    assert found.saturated[0]
    found = step(used, 0.18, east(50.0))
    assert found.command_rad[0, 0] == pytest.approx(LIMIT_RAD - 0.1, rel=1e-3)
    assert not found.saturated[0]
    used.report_command([[LIMIT_RAD, 0.0]])
    assert used.saturated[0]
    used.reset([[0.0, -LIMIT_RAD]])
    assert used.saturated[0]
    used.reset([[0.0, 0.99 * LIMIT_RAD]])
    assert not used.saturated[0]


@pytest.mark.parametrize("scalar", ["float32", "float64", "fixed"])
def test_a_held_command_has_no_rate_feedback(scalar: str) -> None:
    """It is that of the model, from the first refused target on."""
    used = controller(scalar)
    for _ in range(3):
        step(used, 0.0, east(0.2))
    fed = step(used, 0.02, east(0.2))
    held = [step(used, 0.02, BAD) for _ in range(3)]
    assert held[0].status[0] == Status.BAD_TARGET
    assert fed.command_rad[0, 0] - held[0].command_rad[0, 0] == pytest.approx(0.1, rel=1e-3)
    for found in held[1:]:
        assert found.command_rad.tolist() == held[0].command_rad.tolist()


@pytest.mark.parametrize("scalar", ["float32", "float64", "fixed"])
def test_a_reset_command_is_held_in_every_bit(scalar: str) -> None:
    """Before the first good step nothing has changed it."""
    used = controller(scalar)
    used.reset([[0.123, -0.234]])
    given = used.memory.command_rad.copy()
    used.step(np.full((1, 7), np.nan), east(0.0), np.array([9.81]))
    assert used.memory.command_rad.tolist() == given.tolist()


def test_a_held_command_stays_in_the_axes_of_the_body() -> None:
    """The drone keeps its roll and pitch while it yaws, so the model does too; its tilt turns."""
    used = controller()
    step(used, 0.1, told([[3.0, 3.0, 0.0, 0.0]]))
    before = used.memory.attitude
    for count in range(1, 20):
        step(used, 0.1, BAD, yaw_rad=0.05 * count)
        assert used.memory.attitude.command.tolist() == before.command.tolist()
    assert used.memory.attitude.sine[0] == pytest.approx(np.sin(0.95))


@pytest.mark.parametrize("scalar", ["float32", "float64", "fixed"])
def test_the_command_of_the_step_may_be_set(scalar: str) -> None:
    """`report_command` of what the step returned changes no bit, with rate feedback and at the tilt limit."""
    used, other = controller(scalar), controller(scalar)
    rng = np.random.default_rng(3)
    for _ in range(50):
        roll_rad, target = rng.uniform(-0.1, 0.1), told(rng.uniform(-1.0, 1.0, (1, 4)))
        command_rad = step(used, roll_rad, target).command_rad
        assert step(other, roll_rad, target).command_rad.tolist() == command_rad.tolist()
        assert used.report_command(command_rad)[0] == Status.OK
        for field in fields(used.memory.attitude):
            numbers = (getattr(each.memory.attitude, field.name).tolist() for each in (used, other))
            assert next(numbers) == next(numbers)


def test_another_command_changes_the_model_by_the_difference() -> None:
    """What rate feedback added still counts: the attitude answered it."""
    used = controller("float64")
    step(used, 0.0, east(0.2))
    command_rad = step(used, 0.02, east(0.2)).command_rad
    before = used.memory.attitude.command
    used.report_command(command_rad - [[0.05, 0.02]])
    changed = used.memory.attitude.command - before
    assert changed[0] == pytest.approx(np.array([-0.05, 0.02]) * 9.81e-4)
