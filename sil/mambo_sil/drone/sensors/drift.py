"""The estimates of n filters of inertial measurements: the velocity errs slowly, the position goes astray.

The commands run its equal in C, `flight/engine/drift.h`, which has the same bits.

    e' = -e / T + noise, with standard deviation S        error of the velocity, each axis
    p' = e - p / C                                        error of the position

That is no noise of a sensor. The filter of an autopilot corrects its position by cameras or satellites: S is
`velocity_error_m_s`, T `velocity_error_s`, and C = T. Over a flow deck nothing measures x and y, so C is
infinite; the height is measured, with C = T and the S that gives `height_error_m`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_sil.drone.plant.arrays import FloatArray, PerFlight
from mambo_sil.drone.plant.elementary import exponential
from mambo_sil.drone.plant.randomness import Draws, Purpose
from mambo_sil.drone.plant.vehicle import Seen
from mambo_sil.drone.vehicles.vehicle_sections import AutopilotSensors, FlowDeckSensors

NOISES: Final = 3
"""Random numbers of a tick: velocity x, y, z."""


@dataclass(frozen=True, eq=False)
class DriftingEstimate:
    """Parameters of the estimates of n flights."""

    figures: AutopilotSensors | FlowDeckSensors
    noise_scale: PerFlight = 1.0
    """Factor on all errors, one value for all or an array (n,); 0 is free of errors."""


@dataclass(frozen=True)
class Fading:
    """How errors fade."""

    keep: float
    """Share of the velocity's error that is left after a tick."""
    corrected_s: tuple[float, float, float]
    """C of each axis."""


def fading(figures: AutopilotSensors | FlowDeckSensors, step_s: float) -> Fading:
    """Return how errors fade with ticks of `step_s`."""
    time_s = figures.velocity_error_s
    level_s = np.inf if isinstance(figures, FlowDeckSensors) else time_s
    return Fading(float(exponential(np.array(-step_s / time_s))), (level_s, level_s, time_s))


def drift_deviations(drift: DriftingEstimate, flights: int, step_s: float) -> FloatArray:
    """Return the standard deviations of the velocity's noise in a tick (3, n)."""
    figures, keep = drift.figures, fading(drift.figures, step_s).keep
    level_m_s = upright_m_s = figures.velocity_error_m_s
    if isinstance(figures, FlowDeckSensors):
        upright_m_s = float(np.sqrt(2.0)) * figures.height_error_m / figures.velocity_error_s
    deviations = float(np.sqrt(1.0 - keep * keep)) * np.array([[level_m_s], [level_m_s], [upright_m_s]])
    return np.asarray(deviations * np.broadcast_to(np.asarray(drift.noise_scale, np.float64), flights))


class DriftSuite:
    """The estimates of n flights; call `estimate` once in each tick. They start from the true state."""

    def __init__(self, drift: DriftingEstimate, seeds: Sequence[int], step_s: float) -> None:
        self._step_s, self._fading = step_s, fading(drift.figures, step_s)
        self._noise_m_s = drift_deviations(drift, len(seeds), step_s)
        self._draws = Draws(seeds, Purpose.SENSORS, NOISES)
        self._position_m = np.zeros((NOISES, len(seeds)))
        self._velocity_m_s = np.zeros((NOISES, len(seeds)))

    def place(self, start: Seen, put: NDArray[np.bool_]) -> None:  # noqa: ARG002 - part of the interface
        """Start again with the drones that are `put` (n,) elsewhere, at their true state."""
        self._position_m = np.where(put, 0.0, self._position_m)
        self._velocity_m_s = np.where(put, 0.0, self._velocity_m_s)

    def estimate(self, true: Seen) -> Seen:
        """Return what the controllers receive at this tick."""
        gone_m_s = self._velocity_m_s - self._position_m / np.array(self._fading.corrected_s)[:, np.newaxis]
        self._position_m = self._position_m + self._step_s * gone_m_s
        noise_m_s = self._noise_m_s * self._draws.next()
        self._velocity_m_s = self._fading.keep * self._velocity_m_s + noise_m_s
        return Seen(
            true.position_m + self._position_m,
            true.velocity_m_s + self._velocity_m_s,
            true.euler_rad,
            true.rates_rad_s,
        )
