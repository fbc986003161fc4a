"""Flights in crazyflow: all controllers at once, in worlds of their own, through noise.

Plant, attitude response and Mellinger controller are crazyflow's: `first_principles` has bodies, rotors and
its Mellinger attitude loop, `so_rpy_rotor_drag` responses that were fitted to flights of real Crazyflies.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from crazyflow.control.core import load_fn_params
from crazyflow.control.mellinger import state2attitude
from scipy.spatial.transform import Rotation

from benchmarks.simulators.crazyflow_worlds import (
    CRAZYFLIE,
    FITTED,
    SimulatedCrazyflie,
    hold,
    noise,
    place,
    sight,
)
from benchmarks.simulators.identified import LogRow, identified, manoeuvre
from benchmarks.simulators.missions import (
    HEIGHT_M,
    MISSIONS,
    STEP_S,
    TUNED_ON,
    Flight3d,
    Mission,
    Score,
    cost_of,
)
from benchmarks.simulators.pilots import Challenger, Designed, Preset, Sight, SimulatorPilot, through
from benchmarks.simulators.raptor_flights import MOTOR_N, fly_raptor
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.frames import command_in_frame

SEEDS: Final = (101, 102, 103, 104, 105)
SEARCH_SEED, CANDIDATES = 201, 30
RAPTOR: Final = "RAPTOR, a network that knows no drone"
WORLDS: Final = (
    ("cf2x_L250", "first_principles", "crazyflie-l250"),
    ("cf2x_L250", FITTED, "crazyflie-l250"),
    ("cf2x_P250", FITTED, "crazyflie-l250"),
    ("cf2x_T350", FITTED, "crazyflie-l250"),
    ("cf21B_500", FITTED, "crazyflie-brushless"),
    ("hb_x500", FITTED, "x500"),
)
"""Drone of crazyflow, its model, and the vehicle that the page names for it."""


GAINS: Final = ("kp", "kd", "ki")


@dataclass(frozen=True, eq=False)
class Mellinger:
    """crazyflow's own controller with the acceleration of the target.

    factors: (w, 7) on its gains along and across, and on the mass by which it scales the thrust.
    """

    drone: str
    factors: FloatArray = field(default_factory=lambda: np.ones((1, 7)))

    def pilot(self, drones: int, mass_kg: float, *, noisy: bool) -> SimulatorPilot:  # noqa: ARG002 - knows neither
        """Return a controller for new drones."""
        own = load_fn_params(state2attitude, self.drone)
        pairs = zip(GAINS, self.factors[:, :6].reshape(-1, 3, 2).transpose(1, 0, 2), strict=True)
        changed = {name: np.asarray(own[name], float) * pair[:, [0, 0, 1]] for name, pair in pairs}
        mass = np.asarray(own["mass"], float) * self.factors[:, 6:]
        return _MellingerPilot({**own, **changed, "mass": mass})


class _MellingerPilot:
    def __init__(self, parameters: dict[str, Any]) -> None:
        self._parameters, self._integral = parameters, None

    def command(self, seen: Sight, target: FloatArray) -> FloatArray:
        order = np.zeros((len(seen.position_m), 16))
        order[:, :9] = target
        order[:, 12] = 1.0
        quaternion = Rotation.from_euler("xyz", np.nan_to_num(seen.angles_rad)).as_quat()
        with np.errstate(all="ignore"):  # of drones that have crashed
            command, self._integral = state2attitude(
                np.nan_to_num(seen.position_m),
                quaternion,
                np.nan_to_num(seen.velocity_m_s),
                order,
                pos_err_i=self._integral,
                ctrl_freq=round(1.0 / STEP_S),
                **self._parameters,
            )
        return np.asarray(np.nan_to_num(np.asarray(command)))


def fly(
    world: SimulatedCrazyflie,
    challengers: Sequence[Challenger],
    mission: Mission,
    seeds: Sequence[int],
    *,
    noisy: bool = True,
) -> tuple[Flight3d, FloatArray]:
    """Return the flights of each challenger with each seed, through noise or not, and commands (k, w, 4)."""
    each = len(seeds)
    worlds = each * len(challengers)
    simulation, targets, times_s = world.simulation(worlds), mission.targets(), mission.times_s()
    pilots = [challenger.pilot(each, world.mass_kg, noisy=noisy) for challenger in challengers]
    place(simulation, np.tile(targets[0, :3], (worlds, 1)), world.mass_kg)
    position_m = np.empty((len(times_s), worlds, 3))
    commands, level = np.zeros((len(times_s), worlds, 4)), np.empty((len(times_s), worlds))
    suite = noise(sight(simulation), tuple(seeds) * len(challengers))
    for step, time_s in enumerate(times_s):
        true = sight(simulation)
        seen = through(suite, true) if noisy else true
        position_m[step] = true.position_m
        level[step] = np.cos(true.angles_rad[:, 0]) * np.cos(true.angles_rad[:, 1])
        for number, pilot in enumerate(pilots):
            rows = each * number, each * (number + 1)
            commands[step, slice(*rows)] = pilot.command(seen.rows(*rows), targets[step])
        force_n = world.mass_kg * mission.force_m_s2(float(time_s))
        hold(simulation.attitude_control, simulation, commands[step], np.broadcast_to(force_n, (worlds, 3)))
    return Flight3d(position_m, level), commands


def tuned(
    world: SimulatedCrazyflie, missions: Mapping[str, Mission], *, noisy: bool = True
) -> tuple[Mellinger, list[float]]:
    """Return the best of 30 random controllers on missions, the first with its own gains, and its factors."""
    draws = np.random.default_rng(11)
    factors = np.exp(draws.uniform(-1.1, 1.1, (CANDIDATES, 7)))
    factors[:, 6] = draws.uniform(0.9, 1.25, CANDIDATES) * world.mass_kg / _mass_of(world)
    factors[0] = 1.0
    scores: list[dict[str, Score]] = [{} for _ in factors]
    for name, mission in missions.items():
        flown, _ = fly_rows(world, Mellinger(world.drone, factors), mission, noisy=noisy)
        for found, score in zip(scores, mission.scores(flown), strict=True):
            found[name] = score
    best = factors[int(np.argmin([cost_of(found) for found in scores]))]
    return Mellinger(world.drone, best[np.newaxis]), [float(f"{factor:.3g}") for factor in best]


def _mass_of(world: SimulatedCrazyflie) -> float:
    return float(np.ravel(load_fn_params(state2attitude, world.drone)["mass"])[0])


def fly_rows(
    world: SimulatedCrazyflie, candidates: Mellinger, mission: Mission, *, noisy: bool
) -> tuple[Flight3d, FloatArray]:
    """Return a flight of each candidate, all with the same noise."""

    class Rows:
        def pilot(self, drones: int, mass_kg: float, *, noisy: bool) -> SimulatorPilot:
            return candidates.pilot(drones, mass_kg, noisy=noisy)

    return fly(world, [Rows()], mission, [SEARCH_SEED] * CANDIDATES, noisy=noisy)


def fly_log(world: SimulatedCrazyflie) -> list[LogRow]:
    """Return the log of the manoeuvre of `identify`, flown through noise with preset `crazyflie`."""
    simulation, targets = world.simulation(1), manoeuvre(HEIGHT_M)
    place(simulation, targets[:1, :3], world.mass_kg)
    pilot = Preset(CRAZYFLIE).pilot(1, world.mass_kg, noisy=True)
    rows: list[LogRow] = []
    suite = noise(sight(simulation), (7,))
    ned = np.array([1.0, -1.0, -1.0])
    for step, target in enumerate(targets):
        seen = through(suite, sight(simulation))
        command = pilot.command(seen, target)
        hold(simulation.attitude_control, simulation, command, np.zeros((1, 3)))
        angles_rad, velocity_m_s = ned * seen.angles_rad[0], ned * seen.velocity_m_s[0]
        asked_rad, thrust_m_s2 = command_in_frame("NWU", command[0, :2]), command[0, 3] / world.mass_kg
        end = -seen.position_m[0, 2], thrust_m_s2
        rows.append([STEP_S * step, *asked_rad, *angles_rad, *velocity_m_s[:2], *end])
    return rows


def challengers_of(world: SimulatedCrazyflie, folder: Path) -> dict[str, Challenger]:
    """Return the controllers by title; writes the log, and the drone that `identify` found in it."""
    name = f"{world.drone}-{world.model}"
    drone = vehicle_toml.preset(world.vehicle)
    text = identified(fly_log(world), folder / f"{name}.csv", world.mass_kg, drone)
    (folder / f"{name}.toml").write_text(text, "utf-8")
    best, factors = tuned(world, TUNED_ON)
    (folder / f"{name}-found.txt").write_text(f"{factors}\n", "utf-8")
    return {
        "Mellinger": Mellinger(world.drone),
        "Mellinger, tuned": best,
        "ours, preset `crazyflie`": Preset(CRAZYFLIE),
        "ours, by the page": Designed(drone),
        "ours, `identify`, then `design`": Designed(vehicle_toml.parse(text, "identified", "identified")),
    }


def measure_all(folder: Path) -> Iterator[tuple[str, dict[str, Any], Mapping[str, Any]]]:
    """Yield title, scores and paths of each drone with each model."""
    for drone, model, vehicle in WORLDS:
        world = SimulatedCrazyflie(drone, model, vehicle)
        yield world.title, *measure(world, folder)


def scored(
    world: SimulatedCrazyflie, challengers: Mapping[str, Challenger], name: str, mission: Mission
) -> tuple[dict[str, list[Score]], Flight3d]:
    """Fly a mission; return the scores with each seed by challenger, and the flights."""
    flown, _ = fly(world, list(challengers.values()), mission, SEEDS)
    scores, each = mission.scores(flown), len(SEEDS)
    print(f"{world.title}: {name}", flush=True)
    return {title: scores[each * k : each * (k + 1)] for k, title in enumerate(challengers)}, flown


def measure(world: SimulatedCrazyflie, folder: Path) -> tuple[dict[str, Any], Mapping[str, Any]]:
    """Return the scores by challenger and mission, and the paths of the first seed on the eight (k, 3)."""
    challengers = challengers_of(world, folder)
    by_network = world.drone in MOTOR_N and world.model != FITTED
    figures: dict[str, dict[str, list[Score]]] = {title: {} for title in challengers}
    figures |= {RAPTOR: {}} if by_network else {}
    paths: dict[str, Any] = {}
    for name, mission in MISSIONS.items():
        found, flown = scored(world, challengers, name, mission)
        if by_network:
            found[RAPTOR] = mission.scores(fly_raptor(world, mission, SEEDS))
        for title, scores in found.items():
            figures[title][name] = scores
        if name == "eight":
            places = flown.position_m[:, :: len(SEEDS)].swapaxes(0, 1)
            paths = dict(zip(challengers, places, strict=True))
    return figures, paths
