"""One update of a replay: a step of n controllers on an update of a log."""

from dataclasses import replace
from typing import Any, Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.model.replay.logged_inputs import LoggedInputs

_UPWARDS: Final = np.array([1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0])
_LEVEL: Final = [0, 1, 3, 4, 6]
"""A jump with the height upwards, and the columns of one without."""


def step(controller: CompiledController, inputs: LoggedInputs, k: int, states: FloatArray) -> Any:
    """Step n controllers at update `k` with `states` (n, m); return their step.

    A controller with a quadratic cost is told which command the log says was sent, so that an error of one
    command is none of the next ones.
    """
    n, settings = len(states), controller.settings
    commands_thrust = settings.height is not None
    if inputs.jump[k].any():
        change = inputs.jump[k] * _UPWARDS if commands_thrust else inputs.jump[k][_LEVEL]
        controller.shift(np.repeat(change[np.newaxis], n, axis=0))
    target = np.repeat(inputs.target[k : k + 1], n, axis=0)
    if inputs.shift[k].any():
        controller.shift(np.repeat(inputs.shift[k : k + 1], n, axis=0))
    done = controller.step(states, target, None if commands_thrust else np.repeat(inputs.thrust_m_s2[k], n))
    sent = np.repeat(inputs.command_rad[k : k + 1], n, axis=0)
    if inputs.levelled[k]:
        sent = np.zeros_like(sent)
        done = replace(done, command_rad=sent.astype(done.command_rad.dtype))
    if settings.cost.norm == "quadratic" and (inputs.is_logged[k] or inputs.levelled[k]):
        controller.set_command(np.column_stack([sent, done.thrust_m_s2]) if commands_thrust else sent)
    return done


def begin(controller: CompiledController, inputs: LoggedInputs, k: int) -> None:
    """Reset a controller to what it began with at update `k`: the attitude, with a height the thrust."""
    held = inputs.start_rad[k : k + 1]
    commands_thrust = controller.settings.height is not None
    controller.reset(np.column_stack([held, inputs.start_m_s2[k : k + 1]]) if commands_thrust else held)
