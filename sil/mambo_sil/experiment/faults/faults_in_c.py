"""Fill the engine's records of the wrappers in injection.py."""

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.numbers.gravity import hover_thrust
from mambo_sil.drone.plant.arrays import IntArray
from mambo_sil.experiment.faults.fault import (
    Alteration,
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
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.engine_library import ffi, pointer
from mambo_sil.flight.engine.native import Native, foreign, native

_NONE: Final = Fault(0, 0)
_EFFECTS: Final = (KeepInputs, FreezeState, SetState, ScaleState, ShiftState, WrapYaw, ShiftTarget, SetThrust)
"""The alterations at the places that are their numbers in faults.c."""


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
    histories = [np.tile((*hover, 0.0)[:3], (fault.late_updates + 1, 1)) for fault in chosen]
    saved = None if instances is None else np.empty_like(instances[0])
    records = ffi.new("engine_faulty_t[]", len(chosen))
    for row, (fault, history) in enumerate(zip(chosen, histories, strict=True)):
        record = records[row]
        _fill_alteration(record, fault.alter)
        record.begin, record.end = fault.begin, fault.end
        record.drop_every, record.late_updates = fault.drop_every, fault.late_updates
        record.controller, record.self = inner.step, inner.instance(row)
        record.commands_thrust, record.has_preview = inner.commands_thrust, inner.has_preview
        record.computed = pointer("double *", history)
        if instances is not None:
            record.memory, record.saved = (pointer("char *", array) for array in (instances[row], saved))
            record.memory_bytes = instances.shape[1]
    kept = inner, histories, instances, saved
    return Native(
        engine.engine_faulty_step, records, ffi.sizeof("engine_faulty_t"), kept, inner.commands_thrust
    )


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
    hover_m_s2 = hover_thrust(compiled.settings)
    reset, level = compiled.native_reset([(0.0, 0.0, hover_m_s2) if inner.commands_thrust else (0.0, 0.0)])
    memory = native(engine, compiled)
    records = ffi.new("engine_levelling_t[]", len(patience))
    for row, patient in enumerate(patience.tolist()):
        record = records[row]
        record.controller, record.self = inner.step, inner.instance(row)
        record.reset, record.memory = foreign("engine_setter_t", reset), memory.instance(row)
        record.level, record.patience = pointer("char *", level), patient
        record.hover_m_s2, record.commands_thrust = hover_m_s2, inner.commands_thrust
    kept = inner, memory, level
    return Native(
        engine.engine_levelling_step, records, ffi.sizeof("engine_levelling_t"), kept, inner.commands_thrust
    )
