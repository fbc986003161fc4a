"""The estimator of an autopilot: its velocity errs slowly, and its position goes astray with it.

    e' = -e / T + noise, with standard deviation S        error of the velocity, each axis
    p' = e - p / T                                        error of the position

S is `velocity_error_m_s`, T `velocity_error_s`. That is what a filter of inertial measurements does which
corrects its position by cameras or satellites, not the noise of a sensor.
"""

from typing import Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.elementary import exponential
from mambo_sil.drone.plant.randomness import Draws, Purpose
from mambo_sil.drone.vehicles.vehicle_sections import AutopilotSensors

AXES: Final = 3


class EstimatorErrors:
    """The errors of one estimator; call `advance` once in each tick."""

    def __init__(self, figures: AutopilotSensors, seed: int, step_s: float) -> None:
        self._step_s, self._time_s = step_s, figures.velocity_error_s
        self._keep = float(exponential(np.array(-step_s / figures.velocity_error_s)))
        self._noise_m_s = figures.velocity_error_m_s * float(np.sqrt(1.0 - self._keep * self._keep))
        self._draws = Draws((seed,), Purpose.SENSORS, AXES)
        self.position_m: FloatArray = np.zeros(AXES)
        self.velocity_m_s: FloatArray = np.zeros(AXES)

    def advance(self) -> None:
        """Let a tick pass."""
        drift_m_s = self.velocity_m_s - self.position_m / self._time_s
        self.position_m = self.position_m + self._step_s * drift_m_s
        self.velocity_m_s = self._keep * self.velocity_m_s + self._noise_m_s * self._draws.next()[:, 0]
