"""Fly a curve of your own: a rose with three petals, in a plane, with its acceleration.

$ python own_curve.py
FlightResult(rms error 0.18 cm)
"""

import numpy as np

from mambo_nmpc import Controller, Vehicle, fly


class Rose:
    """r = size cos(3 a): position, velocity and acceleration at times of any shape."""

    def __init__(self, size_m: float, rate_rad_s: float) -> None:
        self._size_m, self._rate_rad_s = size_m, rate_rad_s

    def _turning(self, time_s: np.ndarray, order: int) -> np.ndarray:
        """Return a derivative of x and y (..., 2): a rose is the sum of two circles, of 4 and of -2 a."""
        found = np.zeros((*np.shape(time_s), 2))
        for times in (4.0, -2.0):
            rate = times * self._rate_rad_s
            angle = rate * np.asarray(time_s) + order * np.pi / 2.0  # the next derivative, a quarter turn on
            circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
            found += 0.5 * self._size_m * rate**order * circle
        return found

    def target(self, time_s: np.ndarray) -> np.ndarray:
        """Return x, y and their rates (..., 4)."""
        return np.concatenate([self._turning(time_s, 0), self._turning(time_s, 1)], axis=-1)

    def acceleration(self, time_s: np.ndarray) -> np.ndarray:
        """Return the accelerations (..., 2)."""
        return self._turning(time_s, 2)


flown = fly(
    Controller.from_vehicle("crazyflie"),
    Vehicle.from_preset("crazyflie"),
    Rose(1.5, 0.3),
    duration_s=21.0,
    sensors="mocap",
    measured_from_s=6.0,
)
print(flown)
