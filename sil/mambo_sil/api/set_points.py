"""What a command has beside roll and pitch, for programs: the thrust of an altitude loop, and the heading."""

import warnings
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.numbers.representation import YAW_LIMIT_RAD
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Seen
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.errors import UserNotice
from mambo_sil.flight.altitude_loops import AltitudeLaw, AltitudeLoop, Vertical
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.frames import wrapped
from mambo_sil.flight.names import AltitudeName
from mambo_sil.flight.states import DroneState, TargetState

HEADING_RATE_RAD_S: Final = 4.0
"""Fastest turn of the heading: a jump of it takes from the motors the thrust that carries the drone."""
REST_S: Final = 2.0
"""Time for which a drone must stay beside its height, at rest, before the hint."""
REST_M_S: Final = 0.05
"""Largest climb at rest, of the drone and of its target."""
OFF_M, LOST_M = 0.03, 0.3
"""A drone that is off by less is near enough, one that is off by more has another fault."""


class Heading:
    """Headings of n drones, which `nmpc_slew_heading` turns; each starts at the measured one."""

    def __init__(self, compiled: CompiledController) -> None:
        self._compiled = compiled
        self.most_rad = HEADING_RATE_RAD_S * compiled.settings.horizon.update_period_s
        self.yaw_rad = np.full(compiled.n, np.nan)
        """The last set-points (n,), NaN before the first measured heading that is a number in its range."""

    def reset(self, which: NDArray[np.bool_]) -> None:
        """Forget the headings of the drones in `which` (n,)."""
        self.yaw_rad = np.where(which, np.nan, self.yaw_rad)

    def shift(self, change_rad: FloatArray) -> None:
        """Change the set-points by `change_rad` (n,): the frame has turned."""
        yaw_rad = self.yaw_rad + change_rad
        self.yaw_rad = np.where(np.abs(yaw_rad) <= YAW_LIMIT_RAD, yaw_rad, wrapped(yaw_rad))

    def turn(self, measured_rad: FloatArray, wanted_rad: FloatArray | None) -> FloatArray:
        """Return the next headings (n,), towards the wanted ones if there are any."""
        measured_rad = np.where(np.abs(measured_rad) <= YAW_LIMIT_RAD, measured_rad, np.nan)
        yaw_rad = np.where(np.isnan(self.yaw_rad), measured_rad, self.yaw_rad)
        if wanted_rad is not None:
            turned_rad = self._compiled.slew_heading(yaw_rad, wanted_rad, self.most_rad)
            yaw_rad = np.where(np.isnan(yaw_rad), np.nan, turned_rad)
        self.yaw_rad = yaw_rad
        return yaw_rad


class HeightHint:
    """Watches n drones under an altitude loop without an integral; warns once.

    A drone whose thrust is not the one that the loop assumes stays beside the height of its target.
    """

    def __init__(self, drone: VehicleFile, n: int, update_period_s: float) -> None:
        self._drone, self._update_period_s = drone, update_period_s
        self._rest_s, self._said = np.zeros(n), False

    def watch(self, state: DroneState, target: TargetState) -> None:
        """Look at states and targets with z; warn of the first drone that rests off its height."""
        if self._said:
            return
        off_m = (state.position_m[..., 2] - target.position_m[..., 2]).reshape(-1)
        rests = (np.abs(state.velocity_m_s[..., 2]).reshape(-1) < REST_M_S) & ~state.on_ground.reshape(-1)
        rests &= np.abs(target.velocity_m_s[..., 2]).reshape(-1) < REST_M_S
        rests &= (np.abs(off_m) > OFF_M) & (np.abs(off_m) < LOST_M)
        self._rest_s = np.where(rests, self._rest_s + self._update_period_s, 0.0)
        if (found := np.flatnonzero(self._rest_s >= REST_S)).size:
            self._said = True
            warnings.warn(self._words(off_m[found[0]]), UserNotice, stacklevel=4)

    def _words(self, off_m: FloatArray) -> str:
        low = "below" if off_m > 0.0 else "above"
        share = abs(off_m) * self._drone.altitude.p_n_m / self._drone.weight_n
        less = "less thrust, or more mass," if off_m > 0.0 else "more thrust, or less mass,"
        return (
            f"a drone stays {1e3 * abs(off_m):.0f} mm {low} its target: it has {100.0 * share:.0f} % {less} "
            f"than vehicle {self._drone.name}; write its mass_kg and [thrust] into a vehicle.toml, or take "
            'height="pid"'
        )


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
