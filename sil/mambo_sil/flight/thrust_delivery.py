"""What the motors make of the thrust that a controller of the height commands: the mixer may cap it."""

from typing import Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile

CAPPED_SHARE: Final = 1e-6
"""A difference of this share of the weight is no rounding error: the thrust is another one than commanded."""


class ThrustDelivery:
    """The thrusts over the nominal mass of n drones in an update period."""

    def __init__(self, drone: VehicleFile, flights: int) -> None:
        self._mass_kg, self._least_n = drone.body.mass_kg, CAPPED_SHARE * drone.weight_n
        self._flights = flights
        self._begin()

    def _begin(self) -> None:
        self._ticks, self._sum_n = 0, np.zeros(self._flights)
        self._capped = np.zeros(self._flights, np.bool_)

    def note(self, wanted_n: FloatArray, given_n: FloatArray) -> None:
        """Note the thrusts (n,) that arrived at a tick, and those that the motors were commanded."""
        self._ticks += 1
        self._sum_n = self._sum_n + given_n
        self._capped |= np.abs(given_n - wanted_n) > self._least_n

    def report(self) -> FloatArray:
        """Return the mean since the last call (n,), NaN where the motors were commanded what arrived."""
        reported = np.full(self._flights, np.nan)
        if self._ticks:
            reported = np.where(self._capped, self._sum_n / self._ticks / self._mass_kg, np.nan)
        self._begin()
        return reported
