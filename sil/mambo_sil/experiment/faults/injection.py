"""Fault injection between drone and controller.

The wrappers below inject faults into n controllers, one per flight, and have the interface of a position
controller themselves. Each has a twin in C, sil/mambo_sil/flight/engine/faults.c, with the same bits.
"""

from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mambo_sil.drone.plant.arrays import FloatArray, IntArray
from mambo_sil.drone.plant.link import NOT_CALLED
from mambo_sil.experiment.faults.fault import ControllerInput, Fault
from mambo_sil.experiment.faults.faults_in_c import native_faulty, native_levelling
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.thrust_controller import Applied, adapted, hover_command, numbers_of
from mambo_sil.flight.engine.native import Native
from mambo_sil.flight.loop import PositionController


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
        self.controller = adapted(controller)
        self._instances = instances
        self._given = faults
        self._faults = [(row, fault) for row, fault in enumerate(faults) if fault is not None]
        self._began: dict[int, ControllerInput] = {}
        self._update = 0
        latest = max((fault.late_updates for _, fault in self._faults), default=0)
        level = np.tile(hover_command(self.controller), (len(faults), 1))
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
            called[row] = not fault.drops(since)
        state[~called] = np.nan
        before = None if self._instances is None else self._instances.copy()
        outcome = self.controller.step(state, target, thrust)
        if self._instances is not None and before is not None:
            self._instances[~called] = before[~called]
        self._computed.append(np.where(called[:, np.newaxis], numbers_of(outcome), self._computed[-1]))
        command = self._computed[-1].copy()
        for row, fault in active:
            late = min(fault.late_updates, self._update - fault.begin + 1)
            command[row] = self._computed[-1 - late][row]
        self._update += 1
        return Applied.of(command, np.where(called, outcome.status, NOT_CALLED))

    def wrap(self, engine: Any, inner: Native) -> Native:
        """Return the same around `inner` in the engine, for one flight of each controller from its start."""
        return native_faulty(engine, inner, self._given, self._instances, hover_command(self.controller))


class LevellingCaller:
    """A caller of n controllers that commands zero tilt after `patience` (n,) consecutive rejected steps.

    It also resets `compiled` (`nmpc_reset`) to zero tilt, so that the first accepted step starts from there;
    with a controller of the height, to hover.
    """

    def __init__(
        self, controller: PositionController, compiled: CompiledController, patience: IntArray
    ) -> None:
        self.controller = adapted(controller)
        self._level = np.array(hover_command(self.controller))
        self._compiled = compiled
        self._patience = patience
        self._refused = np.zeros(len(patience), np.int64)

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Applied:
        """Step; command zero tilt where `patience` steps in a row were rejected."""
        outcome = self.controller.step(state, target, thrust_acceleration_m_s2)
        self._refused = np.where(outcome.status != 0, self._refused + 1, 0)
        ended = self._refused == self._patience
        if ended.any():  # the other controllers receive NaN, which they reject
            self._compiled.reset(np.where(ended[:, np.newaxis], self._level, np.nan))
        levelled = (self._refused >= self._patience)[:, np.newaxis]
        return Applied.of(np.where(levelled, self._level, numbers_of(outcome)), outcome.status)

    def wrap(self, engine: Any, inner: Native) -> Native:
        """Return the same around `inner` in the engine, for one flight of each controller from its start."""
        return native_levelling(engine, inner, self._compiled, self._patience)
