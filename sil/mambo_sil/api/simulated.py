"""n simulated drones that a program moves on, command by command."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_sil.arguments import require
from mambo_sil.drone.plant.airframe import airframe_of
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.disturbances import Disturbances, World
from mambo_sil.drone.plant.elementary import sine_cosine
from mambo_sil.drone.plant.rigid_body import EULER, POSITION
from mambo_sil.drone.plant.vehicle import Seen, Vehicle, VehicleState, truth
from mambo_sil.drone.sensors.suites import AnySensors, suite_of
from mambo_sil.flight.altitude_loops import AltitudeLaw, AltitudeLoop, Vertical
from mambo_sil.flight.controllers.thrust_controller import ThrustDelivery
from mambo_sil.flight.crashes import least_level
from mambo_sil.flight.states import DroneState

LOST_M: Final = 100.0
"""A drone this far from the origin along any axis is lost."""
_HEIGHT_M: Final = 1.0


class SimulatedDrones:
    """The plant of the command `fly`, in NumPy; its altitude loop, if it is asked, has feed-forward.

    sensors:      through which drones are seen; None for the true state.
    disturbances: wind and push; their events by time do not happen.
    seeds:        of noise and gusts, one for each of n drones.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        update_period_s: float,
        seeds: Sequence[int] = (0,),
        *,
        sensors: AnySensors | None = None,
        disturbances: Disturbances | None = None,
    ) -> None:
        self.drone, self._vehicle, self.n = vehicle.drone, vehicle, len(seeds)
        ticks = update_period_s / self.drone.step_s
        whole = round(ticks) >= 1 and abs(ticks - round(ticks)) < 1e-6
        require(whole, "update_period_s", update_period_s, f"be a multiple of {self.drone.step_s:g}, a tick")
        self._ticks = round(ticks)
        self._state = self._resting(np.tile([[0.0], [0.0], [-_HEIGHT_M]], (1, self.n)))
        self._altitude = AltitudeLoop(AltitudeLaw("feedforward"), self.drone, self.n)
        self._delivery = ThrustDelivery(self.drone, self.n)
        self._thrust_n = np.full(self.n, self.drone.hover_demand_n)
        self._world = World(disturbances or Disturbances(), vehicle, seeds, _HEIGHT_M)
        self._seen = self._measured()
        self._suite = suite_of(sensors, seeds, self._seen, self.drone.step_s)

    def place(self, position_m: FloatArray, chosen: NDArray[np.bool_] | None = None) -> None:
        """Let the drones, or those that are `chosen` (n,), hover at positions (n, 3) in NED, north."""
        put = np.ones(self.n, np.bool_) if chosen is None else chosen
        fresh = self._resting(np.ascontiguousarray(position_m.T))
        self._state = VehicleState(
            np.where(put, fresh.body, self._state.body),
            np.where(put, fresh.rotor_speed_rad_s, self._state.rotor_speed_rad_s),
            np.where(put, fresh.memory, self._state.memory),
        )
        self._delivery.forget(put)
        self._thrust_n = np.where(put, self.drone.hover_demand_n, self._thrust_n)
        measured = self._measured()
        if self._suite is not None:
            self._suite.place(measured, put)
        self._seen = _chosen(put, measured, self._seen)

    def advance(self, command_rad: FloatArray, lift: Vertical | FloatArray) -> None:
        """Hold roll and pitch (n, 2) for one update period, with heading 0.

        lift: what the altitude loop is to follow, or thrusts over mass (n,) in its place.
        """
        most_n, commands = self.drone.altitude.thrust_max_n, np.ascontiguousarray(command_rad.T)
        with np.errstate(all="ignore"):
            for _ in range(self._ticks):
                self._state, moment = self._world.tick(self._state, 0.0)
                measured = self._measured()
                self._seen = seen = measured if self._suite is None else self._suite.estimate(measured)
                if isinstance(lift, Vertical):
                    wanted_n = self._thrust_n = self._altitude.thrust_n(lift, seen)
                else:
                    wanted_n = self.drone.body.mass_kg * lift
                    self._thrust_n = np.clip(wanted_n, -most_n, most_n)
                self._state, given_n = self._vehicle.advance(
                    self._state, commands, self._thrust_n, 0.0, seen=seen, moment=moment
                )
                self._delivery.note(wanted_n, given_n)
        if self._suite is None:
            self._seen = self._measured()

    def report_thrust(self) -> FloatArray:
        """Return the thrusts over mass (n,) of the last periods that the mixer capped, else NaN."""
        return self._delivery.report()

    @property
    def state(self) -> DroneState:
        """The states (n,) as they are seen, with z."""
        return _state_of(self._seen)

    @property
    def true_state(self) -> DroneState:
        """The true states (n,), with z."""
        return _state_of(truth(self._state))

    @property
    def thrust_m_s2(self) -> FloatArray:
        """The thrusts over the mass (n,) that were last demanded."""
        return self._thrust_n / self.drone.body.mass_kg

    @property
    def crashed(self) -> NDArray[np.bool_]:
        """Which drones (n,) are tilted too far, on the ground, or lost."""
        with np.errstate(all="ignore"):
            _, (cos_roll, cos_pitch, _) = sine_cosine(self._state.body[EULER])
            position_m = self._state.body[POSITION]
            inside = (np.abs(position_m) < LOST_M).all(axis=0)  # not of NaN
            level = cos_roll * cos_pitch > least_level(self.drone)
            return np.asarray(~(inside & (position_m[2] < 0.0) & level))

    def _measured(self) -> Seen:
        """Return the true state where it is measured: off by `lever_error_m` of the vehicle."""
        return self._vehicle.measured(truth(self._state))

    def _resting(self, position_m: FloatArray) -> VehicleState:
        hover_command = airframe_of(self.drone).hover_command / self.drone.thrust_gain
        return self._vehicle.at_rest(position_m, 0.0, hover_command)


def _state_of(seen: Seen) -> DroneState:
    return DroneState(seen.position_m.T, seen.velocity_m_s.T, seen.euler_rad.T)


def _chosen(put: NDArray[np.bool_], fresh: Seen, other: Seen) -> Seen:
    """Return what is seen of drones, of those that are `put` (n,) the fresh numbers."""
    names = ("position_m", "velocity_m_s", "euler_rad", "rates_rad_s")
    return replace(
        other, **{name: np.where(put, getattr(fresh, name), getattr(other, name)) for name in names}
    )
