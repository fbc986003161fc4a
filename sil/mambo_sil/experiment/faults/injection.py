"""Fault injection between drone and controller.

The commands run its equal in C, `flight/engine/faults.c`, which has the same bits.

The wrappers below inject faults into n controllers, one per flight, and have the interface of a position
controller themselves. Each has a twin in C, sil/mambo_sil/flight/engine/faults.c, with the same bits.
"""

import math
from collections import deque
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_sil.drone.plant.arrays import FloatArray, IntArray
from mambo_sil.drone.plant.link import NOT_CALLED
from mambo_sil.experiment.faults.fault import (
    Alteration,
    ControllerInput,
    Fault,
    FreezeState,
    KeepInputs,
    ScaleState,
    SetState,
    SetThrust,
    ShiftState,
    ShiftTarget,
    WrapYaw,
)
from mambo_sil.flight.columns import SPACE
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.thrust_controller import Applied, adapted, hover_command, numbers_of
from mambo_sil.flight.engine.engine_library import ffi, pointer
from mambo_sil.flight.engine.native import Native, foreign, native
from mambo_sil.flight.loop import PositionController

_NONE: Final = Fault(0, 0)
_EFFECTS: Final = (KeepInputs, FreezeState, SetState, ScaleState, ShiftState, WrapYaw, ShiftTarget, SetThrust)
"""The alterations at the places that are their numbers in faults.c."""


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


def native_faulty(
    engine: Any,
    inner: Native,
    faults: Sequence[Fault | None],
    instances: NDArray[np.uint8] | None,
    hover: Sequence[float],
) -> Native:
    """Return n controllers with faults around `inner`.

    hover: the command before the first one, two or three numbers. `instances` as in `FaultyController`.
    """
    chosen = [fault or _NONE for fault in faults]
    first = (*hover, *[0.0] * (SPACE.command - len(hover)))
    histories = [np.tile(first, (fault.late_updates + 1, 1)) for fault in chosen]
    saved = None if instances is None else np.empty_like(instances[0])
    records = ffi.new("engine_faulty_t[]", len(chosen))
    for row, (fault, history) in enumerate(zip(chosen, histories, strict=True)):
        record = records[row]
        _fill_alteration(record, fault.alter)
        record.begin, record.end = fault.begin, fault.end
        record.drop_every, record.late_updates = fault.drop_every, fault.late_updates
        record.controller, record.self = inner.step, inner.instance(row)
        record.states, record.targets = inner.columns.state, inner.columns.target
        record.commands = inner.columns.command
        record.computed = pointer("double *", history)
        if instances is not None:
            record.memory, record.saved = (pointer("char *", array) for array in (instances[row], saved))
            record.memory_bytes = instances.shape[1]
    kept = histories, instances, saved
    return inner.wrapped(engine.engine_faulty_step, records, ffi.sizeof("engine_faulty_t"), kept)


def _fill_alteration(record: Any, alter: Alteration) -> None:
    """Fill the members of an engine_faulty_t that say what happens to the inputs."""
    values: tuple[float, ...] = ()
    record.on, record.of = 1, 1
    match alter:
        case SetState():
            values = (alter.value,)
            record.columns = (alter.columns.start, alter.columns.stop)
            record.on, record.of = alter.on, alter.of
        case ScaleState():
            values = alter.numbers
        case ShiftState() | ShiftTarget():
            values = alter.by
        case WrapYaw():
            values = (math.pi,)
        case SetThrust():
            values = (alter.value_m_s2,)
    record.effect = _EFFECTS.index(type(alter))
    record.values = (*values, *[0.0] * (len(record.values) - len(values)))


def native_levelling(engine: Any, inner: Native, compiled: CompiledController, patience: IntArray) -> Native:
    """Return n callers with `patience` (n,) around `inner` that reset `compiled`."""
    hover = hover_command(adapted(compiled))
    reset, level = compiled.native_reset([hover])
    memory = native(engine, compiled)
    records = ffi.new("engine_levelling_t[]", len(patience))
    for row, patient in enumerate(patience.tolist()):
        record = records[row]
        record.controller, record.self = inner.step, inner.instance(row)
        record.reset, record.memory = foreign("engine_setter_t", reset), memory.instance(row)
        record.level, record.patience = pointer("char *", level), patient
        record.hover, record.commands = (*hover, *[0.0] * (SPACE.command - len(hover))), len(hover)
    kept = memory, level
    return inner.wrapped(engine.engine_levelling_step, records, ffi.sizeof("engine_levelling_t"), kept)
