"""Fly what the pages of the adapters show, in crazyflow, RotorPy and Gymnasium; write paths. Takes a minute.

    python -m benchmarks.simulators.adapters FOLDER

wants the extras `crazyflow`, `rotorpy` and `gymnasium`.
"""

import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Final

import gymnasium
import numpy as np
from crazyflow.sim import Sim
from rotorpy.environments import Environment
from rotorpy.trajectories.circular_traj import ThreeDCircularTraj
from rotorpy.vehicles.crazyflie_params import quad_params
from rotorpy.vehicles.multirotor import Multirotor

from mambo_nmpc import Controller
from mambo_nmpc.adapters.crazyflow import attach
from mambo_nmpc.adapters.rotorpy import RotorpyController
from mambo_nmpc.curves import Bernoulli, Circle, sample
from mambo_sil.drone.plant.arrays import FloatArray

STEP_S: Final = 0.01
Path3d = tuple[FloatArray, FloatArray, FloatArray]
"""Times (k,), positions (k, 3) and targets (k, 3), in NWU."""


def in_crazyflow() -> Path3d:
    """Fly a circle from the ground."""
    sim = Sim(n_worlds=4, n_drones=1, drone="cf2x_L250")
    controller = Controller.from_vehicle("crazyflie-l250", n=4, sensors="true")
    curve = Circle(1.0, 1.5)
    attach(sim, controller, curve, height_m=1.0)
    times_s, places = np.asarray(STEP_S * np.arange(1000), np.float64), []
    for _ in times_s:
        places.append(np.asarray(sim.data.states.pos[0, 0], np.float64))
        sim.step(round(STEP_S * sim.freq))
    return times_s, np.array(places), sample(curve, times_s, "NWU", height_m=1.0).position_m


def in_rotorpy() -> Path3d:
    """Fly RotorPy's circle from the ground."""
    controller = Controller.from_vehicle("crazyflie", sensors="true")
    flight = Environment(
        Multirotor(quad_params, control_abstraction="cmd_ctatt"),
        RotorpyController(controller, quad_params["mass"]),
        ThreeDCircularTraj(center=[0.0, 0.0, 1.0], radius=[1.0, 1.0, 0.0], yaw_traj="forward"),
        sim_rate=100,
    ).run(t_final=5, terminate=False)
    return flight["time"], flight["state"]["x"], flight["flat"]["x"]


def in_gymnasium() -> Path3d:
    """Fly an eight by targets."""
    environment = gymnasium.make("mambo_nmpc.adapters.gymnasium:MamboNmpc-v0", action="target", speed_m_s=2.0)
    seen, _ = environment.reset(seed=1)
    times_s, places = np.asarray(STEP_S * np.arange(1300), np.float64), []
    for _ in times_s:
        places.append(np.asarray(seen[:3], np.float64))
        ahead = seen[:2] + seen[9:11] + 0.4 * (seen[3:5] + seen[12:14])
        seen, *_ = environment.step(ahead / 5.0)
    return times_s, np.array(places), sample(Bernoulli(2.0, 0.5), times_s, "NWU", height_m=1.0).position_m


FLIGHTS: Final[dict[str, Callable[[], Path3d]]] = {
    "crazyflow": in_crazyflow,
    "rotorpy": in_rotorpy,
    "gymnasium": in_gymnasium,
}


def main(folder: Path) -> None:
    """Fly in each simulator."""
    warnings.filterwarnings("ignore", "Attaching a spec", UserWarning)  # of MuJoCo, which crazyflow uses
    folder.mkdir(parents=True, exist_ok=True)
    for name, fly in FLIGHTS.items():
        times_s, position_m, target_m = fly()
        with (folder / f"{name}.npz").open("wb") as archive:
            np.savez_compressed(archive, time_s=times_s, position_m=position_m, target_m=target_m)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
