"""One simulated drone that a program moves on, command by command."""

import numpy as np

from mambo_sil.arguments import require
from mambo_sil.drone.plant.airframe import airframe_of
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.elementary import sine_cosine
from mambo_sil.drone.plant.rigid_body import EULER, POSITION
from mambo_sil.drone.plant.vehicle import Vehicle, truth
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.altitude_loops import AltitudeLaw, AltitudeLoop, Vertical
from mambo_sil.flight.controllers.thrust_controller import ThrustDelivery
from mambo_sil.flight.crashes import least_level
from mambo_sil.flight.states import DroneState

LOST_M = 100.0
"""A drone this far from the origin along any axis is lost."""


class SimulatedDrone:
    """The plant of the command `fly` without sensors; its altitude loop, if it is asked, has feed-forward."""

    def __init__(self, drone: VehicleFile, update_period_s: float) -> None:
        self.drone, self._vehicle = drone, Vehicle.of(drone)
        ticks = update_period_s / drone.step_s
        whole = round(ticks) >= 1 and abs(ticks - round(ticks)) < 1e-6
        require(whole, "update_period_s", update_period_s, f"be a multiple of {drone.step_s:g}, a tick")
        self._ticks = round(ticks)
        self.place(np.array([0.0, 0.0, -1.0]))

    def place(self, position_m: FloatArray) -> None:
        """Let the drone hover at a position (3,) in NED, north."""
        hover_command = airframe_of(self.drone).hover_command / self.drone.thrust_gain
        self._state = self._vehicle.at_rest(position_m[:, np.newaxis], 0.0, hover_command)
        self._altitude = AltitudeLoop(AltitudeLaw("feedforward"), self.drone, 1)
        self._delivery = ThrustDelivery(self.drone, 1)
        self._thrust_n = np.array([self.drone.hover_demand_n])

    def advance(self, command_rad: FloatArray, lift: Vertical | float) -> None:
        """Hold roll and pitch (2,) for one update period, with heading 0.

        lift: what the altitude loop is to follow, or a thrust over mass in its place.
        """
        most_n = self.drone.altitude.thrust_max_n
        with np.errstate(all="ignore"):
            for _ in range(self._ticks):
                seen = truth(self._state)
                if isinstance(lift, Vertical):
                    wanted_n = self._thrust_n = self._altitude.thrust_n(lift, seen)
                else:
                    wanted_n = np.array([self.drone.body.mass_kg * lift])
                    self._thrust_n = np.clip(wanted_n, -most_n, most_n)
                self._state, given_n = self._vehicle.advance(
                    self._state, command_rad[:, np.newaxis], self._thrust_n, 0.0, seen=seen
                )
                self._delivery.note(wanted_n, given_n)

    def report_thrust(self) -> float:
        """Return the thrust over mass of the last periods if the mixer capped it, else NaN."""
        return float(self._delivery.report()[0])

    @property
    def state(self) -> DroneState:
        """The true state, with z."""
        seen = truth(self._state)
        return DroneState(seen.position_m[:, 0], seen.velocity_m_s[:, 0], seen.euler_rad[:, 0])

    @property
    def thrust_m_s2(self) -> float:
        """The thrust over the mass that was last demanded."""
        return float(self._thrust_n[0]) / self.drone.body.mass_kg

    @property
    def crashed(self) -> bool:
        """Whether it is tilted too far, on the ground, or lost."""
        _, (cos_roll, cos_pitch, _) = sine_cosine(self._state.body[EULER][:, 0])
        position_m = self._state.body[POSITION][:, 0]
        inside = bool((np.abs(position_m) < LOST_M).all())  # not of NaN
        return not (inside and position_m[2] < 0.0 and cos_roll * cos_pitch > least_level(self.drone))
