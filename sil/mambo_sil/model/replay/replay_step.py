"""Step controllers through what a log says of an update."""

from dataclasses import replace
from typing import Any, Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.model.replay.logged_inputs import LoggedInputs

_UPWARDS: Final = np.array([1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0])
_LEVEL: Final = [0, 1, 3, 4, 6]
"""A jump with the height upwards, and the columns of one without."""


def step(
    controller: CompiledController,
    inputs: LoggedInputs,
    k: int,
    states: FloatArray,
    others: tuple[FloatArray, FloatArray] | None = None,
) -> Any:
    """Step n controllers at update `k` with `states` (n, m); return their step.

    A controller with a quadratic cost is told which command the log says was sent, so that an error of one
    command is none of the next ones. `others` replaces targets (n, j) and commands (n, axes) of the log.
    """
    n, settings = len(states), controller.settings
    if k in inputs.limits:
        controller.set_limits(np.repeat(inputs.limits[k][np.newaxis], n, axis=0))
    commands_thrust = settings.height is not None
    if inputs.jump[k].any():
        change = inputs.jump[k] * _UPWARDS if commands_thrust else inputs.jump[k][_LEVEL]
        controller.frame_jumped(np.repeat(change[np.newaxis], n, axis=0))
    target, sent = others or (np.repeat(one[k : k + 1], n, axis=0) for one in (inputs.target, inputs.command))
    target = np.column_stack([target, np.repeat(inputs.known[k : k + 1], n, axis=0)])
    if inputs.shift[k].any():
        controller.frame_jumped(np.repeat(inputs.shift[k : k + 1], n, axis=0))
    done = controller.step(states, target, None if commands_thrust else np.repeat(inputs.thrust_m_s2[k], n))
    if inputs.levelled[k]:
        sent = np.zeros((n, 2))
        done = replace(done, command_rad=sent.astype(done.command_rad.dtype))
    if settings.controller.method == "quadratic" and (inputs.is_logged[k] or inputs.levelled[k]):
        lacks_thrust = commands_thrust and sent.shape[1] == 2
        controller.report_command(np.column_stack([sent, done.thrust_m_s2]) if lacks_thrust else sent)
    return done


def begin(controller: CompiledController, inputs: LoggedInputs, k: int) -> None:
    """Reset controllers to what the one of the log began with at update `k`: the attitude, and the thrust."""
    held = inputs.start_rad[k : k + 1]
    if controller.settings.height is not None:
        held = np.column_stack([held, inputs.start_m_s2[k : k + 1]])
    controller.reset(np.repeat(held, controller.n, axis=0))


def begin_late(controller: CompiledController, inputs: LoggedInputs, k: int, numbers: list[int]) -> None:
    """Begin some of the controllers anew at update `k`, at the attitude as measured and the logged thrust."""
    held = inputs.state[k : k + 1, 4:6]
    if controller.settings.height is not None:
        held = np.column_stack([held, inputs.thrust_m_s2[k : k + 1]])
    before = controller.instances.copy()
    controller.reset(np.repeat(held, controller.n, axis=0))
    others = np.setdiff1d(np.arange(controller.n), numbers)
    controller.instances[others] = before[others]


def command_of(done: Any, inputs: LoggedInputs) -> FloatArray:
    """Return the commands (n, axes) of a step that the log has: roll and pitch, and the thrust over mass."""
    if not inputs.has_thrust:
        return np.asarray(done.command_rad, np.float64)
    return np.column_stack([done.command_rad, done.thrust_m_s2]).astype(np.float64)
