"""Three drones above one another, 0.4 m apart, in gym-pybullet-drones' downwash: their distances.

They hover for 15 s, with the noise of `pybullet_flights`; root mean square from 6 s on, and the lowest's
largest distance from the start on; the median of three seeds. Prints a table in Markdown.
"""

import statistics
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from gym_pybullet_drones.control.DSLPIDControl import DSLPIDControl
from gym_pybullet_drones.envs.CtrlAviary import CtrlAviary
from gym_pybullet_drones.utils.enums import DroneModel, Physics
from scipy.spatial.transform import Rotation

from benchmarks.markdown import table
from benchmarks.simulators.missions import JUDGED_S, LEAST_HEIGHT_M, STEP_S, rms_mm
from benchmarks.simulators.pilots import Designed, Sight, as_seen, through
from benchmarks.simulators.pybullet_flights import DRONE, noise
from benchmarks.simulators.single import SEEDS
from mambo_nmpc.adapters.gym_pybullet_drones import pybullet_control
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.sensors.mocap import MocapSuite, MotionCapture
from mambo_sil.results.number_format import three_digits

PLACES_M: Final = np.array([[0.0, 0.0, 1.8], [0.0, 0.0, 1.4], [0.0, 0.0, 1.0]])
NAMES: Final = ("top", "middle", "lowest", "lowest, at most")
DURATION_S: Final = 15.0


def fly_column(made: Callable[[], Any], seed: int) -> list[float]:
    """Return each drone's error in mm, infinity if it falls, and the lowest's largest distance."""
    env = CtrlAviary(
        drone_model=DroneModel.CF2X,
        num_drones=len(PLACES_M),
        physics=Physics.PYB_DW,
        pyb_freq=300,
        ctrl_freq=100,
        initial_xyzs=PLACES_M,
    )
    seen, _ = env.reset()
    laws = [made() for _ in PLACES_M]
    suite = MocapSuite(
        MotionCapture(noise()), tuple(seed + each for each in range(3)), as_seen(_sight(seen)), STEP_S
    )
    places_m = []
    for _ in range(round(DURATION_S / STEP_S)):
        places_m.append(seen[:, :3])
        seen, *_ = env.step(_commands(laws, through(suite, _sight(seen)), seen[:, 13:16]))
    env.close()
    times_s = np.asarray(STEP_S * np.arange(len(places_m)), np.float64)
    flown_m = np.stack(places_m)
    off_m = np.linalg.norm(flown_m - PLACES_M, axis=-1).T
    least_m = flown_m[times_s >= JUDGED_S, :, 2].min(axis=0)
    errors_mm = [
        rms_mm(each, times_s) if low > LEAST_HEIGHT_M else float("inf")
        for each, low in zip(off_m, least_m, strict=True)
    ]
    return [*errors_mm, 1e3 * float(off_m[-1].max())]


def _sight(seen: FloatArray) -> Sight:
    return Sight(seen[:, :3], seen[:, 10:13], seen[:, 7:10])


def _commands(laws: list[Any], sight: Sight, rates_rad_s: FloatArray) -> FloatArray:
    """Return the speeds of the rotors (3, 4)."""
    quaternions = Rotation.from_euler("xyz", sight.angles_rad).as_quat()
    speeds = [
        law.computeControl(STEP_S, *state, target_pos=place_m)[0]
        for law, *state, place_m in zip(
            laws, sight.position_m, quaternions, sight.velocity_m_s, rates_rad_s, PLACES_M, strict=True
        )
    ]
    return np.stack(speeds)


def main() -> None:
    """Fly, and print the table."""
    contestants: dict[str, Callable[[], Any]] = {
        "`DSLPIDControl`": lambda: DSLPIDControl(DroneModel.CF2X),
        "ours, by the page": lambda: pybullet_control(
            DroneModel.CF2X, Designed(DRONE).controller(1, noisy=True)
        ),
    }
    rows = []
    for who, made in contestants.items():
        errors_mm = zip(*(fly_column(made, seed) for seed in SEEDS), strict=True)
        found = dict(zip(NAMES, map(statistics.median, errors_mm), strict=True))
        rows.append(
            {f"{JUDGED_S:g} to {DURATION_S:g} s, mm": who}
            | {name: three_digits(far) if np.isfinite(far) else "fallen" for name, far in found.items()}
        )
    print(table(rows))


if __name__ == "__main__":
    main()
