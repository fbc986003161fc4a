"""Flights of PyFlyt's cf2x: its cascade of PIDs (mode 7), as shipped and tuned, and ours by the adapter.

Physics 240 Hz, control 120 Hz, its defaults. All know the true state; seeds are those of its motors' noise.
"""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from PyFlyt.core import Aviary
from scipy.spatial.transform import Rotation

from benchmarks.simulators.pilots import Designed, Sight
from benchmarks.simulators.single import measure, search
from mambo_nmpc.adapters.pyflyt import pyflyt_controller
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.vehicles import vehicle_toml

DRONE: Final = vehicle_toml.preset("cf2x-pyflyt")
MASS_KG: Final = DRONE.body.mass_kg
PHYSICS_STEPS: Final = 2
"""Of one period; PyBullet forgets a force after one."""


class PyflytDrone:
    """A drone of `Aviary` with its own cascade, whose gains get factors, or with ours."""

    period_s = 1.0 / 120.0

    def __init__(self, factors: FloatArray | None = None) -> None:
        self._factors = factors
        self._env: Any = None

    def begin(self, position_m: FloatArray, seed: int | None) -> None:
        """Place a drone in a new world, with a new controller."""
        if self._env is not None:
            self._env.disconnect()
        self._env = env = Aviary(position_m[np.newaxis], np.zeros((1, 3)), drone_type="quadx", seed=seed)
        drone = self._drone = env.drones[0]
        drone.motors.throttle[:] = math.sqrt(MASS_KG * 9.81 / 2.0 / DRONE.thrust_gain)
        if self._factors is None:
            law = pyflyt_controller(drone, Designed(DRONE).controller(1, noisy=False))
            drone.register_controller(8, law, base_mode=0)
            env.set_mode(8)
            return
        kp, ki, kd, place, angle, climb = self._factors
        drone.Kp_lin_vel, drone.Ki_lin_vel = kp * drone.Kp_lin_vel, ki * drone.Ki_lin_vel
        drone.Kd_lin_vel, drone.Kp_lin_pos = kd * drone.Kd_lin_vel, place * drone.Kp_lin_pos
        drone.Kp_ang_pos, drone.z_PIDs[1].kp = angle * drone.Kp_ang_pos, climb * drone.z_PIDs[1].kp
        env.set_mode(7)

    def sight(self) -> Sight:
        """Return the true state."""
        _, angles_rad, body_m_s, position_m = self._env.state(0)
        velocity_m_s = Rotation.from_euler("xyz", angles_rad).apply(body_m_s)
        return Sight(position_m[np.newaxis], velocity_m_s[np.newaxis], angles_rad[np.newaxis])

    def advance(self, seen: Sight, target: FloatArray, force_m_s2: FloatArray) -> None:
        """Fly for one period; mode 7 takes no velocity."""
        goal = np.array([target[0], target[1], 0.0, target[2]])
        if self._factors is None:
            goal = np.concatenate([goal, target[3:6]])
        self._env.set_setpoint(0, goal)
        if force_m_s2.any():
            force_n = (PHYSICS_STEPS * MASS_KG * force_m_s2).tolist()
            place_m = seen.position_m[0].tolist()
            self._env.applyExternalForce(self._drone.Id, -1, force_n, place_m, self._env.WORLD_FRAME)
        self._env.step()


def measure_all(folder: Path) -> Iterator[tuple[str, dict[str, Any], Mapping[str, Any]]]:
    """Yield title, scores and paths."""
    best, factors = search(PyflytDrone, 6, None)
    (folder / "found.txt").write_text(f"{factors}\n", "utf-8")
    contestants = {
        "its mode 7": lambda: PyflytDrone(np.ones(6)),
        "its mode 7, tuned": lambda: best,
        "ours, by the page": PyflytDrone,
    }
    yield from measure("PyFlyt, cf2x", contestants, None)
