"""What an attitude interface wants beside roll and pitch: a thrust that holds the height, and a heading.

The thrust is that of an altitude loop of `mambo_sil.flight.altitude_loops`, over the mass. The heading goes
to that of the target at `HEADING_RATE_RAD_S` at most: a jump of the heading's set-point takes from the motors
the thrust that carries the drone.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.settings.model import Settings
from mambo_sil.api.frames import wrapped
from mambo_sil.api.states import DroneState, TargetState
from mambo_sil.arguments import require_choice
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Seen
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.errors import ArgumentError
from mambo_sil.flight.altitude_loops import AltitudeLaw, AltitudeLoop, Vertical
from mambo_sil.flight.names import ALTITUDE_NAMES, AltitudeName

HEADING_RATE_RAD_S: Final = 4.0


class HeightHold:
    """Thrust and heading of n drones; a state that is no number leaves both as they are."""

    def __init__(self, name: AltitudeName, drone: VehicleFile, settings: Settings, n: int) -> None:
        require_choice("height", name, ALTITUDE_NAMES)
        self.n, self._drone, ranges = n, drone, settings.ranges
        self._step_s = settings.horizon.update_period_s
        self._loop = AltitudeLoop(AltitudeLaw(name), drone, n, self._step_s)
        self._bounds = ranges.thrust_acceleration_min_m_s2, ranges.thrust_acceleration_max_m_s2
        self._thrust_m_s2 = np.empty(n)
        self._yaw_rad = np.empty(n)
        self.reset(np.ones(n, np.bool_))

    def reset(self, which: NDArray[np.bool_]) -> None:
        """Forget the past of the drones in `which` (n,)."""
        self._loop.integral_n = np.where(which, 0.0, self._loop.integral_n)
        self._thrust_m_s2 = np.where(
            which, self._drone.weight_n / self._drone.body.mass_kg, self._thrust_m_s2
        )
        self._yaw_rad = np.where(which, np.nan, self._yaw_rad)

    def step(self, state: DroneState, target: TargetState) -> tuple[FloatArray, FloatArray]:
        """Return thrust over mass and heading, each (n,), in the ranges that the controller accepts.

        Raises ArgumentError for positions and velocities without z.
        """
        wanted = self._vertical(state, target)
        position, velocity, euler = (
            values.reshape(self.n, 3).T
            for values in (state.position_m, state.velocity_m_s, state.attitude_rad)
        )
        seen = Seen(position, velocity, euler, rates_rad_s=np.empty((3, 0)))
        thrust_m_s2 = self._loop.thrust_n(wanted, seen) / self._drone.body.mass_kg
        known = np.isfinite(thrust_m_s2)
        self._thrust_m_s2 = np.where(known, np.clip(thrust_m_s2, *self._bounds), self._thrust_m_s2)
        self._turn(seen.euler_rad[2], target)
        return self._thrust_m_s2, self._yaw_rad

    def _vertical(self, state: DroneState, target: TargetState) -> Vertical:
        """Return what the altitude loop is to follow; raises ArgumentError."""
        for record, kind in ((state, "state"), (target, "target")):
            for name in ("position_m", "velocity_m_s"):
                if getattr(record, name).shape[-1] != 3:
                    raise ArgumentError(f"{kind}: {name} has no z; height wants x, y, z (..., 3)")
        acceleration = target.acceleration_m_s2
        upwards = 0.0 if acceleration is None or acceleration.shape[-1] != 3 else -_z(acceleration)
        return Vertical(_z(target.position_m), -_z(target.velocity_m_s), upwards)

    def _turn(self, yaw_rad: FloatArray, target: TargetState) -> None:
        """Move the heading (n,) towards that of the target; it starts at the measured one."""
        self._yaw_rad = np.where(np.isnan(self._yaw_rad), yaw_rad, self._yaw_rad)
        if target.yaw_rad is not None:
            most_rad = HEADING_RATE_RAD_S * self._step_s
            change_rad = wrapped(target.yaw_rad.reshape(-1) - self._yaw_rad)
            turned_rad = wrapped(self._yaw_rad + np.clip(change_rad, -most_rad, most_rad))
            self._yaw_rad = np.where(np.isfinite(turned_rad), turned_rad, self._yaw_rad)


def _z(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors[..., 2].reshape(-1))
