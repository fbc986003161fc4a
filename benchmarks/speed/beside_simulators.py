"""Processor time of simulated flight beside RotorPy, crazyflow and gym-pybullet-drones, in one run.

Every row is one second of flight of one drone with 100 commands, over the first row: a controller in C in a
campaign. All run in turns; each has its best of some rounds. The laws of RotorPy and ours are called for one
drone; environments of Gymnasium get random commands. Wants crazyflow, RotorPy and gym-pybullet-drones.
"""

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import crazyflow.envs  # noqa: F401 - registers its environments, and sets SCIPY_ARRAY_API before SciPy is loaded
import gymnasium
import numpy as np
from crazyflow.dynamics import Dynamics
from gym_pybullet_drones.envs.HoverAviary import HoverAviary
from rotorpy.controllers.quadrotor_control import SE3Control
from rotorpy.environments import Environment
from rotorpy.trajectories.circular_traj import ThreeDCircularTraj
from rotorpy.vehicles.crazyflie_params import quad_params
from rotorpy.vehicles.multirotor import Multirotor

from benchmarks.markdown import table
from mambo_nmpc import Controller, DroneState, TargetState, Vehicle, campaign

RATE_HZ: Final = 100
ROUNDS: Final = 5
MANY: Final = 1000
OURS: Final = "mambo_nmpc.adapters.gymnasium:MamboNmpc-v0"


class Empty:
    """A law that does nothing."""

    def step(self, state: DroneState, target: TargetState) -> tuple[float, float]:  # noqa: ARG002 - a law's
        """Return a level attitude."""
        return 0.0, 0.0


@dataclass(frozen=True)
class TimedFlights:
    """A function that flies, and how many commands of one drone it takes."""

    name: str
    commands: int
    run: Callable[[], object]


def flown(name: str, law: Any) -> TimedFlights:
    """Return a campaign of 20 flights of 10 s with a law."""
    vehicle, flights, duration_s = Vehicle.from_preset("crazyflie"), 20, 10.0
    calm = {"wind_speed_m_s": 0.0}
    commands = round(flights * duration_s * RATE_HZ)
    return TimedFlights(
        name,
        commands,
        lambda: campaign(
            {"law": law}, vehicle, flights=flights, duration_s=duration_s, sensors="true", draws=calm
        ),
    )


def rotorpy() -> TimedFlights:
    """Return RotorPy's own loop with its own controller, on a circle for 5 s."""
    duration_s = 5.0
    environment = Environment(
        vehicle=Multirotor(quad_params),
        controller=SE3Control(quad_params),
        trajectory=ThreeDCircularTraj(center=np.zeros(3), radius=np.ones(3), freq=np.full(3, 0.2)),
        sim_rate=RATE_HZ,
    )
    return TimedFlights(
        "RotorPy's `Environment` with its SE3Control",
        round(duration_s * RATE_HZ),
        lambda: environment.run(t_final=duration_s, use_mocap=False, terminate=False, plot=False),
    )


def stepped(name: str, environment: Any, steps: int = 50) -> TimedFlights:
    """Return an environment of Gymnasium with random commands."""
    environment.reset(seed=1)
    action = environment.action_space.sample()

    def run() -> None:
        for _ in range(steps):
            seen, *_ = environment.step(action)
        for part in seen.values() if isinstance(seen, dict) else (seen,):
            np.asarray(part)  # waits for what computes still

    return TimedFlights(name, steps * getattr(environment, "num_envs", 1), run)


def cases() -> list[TimedFlights]:
    """Return what is measured; the first is the measure."""
    theirs, many = "DroneFigureEightTrajectory-v0", {"num_envs": MANY}
    pybullet = HoverAviary(pyb_freq=5 * RATE_HZ, ctrl_freq=RATE_HZ)
    return [
        flown("a controller in C, `campaign`", Controller.from_vehicle("crazyflie", sensors="true")),
        flown("an empty law in Python, `campaign`", Empty()),
        rotorpy(),
        *(
            stepped(
                f"Gymnasium, {MANY:,} drones, `{action}`", gymnasium.make_vec(OURS, action=action, **many)
            )
            for action in ("attitude", "target")
        ),
        *(
            stepped(
                f"crazyflow, {MANY:,} drones, `{kind}`",
                gymnasium.make_vec(theirs, freq=RATE_HZ, dynamics=Dynamics(kind), **many),
            )
            for kind in ("so_rpy", "first_principles")
        ),
        stepped("Gymnasium, 1 drone, `attitude`", gymnasium.make(OURS, action="attitude").unwrapped),
        stepped("gym-pybullet-drones, 1 drone, `HoverAviary`", pybullet),
    ]


def main() -> None:
    """Run all in turns, and print the table."""
    warnings.simplefilter("ignore")
    found = cases()
    for one in found:
        one.run()  # builds and compiles
    best_s = dict.fromkeys((one.name for one in found), np.inf)
    for _ in range(ROUNDS):
        for one in found:
            start_s = time.process_time()
            one.run()
            spent_s = (time.process_time() - start_s) / one.commands
            best_s[one.name] = min(best_s[one.name], spent_s)
    first_s = best_s[found[0].name]
    print(
        table(
            [
                {
                    "what flies": name,
                    "processor time": f"{spent_s / first_s:.3g}",
                    "commands a second": f"{float(f'{1.0 / spent_s:.2g}'):,.0f}",
                }
                for name, spent_s in best_s.items()
            ]
        )
    )


if __name__ == "__main__":
    main()
