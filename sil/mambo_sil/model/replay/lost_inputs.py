"""Estimate the states that a log has lost from the commands that it has.

The controller itself is the model: its commands behind a lost row depend on the position and velocity that
it read there. A batch of controllers, each with one of these numbers changed, gives the slopes, and least
squares the numbers; how well a row between two others is interpolated is their prior.
"""

from typing import Final

import numpy as np

from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.model.replay.logged_inputs import LoggedInputs
from mambo_sil.model.replay.stepping import step

BLOCK: Final = 100
"""Updates whose lost states are estimated at once."""
AHEAD: Final = 50
"""Further updates whose commands are read for that."""
ESTIMATED: Final = 4
"""Numbers of a state: position and velocity along x and y. Angles and height are slower, and interpolated."""
COMMAND_NOISE_RAD: Final = 2e-5
"""Standard deviation of what the model leaves of a command."""


class LostInputs:
    """Estimates the lost states of one log, block by block, through a batch of controllers."""

    def __init__(self, inputs: LoggedInputs, settings: Settings, most: int) -> None:
        """Take a log that has lost `most` updates in the worst block."""
        self._inputs = inputs
        self._batch = CompiledController(settings, 1 + ESTIMATED * most)
        self._deviation = _deviation(inputs)

    def estimate(self, first: int, end: int, controller: CompiledController, state: FloatArray) -> FloatArray:
        """Return `state` (k, n) with the lost rows of first..end - 1 and of what follows estimated.

        No update but the first of these may begin anew; `controller` is as before the first, and stays so.
        """
        inputs, batch = self._inputs, self._batch
        lost = first + np.flatnonzero(~inputs.is_logged[first:end])
        count = ESTIMATED * len(lost)
        if not count:
            return state
        batch.instances[:] = controller.instances
        changes = dict(zip(lost.tolist(), np.arange(count).reshape(-1, ESTIMATED), strict=True))
        commands = []
        for k in range(first, end):
            states = np.repeat(state[k : k + 1], batch.n, axis=0)
            if k in changes:
                states[1 + changes[k], np.arange(ESTIMATED)] += self._deviation[k]
            commands.append(step(batch, inputs, k, states).command_rad[: 1 + count])
        there = inputs.is_logged[first:end]
        found = np.asarray(commands, np.float64)[there]
        slopes = (found[:, 1:] - found[:, :1]).transpose(0, 2, 1).reshape(-1, count) / COMMAND_NOISE_RAD
        left = (inputs.command_rad[first:end][there] - found[:, 0]).reshape(-1) / COMMAND_NOISE_RAD
        change = np.linalg.solve(slopes.T @ slopes + np.eye(count), slopes.T @ left)
        estimated = state.copy()
        estimated[lost, :ESTIMATED] += change.reshape(-1, ESTIMATED) * self._deviation[lost]
        return estimated


def _deviation(inputs: LoggedInputs) -> FloatArray:
    """Return the standard deviations (k, 4) of interpolated positions and velocities.

    They are those of rows that are there from the mean of the rows beside them, times the distance to the
    next row that is there.
    """
    there, state = inputs.is_logged, inputs.state[:, :ESTIMATED]
    middle = there[:-2] & there[1:-1] & there[2:]
    error = (state[1:-1] - 0.5 * (state[:-2] + state[2:]))[middle]
    spread = np.sqrt((error * error).mean(axis=0)) if len(error) else np.zeros(ESTIMATED)
    rows, places = np.arange(len(there)), np.flatnonzero(there)
    after = places[np.minimum(np.searchsorted(places, rows), len(places) - 1)]
    before = places[np.maximum(np.searchsorted(places, rows, side="right") - 1, 0)]
    distance = np.minimum(np.abs(after - rows), np.abs(rows - before))
    return np.asarray(np.maximum(spread, 1e-6) * distance[:, np.newaxis])
