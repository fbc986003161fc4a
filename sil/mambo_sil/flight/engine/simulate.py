"""Fly simulations in the engine where controller and flight allow it, else in NumPy, with the same bits."""

import warnings
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from mambo_codegen.errors import BuildError
from mambo_codegen.toolchain import host_toolchain
from mambo_sil.drone.plant.randomness import Purpose, generators
from mambo_sil.drone.sensors import instruments, mocap
from mambo_sil.drone.sensors.mocap import MotionCapture
from mambo_sil.flight import loop
from mambo_sil.flight.engine.engine_library import chosen_engine, ffi, lanes_for, load, pointer
from mambo_sil.flight.engine.native import is_native, native
from mambo_sil.flight.engine.records import flight_records, in_lanes, simulation_record
from mambo_sil.flight.loop import Flight, PositionController, allocate_trace
from mambo_sil.flight.traces import Trace

DELAY_TICKS_MAX: Final = 200
"""Longest delay of a command that the engine can hold."""

Progress = Callable[[float], None]


def fly(
    flight: Flight,
    controller: PositionController,
    progress: Progress | None = None,
) -> Trace:
    """Simulate the flights and return their trace; call `progress` with the share done.

    Uses the engine unless `chosen_engine` is numpy, or the step of the controller is not a C function. On a
    machine without a compiler it warns and uses NumPy. Raises FlightError as `loop.fly`, and CacheError and
    UnwritableError if the engine cannot be built for want of a folder or space.
    """
    delay_ticks = int(np.max(flight.link.delay_ticks))
    if chosen_engine() == "c" and is_native(controller) and delay_ticks <= DELAY_TICKS_MAX:
        try:
            toolchain = host_toolchain()
            compiled = load(toolchain, lanes_for(flight.flights, toolchain))
        except BuildError as error:
            warnings.warn(f"{error}; the simulation runs in NumPy, which is slower", stacklevel=2)
        else:
            return fly_compiled(compiled, flight, controller, progress)
    return loop.fly(flight, controller, progress)


def fly_compiled(
    engine: Any, flight: Flight, controller: PositionController, progress: Progress | None = None
) -> Trace:
    """Simulate flights in a library of `engine_library.load`, group after group, with a controller in C."""
    lanes = int(engine.engine_lanes())
    times_s, targets = flight.times_s(), flight.given_targets
    simulation = simulation_record(flight, times_s)
    groups = in_lanes(flight_records(flight, targets[0]), lanes)
    trace = allocate_trace(times_s, targets[..., :4], sensed=flight.sensors is not None)
    ticks = len(times_s) * flight.ticks_per_update
    draws = _Buffers(flight, lanes, len(times_s), ticks)
    called = native(engine, controller)
    record = trace_record(trace)
    seeds = flight.seeds or (0,) * flight.flights
    for index, group in zip(range(0, flight.flights, lanes), groups, strict=True):
        engine.engine_fly(
            pointer("engine_simulation_t *", simulation),
            pointer("engine_flight_t *", group),
            index,
            pointer("double *", times_s),
            pointer("double *", _by_flight(targets)),
            draws.draw(seeds[index : index + lanes]),
            called.step,
            called.instance(index),
            called.stride,
            record,
        )
        if progress is not None:
            progress(min(index + lanes, flight.flights) / flight.flights)
    return trace


def trace_record(trace: Trace) -> Any:
    """Return the engine_trace_t of a trace whose samples of a flight are contiguous; the caller keeps it."""
    return ffi.new(
        "engine_trace_t *",
        {
            name: pointer(
                "int64_t *" if name == "status" else "double *", _by_flight(getattr(trace, name, None))
            )
            for name, _ in ffi.typeof("engine_trace_t").fields
        },
    )


def _by_flight(array: Any) -> Any:
    """Return an array (k, n, ...) of a trace as it lies in memory, (n, k, ...); None for None."""
    return None if array is None else array.swapaxes(0, 1)


class _Buffers:
    """Random numbers of one group at a time, from the same streams as in NumPy."""

    def __init__(self, flight: Flight, lanes: int, updates: int, ticks: int) -> None:
        width = mocap.NOISES if isinstance(flight.sensors, MotionCapture) else instruments.NOISES
        self.sensors = np.empty((lanes, ticks, width)) if flight.sensors is not None else None
        self.gusts = np.empty((lanes, ticks + 1, 3)) if flight.disturbances.windy else None
        self.drops = np.empty((lanes, updates)) if np.any(flight.link.dropped_share) else None
        self._record = ffi.new(
            "engine_draws_t *",
            {name: pointer("double *", getattr(self, name)) for name in ("sensors", "gusts", "drops")},
        )

    def draw(self, seeds: Sequence[int]) -> Any:
        """Return the engine_draws_t of the flights with these seeds; it is valid until the next call."""
        for purpose, buffer in ((Purpose.SENSORS, self.sensors), (Purpose.GUSTS, self.gusts)):
            if buffer is not None:
                for generator, lane in zip(generators(seeds, purpose), buffer, strict=False):
                    generator.standard_normal(out=lane)
        if self.drops is not None:
            for generator, lane in zip(generators(seeds, Purpose.DROPS), self.drops, strict=False):
                generator.random(out=lane)
        return self._record
