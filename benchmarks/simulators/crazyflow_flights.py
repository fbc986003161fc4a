"""Flights in crazyflow: all controllers at once, in worlds of their own, with true states and through noise.

Plant, attitude response and Mellinger controller are crazyflow's: `first_principles` has bodies, rotors and
its Mellinger attitude loop, `so_rpy_rotor_drag` responses that were fitted to flights of real Crazyflies.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Final

import jax.numpy as jnp
import numpy as np
from crazyflow.control import Control, parametrize
from crazyflow.control.mellinger import state2attitude
from crazyflow.sim import Sim
from scipy.spatial.transform import Rotation

from benchmarks.simulators.identified import SENSORS, LogRow, identified, identified_settings, manoeuvre
from benchmarks.simulators.missions import HEIGHT_M, MISSIONS, STEP_S, Flight3d, Mission, Score
from benchmarks.simulators.pilots import Challenger, OurSettings, Sight, SimulatorPilot, laws
from mambo_codegen.settings import presets
from mambo_nmpc import Controller
from mambo_sil.api.frames import attitude_of_quaternion, command_in_frame
from mambo_sil.api.options import ControllerOptions, with_options
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Seen
from mambo_sil.drone.sensors.mocap import MocapSuite, MotionCapture
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_sections import MocapSensors

SEEDS: Final = (0, 1, 2, 3, 4)
FREQ_HZ: Final = 500
CRAZYFLIE: Final = vehicle_toml.preset("crazyflie")
FITTED: Final = "so_rpy_rotor_drag"
MODELS: Final = {"first_principles": "first principles", FITTED: "fitted"}
VEHICLES: Final = {
    "cf2x_L250": "crazyflie-l250",
    "cf2x_P250": "crazyflie-l250",
    "cf21B_500": "crazyflie-brushless",
}
"""The shipped drone that is nearest to each drone of crazyflow."""
BOUNDLESS: Final[ControllerOptions] = {"speed_m_s": 0.0, "braking_m_s2": 0.0}
"""Options without limits of speed and braking."""


@dataclass(frozen=True)
class SimulatedCrazyflie:
    """One drone of crazyflow with one of its models."""

    drone: str
    model: str

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

    @lru_cache(maxsize=2)  # noqa: B019 - as many as one simulated drone needs
    def _compiled(self, worlds: int) -> Any:
        return Sim(
            n_worlds=worlds, drone=self.drone, dynamics=self.model, control=Control.attitude, freq=FREQ_HZ
        )


@dataclass(frozen=True)
class Mellinger:
    """crazyflow's own controller, with the acceleration of the target or without it."""

    drone: str
    acceleration: bool = True
    planned: bool = False

    def pilot(self, drones: int, mass_kg: float, *, noisy: bool) -> SimulatorPilot:  # noqa: ARG002 - knows neither
        """Return a controller for new drones."""
        return _MellingerPilot(parametrize(state2attitude, self.drone), self.acceleration)


class _MellingerPilot:
    def __init__(self, law: Any, acceleration: bool) -> None:
        self._law, self._acceleration, self._integral = law, acceleration, None

    def command(self, seen: Sight, target: FloatArray) -> FloatArray:
        order = np.zeros((len(seen.position_m), 16))
        order[:, :6] = target[:6]
        if self._acceleration:
            order[:, 6:9] = target[6:9]
        order[:, 9:13] = Rotation.from_euler("z", target[9]).as_quat()
        quaternion = Rotation.from_euler("xyz", np.nan_to_num(seen.angles_rad)).as_quat()
        command, self._integral = self._law(
            np.nan_to_num(seen.position_m),
            quaternion,
            np.nan_to_num(seen.velocity_m_s),
            order,
            pos_err_i=self._integral,
            ctrl_freq=round(1.0 / STEP_S),
        )
        return np.asarray(command)


def fly(
    world: SimulatedCrazyflie, challengers: Sequence[Challenger], mission: Mission
) -> tuple[Flight3d, FloatArray]:
    """Return the flights of each challenger, with the truth, then with each seed, and commands (k, w, 4)."""
    each = 1 + len(SEEDS)
    worlds = each * len(challengers)
    simulation, hands, starts_m = world.simulation(worlds), [], np.empty((worlds, 3))
    for number, challenger in enumerate(challengers):
        first, targets = each * number, mission.targets(planned=challenger.planned)
        starts_m[first : first + each] = targets[0, :3]
        groups = (((first, first + 1), False), ((first + 1, first + each), True))
        for rows, noisy in (
            groups if isinstance(challenger, OurSettings) else (((first, first + each), True),)
        ):
            pilot = challenger.pilot(rows[1] - rows[0], world.mass_kg, noisy=noisy)
            hands.append((rows, pilot, targets))
    place(simulation, starts_m, world.mass_kg)
    noisy_rows = np.arange(worlds) % each > 0
    times_s = mission.times_s
    position_m = np.empty((len(times_s), worlds, 3))
    commands, level = np.zeros((len(times_s), worlds, 4)), np.empty((len(times_s), worlds))
    suite = None
    for step, time_s in enumerate(times_s):
        true = sight(simulation)
        suite = suite or noise(true.rows(0, worlds), noisy_rows, len(challengers))
        seen = through(suite, true, noisy_rows)
        position_m[step] = true.position_m
        level[step] = np.cos(true.angles_rad[:, 0]) * np.cos(true.angles_rad[:, 1])
        for rows, pilot, targets in hands:
            commands[step, slice(*rows)] = pilot.command(seen.rows(*rows), targets[step])
        force_n = world.mass_kg * mission.force_m_s2(float(time_s))
        advance(simulation, commands[step], np.broadcast_to(force_n, (worlds, 3)))
    return Flight3d(position_m, level), commands


def place(simulation: Any, position_m: FloatArray, mass_kg: float) -> None:
    """Let all drones hover at positions (w, 3)."""
    states = simulation.data.states
    hover_n = mass_kg * 9.81 / 4.0
    rotors = hover_n
    if hasattr(simulation.data.params, "rpm2thrust"):
        constant, linear, square = np.ravel(np.asarray(simulation.data.params.rpm2thrust, float))[-3:]
        rotors = float(max(np.roots([square, linear, constant - hover_n]).real))
    simulation.data = simulation.data.replace(
        states=states.replace(
            pos=jnp.asarray(position_m[:, np.newaxis], states.pos.dtype),
            rotor_vel=jnp.full_like(states.rotor_vel, rotors),
        )
    )


def sight(simulation: Any) -> Sight:
    """Return the true states."""
    states = simulation.data.states
    position, velocity, quaternion = (
        np.asarray(part[:, 0], np.float64) for part in (states.pos, states.vel, states.quat)
    )
    length = np.linalg.norm(quaternion, axis=1, keepdims=True)
    return Sight(position, velocity, attitude_of_quaternion(quaternion / length))


def noise(true: Sight, rows: Any, challengers: int) -> MocapSuite:
    """Return the motion capture of vehicle `crazyflie` for the noisy drones, with all seeds for each."""
    sensors = CRAZYFLIE.sensors
    assert isinstance(sensors, MocapSensors)
    return MocapSuite(MotionCapture(sensors), SEEDS * challengers, _as_seen(true, rows), STEP_S)


def through(suite: MocapSuite, true: Sight, rows: Any) -> Sight:
    """Return what the drones see, of which those in `rows` see through noise."""
    found = suite.estimate(_as_seen(true, rows))
    parts = []
    pairs = (
        (true.position_m, found.position_m),
        (true.velocity_m_s, found.velocity_m_s),
        (true.angles_rad, found.euler_rad),
    )
    for whole, noisy in pairs:
        mixed = whole.copy()
        mixed[rows] = noisy.T
        parts.append(mixed)
    return Sight(*parts)


def _as_seen(true: Sight, rows: Any) -> Seen:
    places = (part[rows].T for part in (true.position_m, true.velocity_m_s, true.angles_rad))
    position_m, velocity_m_s, angles_rad = places
    return Seen(position_m, velocity_m_s, angles_rad, np.zeros_like(angles_rad))


def advance(simulation: Any, commands: FloatArray, force_n: FloatArray) -> None:
    """Hold commands (w, 4) and forces (w, 3) for one step of the controllers."""
    kind = simulation.data.states.pos.dtype
    states = simulation.data.states.replace(force=jnp.asarray(force_n[:, np.newaxis], kind))
    simulation.data = simulation.data.replace(states=states)
    simulation.attitude_control(jnp.asarray(commands[:, np.newaxis], kind))
    simulation.step(round(FREQ_HZ * STEP_S))


def fly_log(world: SimulatedCrazyflie) -> list[LogRow]:
    """Return the log of the manoeuvre of `identify`, flown through noise with preset `crazyflie`."""
    simulation, targets = world.simulation(1), manoeuvre(HEIGHT_M)
    place(simulation, targets[:1, :3], world.mass_kg)
    pilot = OurSettings(presets.preset("crazyflie"), CRAZYFLIE).pilot(1, world.mass_kg, noisy=True)
    rows: list[LogRow] = []
    every, suite = np.array([True]), None
    for step, target in enumerate(targets):
        true = sight(simulation)
        suite = suite or MocapSuite(
            MotionCapture(CRAZYFLIE.sensors),  # type: ignore[arg-type] # that of vehicle `crazyflie` is mocap
            (7,),
            _as_seen(true, every),
            STEP_S,
        )
        seen = through(suite, true, every)
        command = pilot.command(seen, target)
        advance(simulation, command, np.zeros((1, 3)))
        ned = [1.0, -1.0, -1.0]
        angles_rad, velocity_m_s = ned * seen.angles_rad[0], ned * seen.velocity_m_s[0]
        asked_rad = command_in_frame("NWU", command[0, :2])
        thrust_m_s2 = command[0, 3] / world.mass_kg
        z_m = -seen.position_m[0, 2]
        rows.append([STEP_S * step, *asked_rad, *angles_rad, *velocity_m_s[:2], z_m, thrust_m_s2])
    return rows


def challengers_of(world: SimulatedCrazyflie, folder: Path) -> dict[str, Challenger]:
    """Return the controllers by title; writes the log, and the drone that `identify` found in it."""
    name = f"{world.drone}-{world.model}"
    text, found = identified(fly_log(world), folder / f"{name}.csv", world.mass_kg)
    (folder / f"{name}.toml").write_text(text, "utf-8")
    derived = Controller.from_vehicle(VEHICLES[world.drone]).settings
    calm = identified_settings(text.partition(SENSORS)[0])
    return {
        "Mellinger with the target's acceleration": Mellinger(world.drone),
        "Mellinger without it": Mellinger(world.drone, acceleration=False),
        "Mellinger with it, planned starts and steps": Mellinger(world.drone, planned=True),
        **laws(CRAZYFLIE),
        "ours, preset `crazyflie`": OurSettings(presets.preset("crazyflie"), CRAZYFLIE),
        "ours, `design crazyflie`": OurSettings(Controller.from_vehicle("crazyflie").settings, CRAZYFLIE),
        "ours, `design` of the nearest drone": OurSettings(derived, CRAZYFLIE),
        "the same without limits": OurSettings(with_options(derived, BOUNDLESS), CRAZYFLIE),
        "the same, height by `pid`": OurSettings(derived, CRAZYFLIE, "pid"),
        "ours, `identify`, then `design`": OurSettings(found, CRAZYFLIE),
        "identified, without limits": OurSettings(with_options(found, BOUNDLESS), CRAZYFLIE),
        "identified, without `[sensors]`": OurSettings(calm, CRAZYFLIE),
    }


def measure_all(folder: Path) -> Iterator[tuple[str, dict[str, Any], Mapping[str, Any]]]:
    """Yield title, scores and paths of each drone with each model."""
    for drone in VEHICLES:
        for model in MODELS:
            world = SimulatedCrazyflie(drone, model)
            yield world.title, *measure(world, folder)


def measure(world: SimulatedCrazyflie, folder: Path) -> tuple[dict[str, Any], Mapping[str, Any]]:
    """Return the scores by challenger and mission, and the paths of the first seed on the circle (k, 3)."""
    challengers = challengers_of(world, folder)
    figures: dict[str, dict[str, dict[str, Any]]] = {title: {} for title in challengers}
    paths: dict[str, Any] = {}
    each = 1 + len(SEEDS)
    for name, mission in MISSIONS.items():
        flown, commands = fly(world, list(challengers.values()), mission)
        scores: list[Score] = mission.scores(flown)
        for number, title in enumerate(challengers):
            part = slice(each * number + 1, each * (number + 1))
            unrest_rad = float(np.abs(np.diff(commands[:, part, :2], axis=0)).mean())
            figures[title][name] = {
                "truth": scores[each * number],
                "noise": scores[part],
                "unrest_rad": unrest_rad,
            }
            if name == "circle":
                paths[title] = flown.position_m[:, each * number + 1]
        print(f"{world.title}: {name}", flush=True)
    return figures, paths
