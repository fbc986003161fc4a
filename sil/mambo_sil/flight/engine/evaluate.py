"""What campaigns, searches and suites want to know of each flight of a trace.

The engine evaluates flights where there is a compiler, else NumPy, with the same bits.
"""

from dataclasses import dataclass, fields, replace
from typing import Any, Final

import numpy as np

from mambo_codegen.errors import BuildError
from mambo_codegen.toolchain import host_toolchain
from mambo_sil.drone.plant.arrays import FloatArray, IntArray
from mambo_sil.drone.plant.link import NOT_CALLED
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.crashes import LOW_TARGET_M, detect_crashes, least_level
from mambo_sil.flight.engine.engine_library import chosen_engine, ffi, lanes_for, load, pointer
from mambo_sil.flight.engine.simulate import trace_record
from mambo_sil.flight.metrics import Metrics, measure, saturated_share
from mambo_sil.flight.traces import SensedTrace, Trace

_METRICS: Final = tuple(field.name for field in fields(Metrics))


@dataclass(frozen=True, eq=False)
class Evaluation:
    """The results of n flights."""

    crashed: np.ndarray[Any, np.dtype[np.bool_]]
    """Whether a drone crashed or was lost (n,)."""
    refused: IntArray
    """Updates whose inputs the controller refused (n,)."""
    saturated_share: FloatArray
    """Share of the commands with roll or pitch at the tilt limit (n,)."""
    metrics: Metrics
    """Metrics of the true flight."""
    seen: Metrics | None
    """Metrics of the flight as the estimates tell it; None without sensors."""


def evaluate(trace: Trace, limit_rad: float, drone: VehicleFile) -> Evaluation:
    """Evaluate the flights of `drone` under commands that are limited to `limit_rad`.

    Raises CacheError and UnwritableError if the engine cannot be built for want of a folder or space.
    """
    if chosen_engine() == "c":
        try:
            toolchain = host_toolchain()
            return evaluate_compiled(
                load(toolchain, lanes_for(trace.flights, toolchain)), trace, limit_rad, drone
            )
        except BuildError:  # the simulation has warned of it
            pass
    return evaluate_numpy(trace, limit_rad, drone)


def evaluate_compiled(engine: Any, trace: Trace, limit_rad: float, drone: VehicleFile) -> Evaluation:
    """Evaluate flights in a library of `engine_library.load`; arguments as of `evaluate`."""
    updates, flights = trace.status.shape
    by_flight = {
        name: np.ascontiguousarray(array.swapaxes(0, 1)).swapaxes(0, 1)
        for name, array in vars(trace).items()
        if name not in ("time_s", "target")
    }
    times_s = np.ascontiguousarray(trace.time_s)
    targets = np.empty((flights, updates, 3))
    targets[..., :2] = trace.target[..., :2].swapaxes(0, 1)
    targets[..., 2] = trace.target_height_m.T
    how = ffi.new(
        "engine_evaluation_t *",
        {
            "flights": flights,
            "updates": updates,
            "first_update": int(np.count_nonzero(trace.time_s < 0.0)),
            "not_called": NOT_CALLED,
            "limit_rad": limit_rad,
            "least_level": least_level(drone),
            "low_target_m": LOW_TARGET_M,
        },
    )
    counts = {name: np.empty(flights, np.int64) for name in ("crashed", "refused", "saturated")}
    metrics = np.empty((flights, len(_METRICS)))
    seen = np.empty((flights, len(_METRICS))) if isinstance(trace, SensedTrace) else None
    results = ffi.new(
        "engine_results_t *",
        {name: pointer("int64_t *", array) for name, array in counts.items()}
        | {"metrics": pointer("double *", metrics), "seen_metrics": pointer("double *", seen)},
    )
    record = trace_record(replace(trace, **by_flight))
    for index in range(0, flights, int(engine.engine_lanes())):
        engine.engine_evaluate(
            how, index, pointer("double *", times_s), pointer("double *", targets), record, results
        )
    return Evaluation(
        crashed=counts["crashed"].astype(np.bool_),
        refused=counts["refused"],
        saturated_share=counts["saturated"] / updates,
        metrics=Metrics(*metrics.T),
        seen=None if seen is None else Metrics(*seen.T),
    )


def evaluate_numpy(trace: Trace, limit_rad: float, drone: VehicleFile) -> Evaluation:
    """Evaluate flights in NumPy; arguments as of `evaluate`."""
    return Evaluation(
        crashed=detect_crashes(trace, drone),
        refused=np.sum((trace.status != 0) & (trace.status != NOT_CALLED), axis=0),
        saturated_share=saturated_share(trace.command_rad, limit_rad),
        metrics=measure(trace),
        seen=measure(trace.as_seen()) if isinstance(trace, SensedTrace) else None,
    )
