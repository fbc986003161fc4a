"""Fault injection between drone and controller: wrong inputs, missing updates, late commands, wrong weights.

A fault is a pure function of the controller's correct inputs. The wrappers below inject faults into n
controllers, one per flight, and have the interface of a position controller themselves.
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_nmpc.sil.controllers.compiled import CompiledController
from mambo_nmpc.sil.flight.loop import Outcome, PositionController
from mambo_nmpc.sil.plant.arrays import FloatArray, IntArray
from mambo_nmpc.sil.plant.link import NOT_CALLED


@dataclass(frozen=True, eq=False)
class ControllerInput:
    """Inputs of one controller at one update: state (7,), target (6,), thrust over mass."""

    state: FloatArray
    target: FloatArray
    thrust_acceleration_m_s2: float


Alter = Callable[[ControllerInput, ControllerInput, int], ControllerInput]
"""(correct inputs, correct inputs at the onset, updates since the onset) -> the controller's inputs."""

Drop = Callable[[int], bool]
"""Updates since the onset -> whether this update is dropped."""


def keep_inputs(now: ControllerInput, _began: ControllerInput, _since: int) -> ControllerInput:
    """Return the correct inputs."""
    return now


def freeze_state(now: ControllerInput, began: ControllerInput, _since: int) -> ControllerInput:
    """Repeat the state at the onset; target and thrust stay correct."""
    return replace(now, state=began.state)


def set_state(column: int | slice, value: float, *, on: int = 1, of: int = 1) -> Alter:
    """Overwrite columns of the state with `value` in the first `on` of every `of` updates."""

    def alter(now: ControllerInput, _began: ControllerInput, since: int) -> ControllerInput:
        state = now.state.copy()
        if since % of < on:
            state[column] = value
        return replace(now, state=state)

    return alter


def scale_state(scale: ArrayLike) -> Alter:
    """Multiply the state by `scale` (7,), as a wrong unit does."""
    return lambda now, _began, _since: replace(now, state=now.state * np.asarray(scale))


def shift_yaw(shift_rad: float) -> Alter:
    """Add `shift_rad` to the measured yaw."""
    shift = np.array([0.0] * 6 + [shift_rad])
    return lambda now, _began, _since: replace(now, state=now.state + shift)


def wrap_yaw(now: ControllerInput, _began: ControllerInput, _since: int) -> ControllerInput:
    """Wrap the measured yaw to [-pi, pi): it jumps where the heading passes south."""
    state = now.state.copy()
    state[6] = (state[6] + np.pi) % (2.0 * np.pi) - np.pi
    return replace(now, state=state)


def move_target(by_m: float) -> Alter:
    """Move the target along x."""
    shift = np.array([by_m, *[0.0] * 5])
    return lambda now, _began, _since: replace(now, target=now.target + shift)


def report_thrust(value_m_s2: float) -> Alter:
    """Overwrite the thrust acceleration."""
    return lambda now, _began, _since: replace(now, thrust_acceleration_m_s2=value_m_s2)


def drop_none(_since: int) -> bool:
    """Drop no update."""
    return False


def drop_all(_since: int) -> bool:
    """Drop every update."""
    return True


def drop_every(count: int) -> Drop:
    """Drop the first of every `count` updates."""
    return lambda since: since % count == 0


@dataclass(frozen=True, eq=False)
class Fault:
    """A fault from update `begin` until before update `end`; the first update of a flight is 0.

    alter:        computes the controller's inputs.
    drop:         decides at which updates the controller is not called; its last command is held.
    late_updates: delay of the commands in updates.
    """

    begin: int
    end: int
    alter: Alter = keep_inputs
    drop: Drop = drop_none
    late_updates: int = 0


@dataclass(frozen=True, eq=False)
class Applied:
    """What reaches the drone: command (n, 2) and status (n,), NOT_CALLED if the controller did not run."""

    command_rad: NDArray[np.floating[Any]]
    status: IntArray


class FaultyController:
    """n controllers with faults at their inputs and outputs; flight `row` has `faults[row]`.

    To drop an update of one controller in the batch, its state is NaN, and its row of `instances` (n, bytes),
    the controllers' memory, is restored. Without `instances` a controller must reject NaN and keep its
    memory, or have none, as the PD.
    """

    def __init__(
        self,
        controller: PositionController,
        faults: Sequence[Fault | None],
        instances: NDArray[np.uint8] | None = None,
    ) -> None:
        self._controller = controller
        self._instances = instances
        self._faults = [(row, fault) for row, fault in enumerate(faults) if fault is not None]
        self._began: dict[int, ControllerInput] = {}
        self._update = 0
        latest = max((fault.late_updates for _, fault in self._faults), default=0)
        level = np.zeros((len(faults), 2))
        self._computed = deque([level] * (latest + 1), maxlen=latest + 1)

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Applied:
        """Apply the faults to states (n, 7), targets (n, 4), thrusts (n,); step; delay the commands."""
        state, target, thrust = state.copy(), target.copy(), thrust_acceleration_m_s2.copy()
        called = np.ones(len(state), np.bool_)
        active = [(row, fault) for row, fault in self._faults if fault.begin <= self._update < fault.end]
        for row, fault in active:
            now = ControllerInput(state[row].copy(), target[row].copy(), float(thrust[row]))
            since = self._update - fault.begin
            given = fault.alter(now, self._began.setdefault(row, now), since)
            state[row], target[row], thrust[row] = given.state, given.target, given.thrust_acceleration_m_s2
            called[row] = not fault.drop(since)
        state[~called] = np.nan
        before = None if self._instances is None else self._instances.copy()
        outcome = self._controller.step(state, target, thrust)
        if self._instances is not None and before is not None:
            self._instances[~called] = before[~called]
        self._computed.append(np.where(called[:, np.newaxis], outcome.command_rad, self._computed[-1]))
        command_rad = self._computed[-1].copy()
        for row, fault in active:
            late = min(fault.late_updates, self._update - fault.begin + 1)
            command_rad[row] = self._computed[-1 - late][row]
        self._update += 1
        return Applied(command_rad, np.where(called, outcome.status, NOT_CALLED))


@dataclass(frozen=True)
class WeightChange:
    """New weights (tracking, effort) of flight `row`, set before update `update`."""

    row: int
    update: int
    weights: tuple[float, float]


class ReweightedController:
    """n controllers whose weights change in flight; `answers` records (row, status) of each change.

    Controllers of the batch whose weights stay receive NaN, which they reject.
    """

    def __init__(self, controller: CompiledController, n: int, changes: Sequence[WeightChange]) -> None:
        self._controller = controller
        self._n = n
        self._changes = changes
        self._update = 0
        self.answers: list[tuple[int, int]] = []

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Outcome:
        """Set the weights due at this update, and step."""
        due = [change for change in self._changes if change.update == self._update]
        if due:
            weights = np.full((self._n, 2), np.nan)
            for change in due:
                weights[change.row] = change.weights
            status = self._controller.set_weights(weights)
            self.answers += [(change.row, int(status[change.row])) for change in due]
        self._update += 1
        outcome: Outcome = self._controller.step(state, target, thrust_acceleration_m_s2)
        return outcome


class LevellingCaller:
    """A caller of n controllers that commands zero tilt after `patience` (n,) consecutive rejected steps.

    It also calls `reset` (`nmpc_reset`) with zero tilt, so that the first accepted step starts from there.
    """

    def __init__(
        self, controller: PositionController, reset: Callable[[ArrayLike], IntArray], patience: IntArray
    ) -> None:
        self._controller = controller
        self._reset = reset
        self._patience = patience
        self._refused = np.zeros(len(patience), np.int64)

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Applied:
        """Step; command zero tilt where `patience` steps in a row were rejected."""
        outcome = self._controller.step(state, target, thrust_acceleration_m_s2)
        self._refused = np.where(outcome.status != 0, self._refused + 1, 0)
        ended = self._refused == self._patience
        if ended.any():  # the other controllers receive NaN, which they reject
            self._reset(np.where(ended, 0.0, np.nan)[:, np.newaxis] * np.ones(2))
        levelled = (self._refused >= self._patience)[:, np.newaxis]
        return Applied(np.where(levelled, 0.0, outcome.command_rad), outcome.status)
