"""Flights of RotorPy's Crazyflie: its `Multirotor` in steps of 10 ms, its `SE3Control`, and the others.

`SE3Control` (Lee, Leok and McClamroch 2010) commands motor speeds, the others attitude and thrust through
`cmd_ctatt`, whose gains are those of `SE3Control`.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from rotorpy.controllers.quadrotor_control import SE3Control
from rotorpy.vehicles.crazyflie_params import quad_params
from rotorpy.vehicles.multirotor import Multirotor
from scipy.spatial.transform import Rotation

from benchmarks.simulators.identified import LogRow, identified, manoeuvre
from benchmarks.simulators.missions import HEIGHT_M, MISSIONS, STEP_S, Flight3d, Mission, Score
from benchmarks.simulators.pilots import Challenger, OurSettings, Sight, SimulatorPilot, laws
from mambo_codegen.settings import controller_toml, presets
from mambo_nmpc import Controller
from mambo_sil.api.frames import attitude_of_quaternion, command_in_frame
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Seen
from mambo_sil.drone.sensors.mocap import MocapSuite, MotionCapture
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_sections import MocapSensors
from mambo_sil.model.derive.derived_settings import controller_text

SEEDS: Final = (0, 1, 2, 3, 4)
CRAZYFLIE: Final = vehicle_toml.preset("crazyflie")
DRONE: Final = vehicle_toml.read(Path(__file__).with_name("rotorpy_crazyflie.toml"))
MASS_KG: Final = float(quad_params["mass"])
State = dict[str, Any]


@dataclass(frozen=True)
class Geometric:
    """RotorPy's own controller."""

    planned: bool = False


def fly(
    challenger: Challenger | Geometric, mission: Mission, seed: int | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return positions (k, 3), cosines of the tilt (k,), commands (k, 4); a state without seed is true."""
    vehicle = vehicle_for("cmd_motor_speeds" if isinstance(challenger, Geometric) else "cmd_ctatt")
    targets, times_s = mission.targets(planned=challenger.planned), mission.times_s
    state = _hover(targets[0, :3])
    pilot = (
        None if isinstance(challenger, Geometric) else challenger.pilot(1, MASS_KG, noisy=seed is not None)
    )
    own, suite = SE3Control(quad_params), None if seed is None else _noise(seed, state)
    places, levels, commands = [], [], []
    for target, time_s in zip(targets, times_s, strict=True):
        true = _sight(state)
        places.append(true.position_m[0])
        levels.append(float(np.cos(true.angles_rad[0, 0]) * np.cos(true.angles_rad[0, 1])))
        if not _is_flying(places[-1], levels[-1]):
            left = len(times_s) - len(places)
            places += [np.full(3, np.nan)] * left
            levels += [-1.0] * left
            break
        seen, rates = (true, state["w"]) if suite is None else _through(suite, true, state["w"])
        control, command = _own(own, seen, rates, target) if pilot is None else _ours(pilot, seen, target)
        commands.append(command)
        push = MASS_KG * mission.force_m_s2(float(time_s))
        vehicle.weight = np.array([0.0, 0.0, -MASS_KG * vehicle.g]) + push
        state = vehicle.step(state, control, STEP_S)
    return np.array(places), np.array(levels), np.array(commands)


def vehicle_for(abstraction: str) -> Any:
    """Return RotorPy's Crazyflie with a control abstraction."""
    return Multirotor(quad_params, control_abstraction=abstraction)


def _is_flying(position_m: FloatArray, level: float) -> bool:
    return bool(position_m[2] > 0.05 and level > 0.17)


def _hover(position_m: FloatArray) -> State:
    """Return a drone at rest."""
    hover_rad_s = float(np.sqrt(MASS_KG * 9.81 / (4.0 * quad_params["k_eta"])))
    rest = {name: np.zeros(3) for name in ("v", "w", "wind")}
    upright = {"q": np.array([0.0, 0.0, 0.0, 1.0]), "rotor_speeds": np.full(4, hover_rad_s)}
    return {"x": np.array(position_m), **rest, **upright}


def _sight(state: State) -> Sight:
    angles_rad = attitude_of_quaternion(state["q"] / np.linalg.norm(state["q"]))
    return Sight(state["x"][np.newaxis], state["v"][np.newaxis], angles_rad[np.newaxis])


def _as_seen(seen: Sight) -> Seen:
    return Seen(seen.position_m.T, seen.velocity_m_s.T, seen.angles_rad.T, np.zeros((3, 1)))


def _noise(seed: int, state: State) -> MocapSuite:
    sensors = CRAZYFLIE.sensors
    assert isinstance(sensors, MocapSensors)
    return MocapSuite(MotionCapture(sensors), (seed,), _as_seen(_sight(state)), STEP_S)


def _through(suite: MocapSuite, true: Sight, rates: FloatArray) -> tuple[Sight, FloatArray]:
    """Return what a drone sees through noise, with its true rates."""
    found = suite.estimate(_as_seen(true))
    return Sight(found.position_m.T, found.velocity_m_s.T, found.euler_rad.T), rates


def _own(
    law: SE3Control, seen: Sight, rates: FloatArray, target: FloatArray
) -> tuple[Mapping[str, Any], FloatArray]:
    """Return the control of RotorPy's own controller, and its attitude and thrust."""
    quaternion = Rotation.from_euler("xyz", seen.angles_rad[0]).as_quat()
    state = {"x": seen.position_m[0], "v": seen.velocity_m_s[0], "q": quaternion, "w": rates}
    flat = {"x": target[:3], "x_dot": target[3:6], "x_ddot": target[6:9], "yaw": target[9], "yaw_dot": 0.0}
    control = law.update(0.0, state, flat)
    angles_rad = Rotation.from_quat(control["cmd_q"]).as_euler("xyz")
    return control, np.array([*angles_rad, float(control["cmd_thrust"])])


def _ours(pilot: SimulatorPilot, seen: Sight, target: FloatArray) -> tuple[Mapping[str, Any], FloatArray]:
    """Return the control of a pilot, and its attitude and thrust."""
    command = pilot.command(seen, target)[0]
    attitude = Rotation.from_euler("xyz", command[:3]).as_quat()
    return {"cmd_thrust": float(command[3]), "cmd_q": attitude}, command


def fly_log() -> list[LogRow]:
    """Return the log of the manoeuvre of `identify`, flown through noise with preset `crazyflie`."""
    targets, vehicle = manoeuvre(HEIGHT_M), vehicle_for("cmd_ctatt")
    state = _hover(targets[0, :3])
    pilot, suite = (
        OurSettings(presets.preset("crazyflie"), CRAZYFLIE).pilot(1, MASS_KG, noisy=True),
        _noise(7, state),
    )
    rows: list[LogRow] = []
    ned = np.array([1.0, -1.0, -1.0])
    for step, target in enumerate(targets):
        seen, _ = _through(suite, _sight(state), state["w"])
        control, command = _ours(pilot, seen, target)
        state = vehicle.step(state, control, STEP_S)
        asked_rad = command_in_frame("NWU", command[:2])
        velocity_m_s = (ned * seen.velocity_m_s[0])[:2]
        end = -seen.position_m[0, 2], command[3] / MASS_KG
        rows.append([STEP_S * step, *asked_rad, *(ned * seen.angles_rad[0]), *velocity_m_s, *end])
    return rows


def measure_all(folder: Path) -> Iterator[tuple[str, dict[str, Any], Mapping[str, Any]]]:
    """Yield title, scores and paths of RotorPy's only drone here."""
    yield "RotorPy", *measure(folder)


def measure(folder: Path) -> tuple[dict[str, Any], Mapping[str, Any]]:
    """Return the scores by challenger and mission, and the paths of the first seed on the circle (k, 3)."""
    text, found = identified(fly_log(), folder / "rotorpy.csv", MASS_KG)
    (folder / "rotorpy.toml").write_text(text, "utf-8")
    described = controller_toml.parse(controller_text(DRONE, DRONE.name), DRONE.name)
    challengers: dict[str, Challenger | Geometric] = {
        "SE3Control": Geometric(),
        "SE3Control, planned starts and steps": Geometric(planned=True),
        **laws(CRAZYFLIE),
        "ours, preset `crazyflie`": OurSettings(presets.preset("crazyflie"), CRAZYFLIE),
        "ours, `design crazyflie`": OurSettings(Controller.from_vehicle("crazyflie").settings, CRAZYFLIE),
        "ours, `design` of the nearest drone": OurSettings(described, CRAZYFLIE),
        "ours, `identify`, then `design`": OurSettings(found, CRAZYFLIE),
    }
    figures: dict[str, dict[str, Any]] = {title: {} for title in challengers}
    paths: dict[str, Any] = {}
    for title, challenger in challengers.items():
        for name, mission in MISSIONS.items():
            flights = [fly(challenger, mission, seed) for seed in (None, *SEEDS)]
            flown = Flight3d(*(np.stack(parts, axis=1) for parts in list(zip(*flights, strict=True))[:2]))
            scores: list[Score] = mission.scores(flown)
            changes = [np.diff(commands[:, :2], axis=0) for _, _, commands in flights[1:]]
            figures[title][name] = {
                "truth": scores[0],
                "noise": scores[1:],
                "unrest_rad": float(np.mean([np.abs(change).mean() for change in changes])),
            }
            if name == "circle":
                paths[title] = flown.position_m[:, 1]
        print(f"RotorPy: {title}", flush=True)
    return figures, paths
