"""The thrust of an altitude loop of `mambo_sil.flight.altitude_loops`, over the mass, for programs."""

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.settings.model import Settings
from mambo_sil.api.height_hint import HeightHint
from mambo_sil.api.states import DroneState, TargetState
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Seen
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.altitude_loops import AltitudeLaw, AltitudeLoop, Vertical
from mambo_sil.flight.names import AltitudeName


class HeightHold:
    """The thrusts of n drones; a state that is no number leaves the thrust of its drone as it is."""

    def __init__(self, name: AltitudeName, drone: VehicleFile, settings: Settings, n: int) -> None:
        self.n, self._drone, ranges = n, drone, settings.ranges
        period_s = settings.horizon.update_period_s
        self._loop = AltitudeLoop(AltitudeLaw(name), drone, n, period_s)
        self._hint = None if name == "pid" else HeightHint(drone, n, period_s)
        self._bounds = ranges.thrust_acceleration_min_m_s2, ranges.thrust_acceleration_max_m_s2
        self._thrust_m_s2 = np.empty(n)
        self.reset(np.ones(n, np.bool_))

    def reset(self, which: NDArray[np.bool_]) -> None:
        """Forget the past of the drones in `which` (n,)."""
        self._loop.integral_n = np.where(which, 0.0, self._loop.integral_n)
        self._thrust_m_s2 = np.where(
            which, self._drone.weight_n / self._drone.body.mass_kg, self._thrust_m_s2
        )

    def step(self, state: DroneState, target: TargetState) -> FloatArray:
        """Return the thrust over mass (n,), in the range that the controller accepts; both records have z.

        Warns once of a drone that rests beside its target, if the loop has no integral.
        """
        if self._hint is not None:
            self._hint.watch(state, target)
        position, velocity, euler = (
            values.reshape(self.n, 3).T
            for values in (state.position_m, state.velocity_m_s, state.attitude_rad)
        )
        seen = Seen(position, velocity, euler, rates_rad_s=np.empty((3, 0)))
        thrust_m_s2 = self._loop.thrust_n(_vertical(target), seen) / self._drone.body.mass_kg
        known = np.isfinite(thrust_m_s2)
        self._thrust_m_s2 = np.where(known, np.clip(thrust_m_s2, *self._bounds), self._thrust_m_s2)
        return self._thrust_m_s2


def _vertical(target: TargetState) -> Vertical:
    """Return what the altitude loop is to follow."""
    acceleration = target.acceleration_m_s2
    upwards = 0.0 if acceleration is None or acceleration.shape[-1] != 3 else -_z(acceleration)
    return Vertical(_z(target.position_m), -_z(target.velocity_m_s), upwards)


def _z(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors[..., 2].reshape(-1))
