"""A hint that drones stay beside the height of their target: their thrust is not the one the loop assumes."""

import warnings
from typing import Final

import numpy as np

from mambo_sil.api.states import DroneState, TargetState
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile

REST_S: Final = 2.0
"""Time for which a drone must stay there, at rest in height, before the hint."""
REST_M_S: Final = 0.05
"""Largest climb at rest, of the drone and of its target."""
OFF_M, LOST_M = 0.03, 0.3
"""A drone that is off by less is near enough, one that is off by more has another fault."""


class HeightHint:
    """Watches n drones under an altitude loop without an integral; warns once."""

    def __init__(self, drone: VehicleFile, n: int, update_period_s: float) -> None:
        self._drone, self._update_period_s = drone, update_period_s
        self._rest_s, self._said = np.zeros(n), False

    def watch(self, state: DroneState, target: TargetState) -> None:
        """Look at states and targets with z; warn of the first drone that rests off its height."""
        if self._said:
            return
        off_m = (state.position_m[..., 2] - target.position_m[..., 2]).reshape(-1)
        rests = (np.abs(state.velocity_m_s[..., 2]).reshape(-1) < REST_M_S) & ~state.grounded.reshape(-1)
        rests &= np.abs(target.velocity_m_s[..., 2]).reshape(-1) < REST_M_S
        rests &= (np.abs(off_m) > OFF_M) & (np.abs(off_m) < LOST_M)
        self._rest_s = np.where(rests, self._rest_s + self._update_period_s, 0.0)
        if (found := np.flatnonzero(self._rest_s >= REST_S)).size:
            self._said = True
            warnings.warn(self._words(off_m[found[0]]), stacklevel=4)

    def _words(self, off_m: FloatArray) -> str:
        low = "below" if off_m > 0.0 else "above"
        share = abs(off_m) * self._drone.altitude.p_n_m / self._drone.weight_n
        less = "less thrust, or more mass," if off_m > 0.0 else "more thrust, or less mass,"
        return (
            f"a drone stays {1e3 * abs(off_m):.0f} mm {low} its target: it has {100.0 * share:.0f} % {less} "
            f"than vehicle {self._drone.name}; write its mass_kg and [thrust] into a vehicle.toml, or take "
            'height="pid"'
        )
