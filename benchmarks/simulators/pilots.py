"""Who flies: the generated C with different settings, and laws without a model; all hold the height alike."""

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from benchmarks.flights.without_height import without_height
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings import presets
from mambo_codegen.settings.model import Settings
from mambo_sil.api.api_controller import Controller
from mambo_sil.api.heading import Heading
from mambo_sil.api.height_hold import HeightHold
from mambo_sil.api.options import ControllerOptions, with_options
from mambo_sil.api.outcome import StepOutcome
from mambo_sil.api.states import DroneState, TargetState
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.pd import (
    PdFeedForwardController,
    PdGains,
    PidFeedForwardController,
    pid_gains,
)
from mambo_sil.flight.names import AltitudeName

HEIGHT: Final = "feedforward"
"""The altitude loop, that of vehicle `crazyflie`; that of `pid` is too stiff for slow rotors."""
AGE_S: Final = 0.01
"""Age of a state through noise; a true one is not old."""


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


class SimulatorPilot(Protocol):
    """Flies w drones for one flight."""

    def command(self, seen: Sight, target: FloatArray) -> FloatArray:
        """Return roll, pitch, yaw in rad and thrust in N (w, 4), for a target (10,), in NWU."""
        ...


class Challenger(Protocol):
    """A controller that flies: makes pilots, one for each flight."""

    @property
    def planned(self) -> bool:
        """Whether its targets are planned: `Mission.targets`."""
        ...

    def pilot(self, drones: int, mass_kg: float, *, noisy: bool) -> SimulatorPilot:
        """Return a pilot for new drones."""
        ...


def goal_of(target: FloatArray, drones: int) -> TargetState:
    """Return a target (10,) for each of several drones."""
    rows = np.broadcast_to(target, (drones, 10))
    return TargetState.in_frame("NWU", rows[:, :3], rows[:, 3:6], rows[:, 6:9], rows[:, 9])


def state_of(seen: Sight) -> DroneState:
    """Return what the drones see as a state."""
    return DroneState.in_frame("NWU", seen.position_m, seen.velocity_m_s, seen.angles_rad)


@dataclass(frozen=True)
class OurSettings:
    """The generated C of some settings; without [height], since all hold the height alike.

    height: the altitude loop.
    planned: whether targets have a planned start.
    """

    settings: Settings
    drone: VehicleFile
    height: AltitudeName = HEIGHT
    planned: bool = False

    def pilot(self, drones: int, mass_kg: float, *, noisy: bool) -> SimulatorPilot:
        """Return the C for new drones; it knows how old its states are."""
        options: ControllerOptions = {"age_s": AGE_S if noisy else 0.0}
        settings = with_options(without_height(self.settings), options)
        controller = Controller(settings, drones, HeightHold(self.height, self.drone, settings, drones))
        return _OurPilot(controller, mass_kg)


@dataclass(frozen=True, eq=False)
class _OurPilot:
    controller: Controller
    mass_kg: float

    def command(self, seen: Sight, target: FloatArray) -> FloatArray:
        outcome = self.controller.step(state_of(seen), goal_of(target, len(seen.position_m)))
        return outcome.attitude_thrust("NWU", mass_kg=self.mass_kg)


TEXTBOOK: Final = PdGains(4.0 / GRAVITY_M_S2, 3.0 / GRAVITY_M_S2, 1.0 / GRAVITY_M_S2)
"""4 1/s^2 and 3 1/s, and the acceleration of the target as it is."""
Law = PdFeedForwardController | PidFeedForwardController


@dataclass(frozen=True)
class WithoutModel:
    """A law without a model: the PD, or the tuned PID of vehicle `crazyflie`."""

    gains: PdGains | None
    drone: VehicleFile
    planned: bool = False

    def pilot(self, drones: int, mass_kg: float, *, noisy: bool) -> SimulatorPilot:  # noqa: ARG002 - knows no age
        """Return the law for new drones."""
        law: Law = PidFeedForwardController(pid_gains()["crazyflie"], drones)
        if self.gains is not None:
            law = PdFeedForwardController(self.gains)
        settings = presets.preset("crazyflie")
        heading = Heading(CompiledController(settings, drones))
        return _LawPilot(law, HeightHold(HEIGHT, self.drone, settings, drones), heading, mass_kg)


@dataclass(frozen=True, eq=False)
class _LawPilot:
    law: Law
    hold: HeightHold
    heading: Heading
    mass_kg: float

    def command(self, seen: Sight, target: FloatArray) -> FloatArray:
        state, goal = state_of(seen), goal_of(target, len(seen.position_m))
        assert goal.acceleration_m_s2 is not None
        thrust_m_s2 = self.hold.step(state, goal)
        yaw_rad = self.heading.turn(state.attitude_rad[:, 2], goal.yaw_rad)
        places = state.position_m[:, :2], state.velocity_m_s[:, :2], state.attitude_rad
        aims = goal.position_m[:, :2], goal.velocity_m_s[:, :2], goal.acceleration_m_s2[:, :2]
        outcome = self.law.step(np.concatenate(places, axis=1), np.concatenate(aims, axis=1), thrust_m_s2)
        whole = StepOutcome(outcome.command_rad, outcome.status, thrust_m_s2=thrust_m_s2, yaw_rad=yaw_rad)
        return whole.attitude_thrust("NWU", mass_kg=self.mass_kg)


def laws(drone: VehicleFile) -> dict[str, Challenger]:
    """Return the laws without a model by title."""
    return {
        "PD with the target's acceleration": WithoutModel(TEXTBOOK, drone),
        "PID with feed-forward, tuned": WithoutModel(None, drone),
    }
