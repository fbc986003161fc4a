"""Find the updates from which on limits that change in flight held."""

from dataclasses import replace
from typing import Final

import numpy as np

from mambo_codegen.settings.model import Settings
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.model.replay.logged_inputs import LoggedInputs
from mambo_sil.model.replay.replay_step import begin, command_of, step

_NEAR: Final = (0, -1, 1, -2, 2, -3, 3)
"""Updates by which the log may be wrong, since logger and controller read parameters on their own."""
_LOOK: Final = 20
"""Updates by whose commands the right one is found."""


def place_changes(inputs: LoggedInputs, settings: Settings) -> LoggedInputs:
    """Return `inputs` whose limits change where the commands of the log say so, near where the log does."""
    controller, k = CompiledController(settings), 0
    for change in inputs.changes:
        first, end = max(change + min(_NEAR), k), min(change + _LOOK, len(inputs.time_s))
        _run(controller, inputs, k, first)
        before, errors = controller.instances.copy(), []
        trials = [_moved(inputs, change, change + by) for by in _NEAR if first <= change + by < end]
        for trial in trials:
            errors.append(_run(controller, trial, first, end))
            controller.instances[:] = before
        if trials:
            inputs = trials[int(np.argmin(errors))]
        k = first
    return inputs


def _moved(inputs: LoggedInputs, change: int, to: int) -> LoggedInputs:
    """Return `inputs` whose limits change at the update `to`."""
    limits = dict(inputs.limits)
    limits[to] = limits.pop(change)
    return replace(inputs, limits=limits)


def _run(controller: CompiledController, inputs: LoggedInputs, first: int, end: int) -> float:
    """Step through updates; return the sum of the errors of the commands."""
    total = 0.0
    for k in range(first, end):
        if inputs.begins[k]:
            begin(controller, inputs, k)
        command = command_of(step(controller, inputs, k, inputs.state[k : k + 1]), inputs)[0]
        total += float(np.abs(command - inputs.command[k]).sum()) if inputs.is_logged[k] else 0.0
    return total
