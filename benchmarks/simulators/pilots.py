"""Ours in simulators of others: the settings that a page names, through the API."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mambo_codegen.settings import controller_toml, presets
from mambo_sil.api.api_controller import Controller
from mambo_sil.api.options import with_options
from mambo_sil.api.set_points import HeightHold
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Seen
from mambo_sil.drone.sensors.mocap import MocapSuite
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.states import DroneState, TargetState
from mambo_sil.model.derive.derived_flight import chosen_text


@dataclass(frozen=True, eq=False)
class Sight:
    """What w drones see, in NWU: position, velocity, roll-pitch-yaw, each (w, 3)."""

    position_m: FloatArray
    velocity_m_s: FloatArray
    angles_rad: FloatArray

    def rows(self, first: int, last: int) -> "Sight":
        """Return what some of the drones see."""
        part = slice(first, last)
        return Sight(self.position_m[part], self.velocity_m_s[part], self.angles_rad[part])


def as_seen(true: Sight) -> Seen:
    """Return true states as sensors take them; they do not look at body rates."""
    return Seen(true.position_m.T, true.velocity_m_s.T, true.angles_rad.T, np.zeros_like(true.angles_rad.T))


def through(suite: MocapSuite, true: Sight) -> Sight:
    """Return what the drones see."""
    found = suite.estimate(as_seen(true))
    return Sight(found.position_m.T, found.velocity_m_s.T, found.euler_rad.T)


class SimulatorPilot(Protocol):
    """Flies w drones for one flight."""

    def command(self, seen: Sight, target: FloatArray) -> FloatArray:
        """Return roll, pitch, yaw in rad and thrust in N (w, 4), for a target (9,), in NWU."""
        ...


class Challenger(Protocol):
    """A controller that flies: makes pilots, one for each flight."""

    def pilot(self, drones: int, mass_kg: float, *, noisy: bool) -> SimulatorPilot:
        """Return a pilot for new drones, which see through noise or know their true state."""
        ...


@dataclass(frozen=True)
class Designed:
    """What `design` derives from a drone: for its sensors through noise, else for the true state."""

    drone: VehicleFile

    def controller(self, drones: int, *, noisy: bool) -> Controller:
        """Return the C for new drones."""
        drone = self.drone if noisy else self.drone.with_sensors("true")
        return Controller(controller_toml.parse(chosen_text(drone, drone.name), drone.name), drones)

    def pilot(self, drones: int, mass_kg: float, *, noisy: bool) -> SimulatorPilot:
        """Return the C for new drones."""
        return OurPilot(self.controller(drones, noisy=noisy), mass_kg)


@dataclass(frozen=True)
class Preset:
    """Preset `crazyflie` with the altitude loop `feedforward` of a drone: settings for another one."""

    drone: VehicleFile

    def pilot(self, drones: int, mass_kg: float, *, noisy: bool) -> SimulatorPilot:
        """Return the C for new drones."""
        settings = presets.preset("crazyflie")
        if not noisy:
            settings = with_options(settings, {"measurement_age_s": 0.0})
        hold = HeightHold("feedforward", self.drone, settings, drones)
        return OurPilot(Controller(settings, drones, hold), mass_kg)


@dataclass(frozen=True, eq=False)
class OurPilot:
    """The C, by the API."""

    controller: Controller
    mass_kg: float

    def command(self, seen: Sight, target: FloatArray) -> FloatArray:
        """Return roll, pitch, yaw in rad and thrust in N (w, 4), for a target (9,), in NWU; heading 0."""
        rows = np.broadcast_to(target, (len(seen.position_m), 9))
        goal = TargetState.in_frame("NWU", rows[:, :3], rows[:, 3:6], rows[:, 6:], 0.0)
        state = DroneState.in_frame("NWU", seen.position_m, seen.velocity_m_s, seen.angles_rad)
        return self.controller.step(state, goal).attitude_thrust("NWU", mass_kg=self.mass_kg)
