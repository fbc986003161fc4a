"""How the estimator of an autopilot errs: its position beside the one that its camera measured, from a log.

`mambo_sil.drone.sensors.autopilot` has the model: the error e of the velocity has standard deviation S and
correlation time T, and that of the position is p' = e - p / T. So p has the autocorrelation
S^2 T^2 / 2 (1 + t / T) exp(-t / T), which falls to 2 / e of its value at 0 at t = T.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.model.identify.signals import POSITION, SEEN, FlightLog, Signal
from mambo_sil.results.summary import Number

STEP_S: Final = 0.02
WINDOW_S, SHORTEST_S = 30.0, 20.0
"""Length of a window, and of the only one of a shorter stretch. The mean of each is subtracted: neither an
offset of the frames nor a jump counts; times of more than a second are then found 20 % too short."""
LONGEST_S: Final = 5.0
"""The longest correlation time that a window shows."""
Stretch = tuple[float, float]
"""Beginning and end, in s."""
_FALLEN: Final = 2.0 / math.e


@dataclass(frozen=True)
class VelocityErrors:
    """Of the velocity, the median of all windows and both axes."""

    velocity_m_s: Number
    correlation_s: Number


def estimator_errors(
    logs: Sequence[FlightLog], stretches: Sequence[Sequence[Stretch]]
) -> VelocityErrors | None:
    """Return the errors of the estimator in the stretches of each log.

    None if no window of them has a position that was seen.
    """
    windows = (
        error_m
        for log, own in zip(logs, stretches, strict=True)
        for stretch in own
        for error_m in _windows(log, stretch)
    )
    found = [one for error_m in windows if (one := _errors(error_m))]
    if not found:
        return None
    velocity_m_s, correlation_s = np.median(np.array(found), axis=0).tolist()
    return VelocityErrors(velocity_m_s=velocity_m_s, correlation_s=correlation_s)


def _windows(log: FlightLog, stretch: Stretch) -> Iterator[FloatArray]:
    """Yield the estimated position less the seen one in each window of a stretch, of each axis."""
    for estimated, seen in zip(POSITION, SEEN, strict=True):
        if estimated in log.signals and seen in log.signals:
            signals = log.signals[estimated], log.signals[seen]
            start_s = max(stretch[0], *(one.time_s[0] for one in signals))
            end_s = min(stretch[1], *(one.time_s[-1] for one in signals))
            if end_s - start_s < SHORTEST_S:
                continue
            for time_s in np.array_split(
                np.arange(start_s, end_s, STEP_S), max(1, int((end_s - start_s) / WINDOW_S))
            ):
                here, there = (_at(one, time_s) for one in signals)
                yield here - there


def _at(signal: Signal, time_s: FloatArray) -> FloatArray:
    return np.interp(time_s, signal.time_s, signal.value)


def _errors(error_m: FloatArray) -> tuple[float, float] | None:
    """Return S and T of one window; None if its errors are noise, or drift through the whole of it."""
    around_m = error_m - error_m.mean()
    lags = range(1, round(LONGEST_S / STEP_S))  # at 0 the camera's own noise counts
    correlation = np.array([np.mean(around_m[:-lag] * around_m[lag:]) for lag in lags])
    fallen = np.flatnonzero(correlation < _FALLEN * correlation[0])
    if correlation[0] < 0.5 * np.mean(around_m**2) or not len(fallen):
        return None
    correlation_s = STEP_S * lags[fallen[0]]
    return math.sqrt(2.0 * correlation[0]) / correlation_s, correlation_s
