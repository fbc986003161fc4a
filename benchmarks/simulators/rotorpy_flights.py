"""Flights of RotorPy's Hummingbird in steps of 10 ms: its `SE3Control`, as shipped and tuned, and ours.

`SE3Control` (Lee, Leok and McClamroch 2010) commands motor speeds and knows the true body rates; ours
commands attitude and thrust through `cmd_ctatt`, whose gains are those of `SE3Control`.
"""

import importlib
import sys
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import numpy as np
from rotorpy.controllers.quadrotor_control import SE3Control
from rotorpy.vehicles.hummingbird_params import quad_params
from rotorpy.vehicles.multirotor import Multirotor
from scipy.spatial.transform import Rotation

from benchmarks.simulators.missions import MISSIONS, STEP_S
from benchmarks.simulators.pilots import Challenger, Designed, Sight, SimulatorPilot
from benchmarks.simulators.single import fly_alone, measure, search
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_sections import MocapSensors
from mambo_sil.flight.frames import attitude_of_quaternion

HUMMINGBIRD: Final = vehicle_toml.preset("hummingbird")
MASS_KG: Final = float(quad_params["mass"])
SEEDS: Final = (101, 102)
TITLE: Final = "RotorPy, Hummingbird"
MEAN_WIND_M_S, GUSTS_M_S, WIND_HEIGHT_M = (2.0, 1.0, 0.0), (1.0, 1.0, 0.5), 2.0


def noise() -> MocapSensors:
    """Return the motion capture of the vehicle."""
    assert isinstance(HUMMINGBIRD.sensors, MocapSensors)
    return HUMMINGBIRD.sensors


def dryden_wind(seed: int) -> Any:
    """Return RotorPy's Dryden wind; its module names PyTorch, which this wind does not use."""
    missing: Any = ModuleType("torch")
    missing.tensor, missing.Tensor, missing.device = np.array, np.ndarray, str
    missing.float32 = missing.float64 = missing.double = float
    sys.modules.setdefault("torch", missing)
    winds: Any = importlib.import_module("rotorpy.wind.dryden_winds")
    np.random.seed(seed)  # noqa: NPY002 - RotorPy draws from there
    means, gusts = np.array(MEAN_WIND_M_S), np.array(GUSTS_M_S)
    return winds.DrydenGust(dt=STEP_S, avg_wind=means, sig_wind=gusts, altitude=WIND_HEIGHT_M)


class RotorpyDrone:
    """A `Multirotor` with `SE3Control`, whose gains get factors, or with ours; in wind if it is asked for."""

    period_s = STEP_S

    def __init__(self, challenger: FloatArray | Challenger, *, windy: bool = False) -> None:
        self._challenger, self._windy = challenger, windy
        abstraction = "cmd_motor_speeds" if isinstance(challenger, np.ndarray) else "cmd_ctatt"
        self._body = Multirotor(quad_params, control_abstraction=abstraction)
        self._pilot: SimulatorPilot | None = None

    def begin(self, position_m: FloatArray, seed: int | None) -> None:
        """Let a drone hover, with a new controller and a new wind."""
        hover_rad_s = float(np.sqrt(MASS_KG * 9.81 / (4.0 * quad_params["k_eta"])))
        rest = {name: np.zeros(3) for name in ("v", "w", "wind")}
        upright = {"q": np.array([0.0, 0.0, 0.0, 1.0]), "rotor_speeds": np.full(4, hover_rad_s)}
        self._state: dict[str, Any] = {"x": np.array(position_m), **rest, **upright}
        self._time_s, self._wind = 0.0, dryden_wind(seed or 0) if self._windy else None
        if not isinstance(self._challenger, np.ndarray):
            self._pilot = self._challenger.pilot(1, MASS_KG, noisy=seed is not None)
            return
        self._law = law = SE3Control(quad_params)
        level, up, slow_level, slow_up, angle, rate = self._challenger
        law.kp_pos = law.kp_pos * np.array([level, level, up])
        law.kd_pos = law.kd_pos * np.array([slow_level, slow_level, slow_up])
        law.kp_att, law.kd_att = law.kp_att * angle, law.kd_att * rate

    def sight(self) -> Sight:
        """Return the true state."""
        state = self._state
        angles_rad = attitude_of_quaternion(state["q"] / np.linalg.norm(state["q"]))
        return Sight(state["x"][np.newaxis], state["v"][np.newaxis], angles_rad[np.newaxis])

    def advance(self, seen: Sight, target: FloatArray, force_m_s2: FloatArray) -> None:
        """Fly for one period."""
        control = self._own(seen, target) if self._pilot is None else self._ours(self._pilot, seen, target)
        self._body.weight = MASS_KG * (np.array([0.0, 0.0, -self._body.g]) + force_m_s2)
        if self._wind is not None:
            self._state["wind"] = np.asarray(self._wind.update(self._time_s, self._state["x"]), np.float64)
        self._state = self._body.step(self._state, control, STEP_S)
        self._time_s += STEP_S

    def _own(self, seen: Sight, target: FloatArray) -> Mapping[str, Any]:
        quaternion = Rotation.from_euler("xyz", seen.angles_rad[0]).as_quat()
        state = {"x": seen.position_m[0], "v": seen.velocity_m_s[0], "q": quaternion, "w": self._state["w"]}
        flat = {"x": target[:3], "x_dot": target[3:6], "x_ddot": target[6:9], "yaw": 0.0, "yaw_dot": 0.0}
        control: Mapping[str, Any] = self._law.update(self._time_s, state, flat)
        return control

    @staticmethod
    def _ours(pilot: SimulatorPilot, seen: Sight, target: FloatArray) -> Mapping[str, Any]:
        command = pilot.command(seen, target)[0]
        attitude = Rotation.from_euler("xyz", command[:3]).as_quat()
        return {"cmd_thrust": float(command[3]), "cmd_q": attitude}


def measure_all(folder: Path) -> Iterator[tuple[str, dict[str, Any], Mapping[str, Any]]]:
    """Yield title, scores and paths; of each the eight in wind, too."""
    _, factors = search(RotorpyDrone, 6, noise())
    (folder / "found.txt").write_text(f"{factors}\n", "utf-8")
    challengers: dict[str, FloatArray | Challenger] = {
        "SE3Control": np.ones(6),
        "SE3Control, tuned": np.array(factors),
        "ours, by the page": Designed(HUMMINGBIRD),
    }
    contestants = {who: partial(RotorpyDrone, each) for who, each in challengers.items()}
    ((title, figures, paths),) = measure(TITLE, contestants, noise(), SEEDS)
    for who, each in challengers.items():
        eight, windy = MISSIONS["eight"], RotorpyDrone(each, windy=True)
        flights = [fly_alone(windy, eight, seed, noise()) for seed in SEEDS]
        figures[who]["wind"] = [eight.scores(flown)[0] for flown in flights]
    yield title, figures, paths
