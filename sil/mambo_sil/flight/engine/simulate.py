"""Fly simulations in the engine where controller and flight allow it, else in NumPy, with the same bits."""

import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any, Final

import numpy as np

from mambo_codegen.errors import BuildError
from mambo_codegen.toolchain import host_toolchain
from mambo_sil.drone.plant.randomness import Purpose, generators
from mambo_sil.drone.sensors.suites import noises_of
from mambo_sil.errors import UserNotice
from mambo_sil.flight import loop
from mambo_sil.flight.controllers.thrust_controller import adapted
from mambo_sil.flight.engine.engine_library import chosen_engine, ffi, lanes_for, load, pointer
from mambo_sil.flight.engine.native import Native, called_back, can_call_back, is_native, native
from mambo_sil.flight.engine.records import flight_records, in_lanes, simulation_record
from mambo_sil.flight.loop import Flight, PositionController, allocate_trace
from mambo_sil.flight.traces import Trace

DELAY_TICKS_MAX: Final = 200
"""Longest delay of a command that the engine can hold."""

Progress = Callable[[float], None]


@dataclass(frozen=True, eq=False)
class GroupTrace:
    """The trace of some flights of a simulation with one of its controllers.

    controller: number of the controller.
    first:      number of the first flight.
    trace:      valid until the next group is flown, which overwrites its memory.
    """

    controller: int
    first: int
    trace: Trace


def fly(
    flight: Flight,
    controller: PositionController,
    progress: Progress | None = None,
) -> Trace:
    """Simulate the flights and return their trace; call `progress` with the share done.

    Uses the engine unless `chosen_engine` is numpy, or several flights have one controller in Python. On a
    machine without a compiler it warns and uses NumPy. Raises FlightError as `loop.fly`, what the controller
    raises, and CacheError and UnwritableError if the engine cannot be built for want of a folder or space.
    """
    controller = adapted(controller)
    engine = _engine(flight, [] if can_call_back(flight, controller) else [controller])
    if engine is None:
        return loop.fly(flight, controller, progress)
    return fly_compiled(engine, flight, controller, progress)


def fly_groups(
    flight: Flight, controllers: Sequence[PositionController], progress: Progress | None = None
) -> Iterator[GroupTrace]:
    """Simulate the flights with each controller and yield their traces, group after group.

    The random numbers of a group are drawn once for all controllers, and its traces have the same memory,
    which stays in the processor's cache. Engine, `progress` and errors as in `fly`; in NumPy all flights are
    one group.
    """
    controllers = [adapted(one) for one in controllers]
    engine = _engine(flight, controllers)
    if engine is not None:
        yield from _fly_groups(engine, flight, controllers, progress)
        return
    for number, controller in enumerate(controllers):
        report = None if progress is None else part_of(progress, number, len(controllers))
        yield GroupTrace(number, 0, loop.fly(flight, controller, report))


def part_of(progress: Progress, done: int, total: int, parts: int = 1) -> Progress:
    """Return what reports the share of the next `parts` of `total` equal parts as one of the whole."""
    return lambda share: progress((done + parts * share) / total)


def fly_compiled(
    engine: Any, flight: Flight, controller: PositionController, progress: Progress | None = None
) -> Trace:
    """Simulate flights in a library of `engine_library.load`, group after group.

    What a controller raises whose step is no C function ends the simulation.
    """
    simulation = _Simulation(engine, flight)
    trace, controller = simulation.allocate(flight.flights), adapted(controller)
    called, errors = (
        (native(engine, controller), [])
        if is_native(controller)
        else called_back(flight, controller, progress)
    )
    record = trace_record(trace)
    for first in simulation.firsts:
        simulation.draw(first)
        simulation.fly(first, called, record, first)
        if errors:
            raise errors[0]
        if progress is not None:
            progress(min(first + simulation.lanes, flight.flights) / flight.flights)
    return trace


def _fly_groups(
    engine: Any, flight: Flight, controllers: Sequence[PositionController], progress: Progress | None
) -> Iterator[GroupTrace]:
    simulation = _Simulation(engine, flight)
    called = [native(engine, controller) for controller in controllers]
    traces = cache(simulation.allocate)
    done = 0
    for first in simulation.firsts:
        size = min(simulation.lanes, flight.flights - first)
        trace = replace(traces(size), target=flight.traced_targets[:, first : first + size])
        record = trace_record(trace)
        simulation.draw(first)
        for number, one in enumerate(called):
            simulation.fly(first, one, record, 0)
            yield GroupTrace(number, first, trace)
            done += size
            if progress is not None:
                progress(done / (len(controllers) * flight.flights))


def _engine(flight: Flight, controllers: Sequence[PositionController]) -> Any:
    """Return the engine's library with the lanes that are fastest; None if NumPy must simulate.

    `controllers` are those that must be C functions.
    """
    delay_ticks = int(np.max(flight.link.delay_ticks))
    if chosen_engine() != "c" or delay_ticks > DELAY_TICKS_MAX or not all(map(is_native, controllers)):
        return None
    try:
        toolchain = host_toolchain()
        return load(toolchain, lanes_for(flight.flights, toolchain))
    except BuildError as error:
        warnings.warn(f"{error}; the simulation runs in NumPy, which is slower", UserNotice, stacklevel=3)
        return None


class _Simulation:
    """A simulation in the engine, group after group of as many flights as it has lanes."""

    def __init__(self, engine: Any, flight: Flight) -> None:
        self._engine, self._flight = engine, flight
        self.lanes = int(engine.engine_lanes())
        self.firsts = range(0, flight.flights, self.lanes)
        self._times_s = flight.times_s()
        self._records = cache(partial(simulation_record, flight, self._times_s))
        self._groups = in_lanes(flight_records(flight, flight.given_targets[0]), self.lanes)
        updates = len(self._times_s)
        self._buffers = _Buffers(flight, self.lanes, updates, updates * flight.ticks_per_update)
        self._seeds = flight.seeds or (0,) * flight.flights

    def allocate(self, flights: int) -> Trace:
        """Return a trace with the times, and the targets of the first flights."""
        targets = self._flight.traced_targets[:, :flights]
        return allocate_trace(self._times_s, targets, sensed=self._flight.sensors is not None)

    def draw(self, first: int) -> None:
        """Draw the random numbers of the group that begins with flight `first`."""
        self._draws = self._buffers.draw(self._seeds[first : first + self.lanes])

    def fly(self, first: int, called: Native, record: Any, place: int) -> None:
        """Fly the group that begins with flight `first`, and write its trace to `record` from `place` on."""
        flight = self._flight
        common, targets = self._records(called.columns), flight.targets_for(called.columns)
        common["flights"] = place + min(self.lanes, flight.flights - first)
        self._engine.engine_fly(
            pointer("engine_simulation_t *", common),
            pointer("engine_flight_t *", self._groups[first // self.lanes]),
            place,
            pointer("double *", self._times_s),
            pointer("double *", _by_flight(targets)[first - place :]),
            self._draws,
            called.step,
            called.instance(first),
            called.stride,
            record,
        )


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
        width = noises_of(flight.sensors)
        self.sensors = np.empty((lanes, ticks, width)) if width else None
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
