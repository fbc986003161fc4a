"""Faults between vehicle and controller: what it is handed, when it runs, when its command arrives.

A fault is a pure function of what a healthy controller would be handed. Wrappers put faults before n
controllers, one for each flight, and have themselves the interface of a position controller.
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_nmpc.sil.flight.loop import Outcome, PositionController
from mambo_nmpc.sil.plant.arrays import FloatArray, IntArray
from mambo_nmpc.sil.plant.link import NOT_CALLED


@dataclass(frozen=True, eq=False)
class ControllerInput:
    """What one controller is handed at one update: state (7,), target (4,), thrust over mass."""

    state: FloatArray
    target: FloatArray
    thrust_acceleration_m_s2: float


Alter = Callable[[ControllerInput, ControllerInput, int], ControllerInput]
"""The inputs now, those when the fault began, the updates since then -> what the controller is handed."""

Drop = Callable[[int], bool]
"""The updates since the fault began -> whether this one is left out."""


def untouched(now: ControllerInput, began: ControllerInput, since: int) -> ControllerInput:  # noqa: ARG001 - an Alter
    """Hand on the inputs as they are."""
    return now


def frozen_state(now: ControllerInput, began: ControllerInput, since: int) -> ControllerInput:  # noqa: ARG001 - an Alter
    """Repeat the state with which the fault began; target and thrust go on."""
    return replace(now, state=began.state)


def state_set_to(column: int | slice, value: float, *, on: int = 1, of: int = 1) -> Alter:
    """Overwrite columns of the state in the first `on` of every `of` updates."""

    def alter(now: ControllerInput, began: ControllerInput, since: int) -> ControllerInput:  # noqa: ARG001 - an Alter
        state = now.state.copy()
        if since % of < on:
            state[column] = value
        return replace(now, state=state)

    return alter


def state_scaled(scale: ArrayLike) -> Alter:
    """Multiply the state by `scale` (7,): the wrong unit."""

    def alter(now: ControllerInput, began: ControllerInput, since: int) -> ControllerInput:  # noqa: ARG001 - an Alter
        return replace(now, state=now.state * np.asarray(scale))

    return alter


def yaw_shifted(shift_rad: float) -> Alter:
    """Add `shift_rad` to the measured yaw."""

    def alter(now: ControllerInput, began: ControllerInput, since: int) -> ControllerInput:  # noqa: ARG001 - an Alter
        return replace(now, state=now.state + np.array([0.0] * 6 + [shift_rad]))

    return alter


def yaw_wrapped(now: ControllerInput, began: ControllerInput, since: int) -> ControllerInput:  # noqa: ARG001 - an Alter
    """Measure the yaw within half a turn of north: it jumps where the drone turns through south."""
    state = now.state.copy()
    state[6] = (state[6] + np.pi) % (2.0 * np.pi) - np.pi
    return replace(now, state=state)


def target_moved(by_m: float) -> Alter:
    """Move the target along x."""

    def alter(now: ControllerInput, began: ControllerInput, since: int) -> ControllerInput:  # noqa: ARG001 - an Alter
        return replace(now, target=now.target + np.array([by_m, 0.0, 0.0, 0.0]))

    return alter


def thrust_reported(value_m_s2: float) -> Alter:
    """Report this thrust acceleration, whatever it is."""

    def alter(now: ControllerInput, began: ControllerInput, since: int) -> ControllerInput:  # noqa: ARG001 - an Alter
        return replace(now, thrust_acceleration_m_s2=value_m_s2)

    return alter


def never(since: int) -> bool:  # noqa: ARG001 - a Drop
    """Leave no update out."""
    return False


def always(since: int) -> bool:  # noqa: ARG001 - a Drop
    """Leave every update out."""
    return True


def every(count: int) -> Drop:
    """Leave out the first of every `count` updates."""
    return lambda since: since % count == 0


@dataclass(frozen=True, eq=False)
class Fault:
    """What goes wrong from update `begin` to before update `end`, the first update of a flight being 0.

    alter:        what the controller is handed instead.
    drop:         at which updates it is not called; its command is held.
    late_updates: by how many updates its command comes late.
    """

    begin: int
    end: int
    alter: Alter = untouched
    drop: Drop = never
    late_updates: int = 0

    def active(self, update: int) -> bool:
        """Tell whether it lasts at this update."""
        return self.begin <= update < self.end


@dataclass(frozen=True, eq=False)
class Applied:
    """What reaches the vehicle: command (n, 2), and status (n,), NOT_CALLED where there is none."""

    command_rad: NDArray[np.floating[Any]]
    status: IntArray


class FaultyController:
    """n controllers with faults before them; flight `row` has `faults[row]`.

    A controller of a batch is left out by handing it a state that is not a number: it refuses such a state,
    and remembers nothing of it. One that knows no refusal must remember nothing at all, as the PD.
    """

    def __init__(self, controller: PositionController, faults: Sequence[Fault | None]) -> None:
        self._controller = controller
        self._faults = [(row, fault) for row, fault in enumerate(faults) if fault is not None]
        self._began: dict[int, ControllerInput] = {}
        self._update = 0
        latest = max((fault.late_updates for _, fault in self._faults), default=0)
        level = np.zeros((len(faults), 2))
        self._computed = deque([level] * (latest + 1), maxlen=latest + 1)

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Applied:
        """Let the controllers step on what is left of states (n, 7), targets (n, 4) and thrusts (n,)."""
        state, target, thrust = state.copy(), target.copy(), thrust_acceleration_m_s2.copy()
        called = np.ones(len(state), np.bool_)
        active = [(row, fault) for row, fault in self._faults if fault.active(self._update)]
        for row, fault in active:
            now = ControllerInput(state[row].copy(), target[row].copy(), float(thrust[row]))
            since = self._update - fault.begin
            given = fault.alter(now, self._began.setdefault(row, now), since)
            state[row], target[row], thrust[row] = given.state, given.target, given.thrust_acceleration_m_s2
            called[row] = not fault.drop(since)
        state[~called] = np.nan
        outcome = self._controller.step(state, target, thrust)
        self._computed.append(np.where(called[:, np.newaxis], outcome.command_rad, self._computed[-1]))
        command_rad = self._computed[-1].copy()
        for row, fault in active:
            late = min(fault.late_updates, self._update - fault.begin + 1)
            command_rad[row] = self._computed[-1 - late][row]
        self._update += 1
        return Applied(command_rad, np.where(called, outcome.status, NOT_CALLED))


class Reweightable(PositionController, Protocol):
    """A controller whose weights can be set in flight."""

    def set_weights(self, weights: ArrayLike) -> NDArray[np.int64]:
        """Replace tracking and effort weight by `weights` (n, 2); returns a status (n,)."""
        ...


@dataclass(frozen=True)
class WeightChange:
    """Flight `row` gets other weights (tracking, effort) before update `update`."""

    row: int
    update: int
    weights: tuple[float, float]


class ReweightedController:
    """n controllers whose weights somebody changes in flight; `answers` keeps (row, status) of each change.

    Controllers of the batch that keep their weights are handed NaN, which they refuse.
    """

    def __init__(self, controller: Reweightable, n: int, changes: Sequence[WeightChange]) -> None:
        self._controller = controller
        self._n = n
        self._changes = changes
        self._update = 0
        self.answers: list[tuple[int, int]] = []

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Outcome:
        """Set the weights that are due, and step."""
        due = [change for change in self._changes if change.update == self._update]
        if due:
            weights = np.full((self._n, 2), np.nan)
            for change in due:
                weights[change.row] = change.weights
            status = self._controller.set_weights(weights)
            self.answers += [(change.row, int(status[change.row])) for change in due]
        self._update += 1
        return self._controller.step(state, target, thrust_acceleration_m_s2)


class LevellingCaller:
    """A caller of n controllers who levels out after `patience` (n,) refused steps in a row.

    It commands level and starts the controller over from there by `reset` (`nmpc_reset`); the first step
    that is not refused flies on from level.
    """

    def __init__(
        self, controller: PositionController, reset: Callable[[ArrayLike], IntArray], patience: IntArray
    ) -> None:
        self._controller = controller
        self._reset = reset
        self._patience = patience
        self._refused = np.zeros(len(patience), np.int64)

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Applied:
        """Step, and level out where the patience is at its end."""
        outcome = self._controller.step(state, target, thrust_acceleration_m_s2)
        self._refused = np.where(outcome.status != 0, self._refused + 1, 0)
        ended = self._refused == self._patience
        if ended.any():  # the others are handed NaN, which they refuse
            self._reset(np.where(ended, 0.0, np.nan)[:, np.newaxis] * np.ones(2))
        levelled = (self._refused >= self._patience)[:, np.newaxis]
        return Applied(np.where(levelled, 0.0, outcome.command_rad), outcome.status)
