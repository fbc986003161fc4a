"""Crashes: a drone tilted too far, or on the ground where it should not be; the simulation goes on."""

import math
from typing import Any, Final, TypeAlias

import numpy as np
from pydantic import BaseModel, ConfigDict

from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.elementary import arc_cosine, sine_cosine
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.traces import Trace

Bools: TypeAlias = np.ndarray[Any, np.dtype[np.bool_]]

LOW_TARGET_M: Final = 0.5
"""A drone may be on the ground while its target is no higher: before a take-off, after a landing."""


def crash_tilt_rad(drone: VehicleFile) -> float:
    """Return the tilt beyond which the largest thrust does not carry the weight.

    That of the Mambo is 59 degrees.
    """
    return float(arc_cosine(drone.weight_n / drone.largest_thrust_n))


class Crash(BaseModel):
    """The first sample at which a drone had crashed, and how."""

    model_config = ConfigDict(frozen=True)

    time_s: float
    how: str


def detect_crashes(trace: Trace, drone: VehicleFile = NOMINAL) -> Bools:
    """Return which flights (n,) were lost, tilted beyond `crash_tilt_rad` or on the ground after t = 0."""
    level, height_m, low = _level_and_height(trace)
    safe = (level > least_level(drone)) & ((height_m > 0.0) | (low & (height_m <= 0.0)))
    return np.asarray(~safe.all(axis=0))


def first_crash(trace: Trace, flight: int = 0, drone: VehicleFile = NOMINAL) -> Crash | None:
    """Return when and how a flight first crashed after t = 0; None if it did not, or was lost without."""
    levels, heights_m, low = _level_and_height(trace)
    level, height_m = levels[:, flight], heights_m[:, flight]
    tilted, grounded = level <= least_level(drone), (height_m <= 0.0) & ~low[:, flight]
    crashed = tilted | grounded
    if not crashed.any():
        return None
    first = int(np.argmax(crashed))
    how = (
        "on the ground"
        if grounded[first]
        else f"tilted {math.degrees(arc_cosine(level[first])):.1f} degrees; beyond "
        f"{math.degrees(crash_tilt_rad(drone)):.1f} the thrust limit no longer carries the weight"
    )
    return Crash(time_s=float(trace.time_s[trace.time_s >= 0.0][first]), how=how)


def least_level(drone: VehicleFile) -> float:
    """Return the cosine of the tilt beyond which a drone crashes."""
    return float(sine_cosine(crash_tilt_rad(drone))[1])


def _level_and_height(trace: Trace) -> tuple[FloatArray, FloatArray, Bools]:
    """Return cosine of tilt, height in m, whether the target is low, each (samples from t = 0 on, n)."""
    flown = trace.time_s >= 0.0
    angles_rad: FloatArray = trace.euler_rad[flown]
    _, (cos_roll, cos_pitch) = sine_cosine(np.moveaxis(angles_rad[..., :2], -1, 0))
    low = trace.target_height_m[flown] <= LOW_TARGET_M
    return cos_roll * cos_pitch, -trace.position_m[flown][..., 2], low
