"""Flights of gym-pybullet-drones' cf2x: its `DSLPIDControl`, as shipped and tuned, and ours by the adapter.

Physics 300 Hz, control 100 Hz; noise of motion capture, but the angles, which its attitude loop gets too,
with 0.3 mrad.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
import pybullet
from gym_pybullet_drones.control.DSLPIDControl import DSLPIDControl
from gym_pybullet_drones.envs.CtrlAviary import CtrlAviary
from gym_pybullet_drones.utils.enums import DroneModel, Physics
from scipy.spatial.transform import Rotation

from benchmarks.simulators.missions import STEP_S
from benchmarks.simulators.pilots import Designed, Sight
from benchmarks.simulators.single import measure, search
from mambo_nmpc.adapters.gym_pybullet_drones import pybullet_control
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_sections import MocapSensors

DRONE: Final = vehicle_toml.preset("cf2x-pybullet")
ANGLES_RAD: Final = 3e-4


def noise() -> MocapSensors:
    """Return the motion capture of the vehicle with its angles."""
    assert isinstance(DRONE.sensors, MocapSensors)
    return DRONE.sensors.model_copy(update={"attitude_noise_rad": ANGLES_RAD})


class PybulletDrone:
    """A drone of `CtrlAviary` with a `BaseControl`; its own gets factors on its gains, ours none."""

    period_s = STEP_S

    def __init__(self, factors: FloatArray | None = None) -> None:
        self._factors = factors
        self._env = CtrlAviary(
            drone_model=DroneModel.CF2X,
            physics=Physics.PYB,
            pyb_freq=300,
            ctrl_freq=100,
            initial_xyzs=np.array([[0.0, 0.0, 1.0]]),
        )
        self._physics, self._force_n = self._env._physics, np.zeros(3)
        self._env._physics = self._push

    def _push(self, rpm: FloatArray, number: int) -> None:
        """Apply the force in each of its steps."""
        self._physics(rpm, number)
        place_m = self._env.pos[number].tolist()
        force = self._force_n.tolist(), place_m, pybullet.WORLD_FRAME
        pybullet.applyExternalForce(self._env.DRONE_IDS[number], -1, *force, physicsClientId=self._env.CLIENT)

    def begin(self, position_m: FloatArray, seed: int | None) -> None:
        """Place a drone, with a new controller."""
        self._env.INIT_XYZS = position_m[np.newaxis]
        seen, _ = self._env.reset()
        self._state = seen[0]
        if self._factors is None:
            controller = Designed(DRONE).controller(1, noisy=seed is not None)
            self._law = pybullet_control(DroneModel.CF2X, controller)
            return
        law = DSLPIDControl(DroneModel.CF2X)
        pairs = self._factors.reshape(3, 2)
        for name, (level, up) in zip(("P", "I", "D"), pairs, strict=True):
            gains = f"{name}_COEFF_FOR"
            setattr(law, gains, getattr(law, gains) * np.array([level, level, up]))
        self._law = law

    def sight(self) -> Sight:
        """Return the true state."""
        state = self._state
        return Sight(state[np.newaxis, :3], state[np.newaxis, 10:13], state[np.newaxis, 7:10])

    def advance(self, seen: Sight, target: FloatArray, force_m_s2: FloatArray) -> None:
        """Fly for one period."""
        quaternion = Rotation.from_euler("xyz", seen.angles_rad[0]).as_quat()
        places = seen.position_m[0], quaternion, seen.velocity_m_s[0], self._state[13:16]
        rpm, *_ = self._law.computeControl(STEP_S, *places, target_pos=target[:3], target_vel=target[3:6])
        self._force_n = self._env.M * force_m_s2
        seen_after, *_ = self._env.step(rpm[np.newaxis])
        self._state = seen_after[0]


def measure_all(folder: Path) -> Iterator[tuple[str, dict[str, Any], Mapping[str, Any]]]:
    """Yield title, scores and paths."""
    best, factors = search(PybulletDrone, 6, noise())
    (folder / "found.txt").write_text(f"{factors}\n", "utf-8")
    contestants = {
        "DSLPIDControl": lambda: PybulletDrone(np.ones(6)),
        "DSLPIDControl, tuned": lambda: best,
        "ours, by the page": PybulletDrone,
    }
    yield from measure("gym-pybullet-drones, cf2x", contestants, noise())
