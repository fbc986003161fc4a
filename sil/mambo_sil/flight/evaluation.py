"""What campaigns, searches and suites want to know of each flight of a trace."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray, IntArray
from mambo_sil.drone.plant.link import NOT_CALLED
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.crashes import detect_crashes
from mambo_sil.flight.metrics import Metrics, measure, saturated_share
from mambo_sil.flight.traces import SensedTrace, Trace


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
    """Evaluate the flights of `drone` under commands that are limited to `limit_rad`."""
    return Evaluation(
        crashed=detect_crashes(trace, drone),
        refused=np.sum((trace.status != 0) & (trace.status != NOT_CALLED), axis=0),
        saturated_share=saturated_share(trace.command_rad, limit_rad),
        metrics=measure(trace),
        seen=measure(trace.as_seen()) if isinstance(trace, SensedTrace) else None,
    )
