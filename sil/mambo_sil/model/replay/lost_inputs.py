"""The inputs of updates that a log has lost, estimated from the commands that it has."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.model.replay.logged_inputs import LoggedInputs
from mambo_sil.model.replay.replay_step import step

BLOCK: Final = 100
"""Updates whose lost states are estimated at once."""
AHEAD: Final = 50
"""Further updates whose commands are read for that."""
DRAWS: Final = 12
"""Flights that are drawn, of those that the log may be of."""
ESTIMATED: Final = 4
"""Numbers of a state: position and velocity along x and y. Angles and height are slower, and interpolated."""
_LEAST_SPREAD: Final = 1e-6
COMMAND_NOISE_RAD: Final = 2e-4
"""Standard deviation of what the model leaves of a command: slopes are of small changes, and the other
columns of a lost row are interpolated."""

Block = tuple[int, int, int]
"""First and end of the updates to replay, and the end of those to estimate the lost states by."""


class LostInputs:
    """Estimates the states that a log has lost from the commands that it has, block by block.

    The controller itself is the model: its commands behind a lost row depend on the position and velocity
    that it read there. A batch of controllers, each with one of these numbers changed, gives the slopes, and
    least squares the numbers; how well a row between two others is interpolated is their prior.
    """

    def __init__(self, inputs: LoggedInputs, settings: Settings, most: int) -> None:
        """Take a log that has lost `most` updates in the worst block."""
        self._inputs = inputs
        self._batch = CompiledController(settings, 1 + ESTIMATED * most)
        spread = inputs.spread[:, :ESTIMATED].copy()
        self._deviation = np.maximum(spread, _LEAST_SPREAD)
        self.drawn = np.zeros((DRAWS, *spread.shape))
        """Errors (draws, k, 4) of the numbers of a state that the commands leave possible."""
        self._random = np.random.default_rng(1)

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
        precision = slopes.T @ slopes + np.eye(count)
        change = np.linalg.solve(precision, slopes.T @ left)
        drawn = np.linalg.solve(np.linalg.cholesky(precision).T, self._random.normal(size=(count, DRAWS)))
        self.drawn[:, lost] = drawn.T.reshape(DRAWS, -1, ESTIMATED) * self._deviation[lost]
        estimated = state.copy()
        estimated[lost, :ESTIMATED] += change.reshape(-1, ESTIMATED) * self._deviation[lost]
        return estimated


def blocks_of(inputs: LoggedInputs) -> Iterator[Block]:
    """Yield the blocks of a log.

    One begins where the controller does, and ends at the latest with the last update before a gap.
    """
    there = np.flatnonzero(inputs.is_logged)
    starts = sorted({there[0], *np.flatnonzero(inputs.begins & (np.arange(len(inputs.begins)) > there[0]))})
    for start, following in zip(starts, [*starts[1:], there[-1] + 1], strict=True):
        end = there[np.searchsorted(there, following) - 1] + 1
        for first in range(start, end, BLOCK):
            yield first, min(first + BLOCK, end), min(first + BLOCK + AHEAD, end)
