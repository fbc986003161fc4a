"""Drones of crazyflow: their simulation, what they see through noise, and their start in hover."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, Final

import jax.numpy as jnp
import numpy as np
from crazyflow.control import Control
from crazyflow.sim import Sim

from benchmarks.simulators.missions import STEP_S
from benchmarks.simulators.pilots import Sight, as_seen
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.sensors.mocap import MocapSuite, MotionCapture
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_sections import MocapSensors
from mambo_sil.flight.frames import attitude_of_quaternion

FREQ_HZ: Final = 500
CRAZYFLIE: Final = vehicle_toml.preset("crazyflie")
FITTED: Final = "so_rpy_rotor_drag"
MODELS: Final = {"first_principles": "first principles", FITTED: "fitted"}


@dataclass(frozen=True)
class SimulatedCrazyflie:
    """One drone of crazyflow with one of its models, and the vehicle of ours."""

    drone: str
    model: str
    vehicle: str

    @property
    def title(self) -> str:
        """Name of drone and model."""
        return f"{self.drone}, {MODELS[self.model]}"

    def simulation(self, worlds: int) -> Any:
        """Return a simulation with attitude control at its start; each number of worlds is compiled once."""
        simulation = self._compiled(worlds)
        simulation.reset()
        return simulation

    @cached_property
    def mass_kg(self) -> float:
        """The mass that the simulation has."""
        return float(np.ravel(self.simulation(1).data.params.mass)[0])

    @lru_cache(maxsize=3)  # noqa: B019 - as many as one simulated drone needs
    def _compiled(self, worlds: int) -> Any:
        return Sim(
            n_worlds=worlds, drone=self.drone, dynamics=self.model, control=Control.attitude, freq=FREQ_HZ
        )


def place(simulation: Any, position_m: FloatArray, mass_kg: float) -> None:
    """Let all drones hover at positions (w, 3)."""
    states = simulation.data.states
    hover_n = mass_kg * 9.81 / 4.0
    rotors = rotor_speed(simulation, hover_n) if hasattr(simulation.data.params, "rpm2thrust") else hover_n
    simulation.data = simulation.data.replace(
        states=states.replace(
            pos=jnp.asarray(position_m[:, np.newaxis], states.pos.dtype),
            rotor_vel=jnp.full_like(states.rotor_vel, rotors),
        )
    )


def rotor_speed(simulation: Any, thrust_n: float) -> float:
    """Return the speed of a rotor with a thrust."""
    constant, linear, square = np.ravel(np.asarray(simulation.data.params.rpm2thrust, float))[-3:]
    return float(max(np.roots([square, linear, constant - thrust_n]).real))


def sight(simulation: Any) -> Sight:
    """Return the true states."""
    states = simulation.data.states
    position, velocity, quaternion = (
        np.asarray(part[:, 0], np.float64) for part in (states.pos, states.vel, states.quat)
    )
    length = np.linalg.norm(quaternion, axis=1, keepdims=True)
    return Sight(position, velocity, attitude_of_quaternion(quaternion / length))


def noise(true: Sight, seeds: Sequence[int]) -> MocapSuite:
    """Return the motion capture of vehicle `crazyflie` for drones with these seeds."""
    sensors = CRAZYFLIE.sensors
    assert isinstance(sensors, MocapSensors)
    return MocapSuite(MotionCapture(sensors), seeds, as_seen(true), STEP_S)


def hold(control: Callable[[Any], None], simulation: Any, commands: FloatArray, force_n: FloatArray) -> None:
    """Hold commands (w, 4) of a kind of control, and forces (w, 3), for one step of the controllers."""
    kind = simulation.data.states.pos.dtype
    states = simulation.data.states.replace(force=jnp.asarray(force_n[:, np.newaxis], kind))
    simulation.data = simulation.data.replace(states=states)
    control(jnp.asarray(commands[:, np.newaxis], kind))
    simulation.step(round(FREQ_HZ * STEP_S))
