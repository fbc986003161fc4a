"""Crashes: a drone tilted too far or on the ground, which the simulation lets fly on."""

import math
from typing import Any, Final

import numpy as np
from pydantic import BaseModel, ConfigDict

from mambo_nmpc.sil.flight.traces import Trace
from mambo_nmpc.sil.plant.arrays import FloatArray
from mambo_nmpc.sil.plant.elementary import arc_cosine, sine_cosine
from mambo_nmpc.sil.plant.loops import THRUST_LIMIT_N, WEIGHT_N

CRASH_TILT_RAD: Final = float(arc_cosine(WEIGHT_N / THRUST_LIMIT_N))
"""Tilt beyond which the altitude loop's thrust limit no longer carries the weight: 59 degrees."""

_LEAST_LEVEL: Final = sine_cosine(CRASH_TILT_RAD)[1]


class Crash(BaseModel):
    """The first sample at which a drone had crashed, and how."""

    model_config = ConfigDict(frozen=True)

    time_s: float
    how: str


def detect_crashes(trace: Trace) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Return which flights (n,) were lost, tilted beyond `CRASH_TILT_RAD` or on the ground after t = 0."""
    level, height_m = _level_and_height(trace)
    aloft = (level > _LEAST_LEVEL) & (height_m > 0.0)
    return np.asarray(~aloft.all(axis=0))


def first_crash(trace: Trace, flight: int = 0) -> Crash | None:
    """Return when and how a flight first crashed after t = 0; None if it did not, or was lost without."""
    level, height_m = (values[:, flight] for values in _level_and_height(trace))
    tilted, grounded = level <= _LEAST_LEVEL, height_m <= 0.0
    crashed = tilted | grounded
    if not crashed.any():
        return None
    first = int(np.argmax(crashed))
    how = (
        "on the ground"
        if grounded[first]
        else f"tilted {math.degrees(arc_cosine(level[first])):.1f} degrees; beyond "
        f"{math.degrees(CRASH_TILT_RAD):.1f} the thrust limit no longer carries the weight"
    )
    return Crash(time_s=float(trace.time_s[trace.time_s >= 0.0][first]), how=how)


def _level_and_height(trace: Trace) -> tuple[FloatArray, FloatArray]:
    """Return the cosine of the tilt and the height in m, each (samples from t = 0 on, n)."""
    flown = trace.time_s >= 0.0
    angles_rad: FloatArray = trace.euler_rad[flown]
    _, (cos_roll, cos_pitch) = sine_cosine(np.moveaxis(angles_rad[..., :2], -1, 0))
    return cos_roll * cos_pitch, -trace.position_m[flown][..., 2]
