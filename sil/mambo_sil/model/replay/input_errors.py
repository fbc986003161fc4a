"""What the replayed commands may be off because of what a log does not have.

The log is replayed as it may have been: with inputs and commands drawn within the rounding of each column, on
lost rows within the spread of what is filled, and, where the log does not have the state in which the
controller begins, with one that begins up to `LATEST_S` later.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.model.identify.resolution import Resolution, hardly_changes
from mambo_sil.model.identify.signals import COMMANDS, THRUST
from mambo_sil.model.replay.logged_inputs import LoggedInputs
from mambo_sil.model.replay.lost_inputs import DRAWS, ESTIMATED, Block
from mambo_sil.model.replay.replay_step import begin, begin_late, command_of, step

SETTLING_S: Final = 2.0
"""Time from a beginning of the controller in which its estimates approach the estimates of the flight."""
LATE: Final = DRAWS // 2
"""Drawn flights, the first ones, that begin later than the log where its beginning is unknown."""
LATEST_S: Final = 1.5
"""By how much the last of them does: what the controller did not know fades with about 2 s."""


@dataclass(frozen=True, eq=False)
class Filled:
    """The states (k, m) of a log, and drawn errors (draws, k, 4) of their first numbers.

    None where the lost ones are interpolated.
    """

    state: FloatArray
    drawn: FloatArray | None


@dataclass(frozen=True, eq=False)
class InputErrors:
    """Errors of the commands of a replay, by what the log does not have.

    drawn: of `DRAWS` flights that the log may be of, (draws, k, axes).
    alone: those that the rounding of one column makes, by its signal, (k, axes).
    """

    drawn: FloatArray
    alone: Mapping[str, FloatArray]
    resolutions: Mapping[str, Resolution]

    def at(self, there: NDArray[np.bool_]) -> "InputErrors":
        """Return the errors at some of the updates (k,)."""
        alone = {name: errors[there] for name, errors in self.alone.items()}
        return InputErrors(self.drawn[:, there], alone, self.resolutions)


def input_errors(
    inputs: LoggedInputs,
    filled: Filled,
    settings: Settings,
    blocks: Sequence[Block],
    is_unknown: NDArray[np.bool_],
) -> InputErrors | None:
    """Return what a replay may be off; None for a log that has all that the commands depend on.

    `is_unknown` says where the controller begins in a state that the log does not have (k,).
    """
    inputs, state = replace(inputs, state=filled.state), filled.state
    values = np.column_stack([_measured(inputs, state), inputs.target, inputs.command])
    resolutions = _resolutions(inputs, values)
    is_lost = bool((~inputs.is_logged).any())
    if not resolutions and not is_lost and not is_unknown.any():
        return None
    spread = inputs.spread.copy()
    spread[:, len(values[0]) - inputs.command.shape[1] :] = 0.0
    columns = [k for k, name in enumerate(inputs.names) if name in resolutions]
    batch = CompiledController(settings, 1 + DRAWS + len(columns))
    errors = np.zeros((batch.n - 1, *inputs.command.shape))
    generator = np.random.default_rng(0)
    late = _late_beginnings(is_unknown, round(LATEST_S / settings.horizon.update_period_s))
    for first, end, _ in blocks:
        noise = np.zeros((batch.n, end - first, values.shape[1]))
        noise[1 : DRAWS + 1] = spread[first:end] * _normal(~inputs.is_logged[first:end], values, generator)
        if filled.drawn is not None:
            noise[1 : DRAWS + 1, :, :ESTIMATED] = filled.drawn[:, first:end]
        for number, column in enumerate(columns):
            drawn = _drawn(values[first:end, column], resolutions[inputs.names[column]], generator)
            noise[1 : DRAWS + 1, :, column] += drawn[:DRAWS]
            noise[1 + DRAWS + number, :, column] = drawn[DRAWS]
        if inputs.begins[first]:
            begin(batch, inputs, first)
        errors[:, first:end] = _replay(batch, inputs, late, range(first, end), noise)
    alone = {inputs.names[column]: errors[DRAWS + number] for number, column in enumerate(columns)}
    return InputErrors(errors[:DRAWS], alone, resolutions)


def _late_beginnings(is_unknown: NDArray[np.bool_], most: int) -> dict[int, list[int]]:
    """Return the drawn flights that begin at an update, up to `most` updates behind an unknown beginning."""
    found: dict[int, list[int]] = {}
    for last in np.flatnonzero(is_unknown & ~np.append(is_unknown[1:], values=False)).tolist():
        for draw in range(1, LATE + 1):
            found.setdefault(last + max(draw * most // LATE, 1), []).append(draw)
    return found


def _replay(
    batch: CompiledController,
    inputs: LoggedInputs,
    late: Mapping[int, list[int]],
    updates: range,
    noise: FloatArray,
) -> FloatArray:
    """Step through `updates` with `noise` (n, k, columns), which the first has none of.

    Some begin at updates in `late`, and every other one is told of the floor where the drone may lie on it.
    Returns by what the commands of the others would be off (n - 1, k, axes).
    """
    measured, wanted = _measured(inputs, inputs.state).shape[1], inputs.target.shape[1]
    sent = measured + wanted
    states = np.zeros((batch.n, inputs.state.shape[1]))
    errors = noise[1:, :, sent:].copy()
    for number, k in enumerate(updates):
        now = noise[:, number]
        if k in late:
            begin_late(batch, inputs, k, late[k])
        states[:] = inputs.state[k]
        if inputs.may_lie[k]:
            states[1 : DRAWS + 1 : 2, -1] = 1.0
        states[:, :measured] += now[:, :measured]
        others = (inputs.target[k] + now[:, measured:sent], inputs.command[k] + now[:, sent:])
        command = command_of(step(batch, inputs, k, states, others), inputs)
        errors[:, number] += command[0] - command[1:]
    return errors


def _measured(inputs: LoggedInputs, state: FloatArray) -> FloatArray:
    """Return the columns of a state that a log has; of whether the drone lies it has 0 and 1."""
    return state[:, : len(inputs.names) - inputs.target.shape[1] - inputs.command.shape[1]]


def _resolutions(inputs: LoggedInputs, values: FloatArray) -> dict[str, Resolution]:
    """Return how the columns of `values` (k, columns) are rounded.

    An input that hardly changes is rounded as the coarsest other one.
    """
    found = {name: inputs.resolutions[name] for name in inputs.names if name in inputs.resolutions}
    others = [one for name, one in found.items() if name not in (*COMMANDS, THRUST)]
    if not others:
        return found
    coarsest = max(others, key=lambda one: float(one.spacing(np.ones(1))[0]))
    few = [
        name
        for name, column in zip(inputs.names, values.T, strict=True)
        if name not in found and name not in (*COMMANDS, THRUST) and hardly_changes(column)
    ]
    return found | dict.fromkeys(few, coarsest)


def _normal(is_lost: NDArray[np.bool_], values: FloatArray, generator: np.random.Generator) -> FloatArray:
    """Return draws (draws, k, columns) with a standard deviation of 1, for `values` (.., columns).

    Half of the variance of a gap is one of all its updates, as of a motion that curves.
    """
    gap = np.cumsum(np.diff(is_lost, prepend=False))
    own = generator.normal(size=(DRAWS, len(is_lost), values.shape[1]))
    shared = generator.normal(size=(DRAWS, int(gap[-1]) + 1, values.shape[1]))[:, gap]
    return np.asarray(np.sqrt(0.5) * (own + shared))


def _drawn(values: FloatArray, resolution: Resolution, generator: np.random.Generator) -> FloatArray:
    """Return by what `DRAWS` + 1 flights may differ from rounded values (k,): (draws, k).

    Equal values in a row differ by the same; zeros all the time are zeros.
    """
    if not values.any():
        return np.zeros((DRAWS + 1, len(values)))
    place = np.cumsum(np.diff(values, prepend=values[0]) != 0.0)
    share = generator.uniform(-0.5, 0.5, (DRAWS + 1, int(place[-1]) + 1))
    return np.asarray(share[:, place] * resolution.spacing(values))
