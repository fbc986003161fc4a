"""RAPTOR in crazyflow: one network for any quadrotor, from the package `foundation-policy`, by motor speeds.

It gets what every controller here gets, and the true body rates besides; nobody tells it the drone.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np
from crazyflow.control import Control
from crazyflow.sim import Sim
from foundation_policy import Raptor
from scipy.spatial.transform import Rotation

from benchmarks.simulators.crazyflow_worlds import (
    FREQ_HZ,
    SimulatedCrazyflie,
    hold,
    noise,
    place,
    rotor_speed,
    sight,
)
from benchmarks.simulators.missions import Flight3d, Mission
from benchmarks.simulators.pilots import through

MOTOR_N: Final = {"cf2x_L250": 0.12}
"""The largest thrust of a motor, which scales what the network commands."""


def fly_raptor(world: SimulatedCrazyflie, mission: Mission, seeds: Sequence[int]) -> Flight3d:
    """Return the flights with each seed of noise."""
    worlds = len(seeds)
    simulation = Sim(
        n_worlds=worlds, drone=world.drone, dynamics=world.model, control=Control.rotor_vel, freq=FREQ_HZ
    )
    targets, times_s = mission.targets(), mission.times_s()
    place(simulation, np.tile(targets[0, :3], (worlds, 1)), world.mass_kg)
    fastest = rotor_speed(simulation, MOTOR_N[world.drone])
    hover = rotor_speed(simulation, world.mass_kg * 9.81 / 4.0)
    policy = Raptor()
    policy.reset()
    action = np.full((worlds, 4), 2.0 * hover / fastest - 1.0)
    position_m, level = np.empty((len(times_s), worlds, 3)), np.empty((len(times_s), worlds))
    suite = noise(sight(simulation), tuple(seeds))
    for step, time_s in enumerate(times_s):
        true = sight(simulation)
        seen = through(suite, true)
        position_m[step] = true.position_m
        level[step] = np.cos(true.angles_rad[:, 0]) * np.cos(true.angles_rad[:, 1])
        turned = Rotation.from_euler("xyz", np.nan_to_num(seen.angles_rad)).as_matrix().reshape(worlds, 9)
        rates = np.asarray(simulation.data.states.ang_vel[:, 0], np.float64)
        off = np.concatenate([seen.position_m - targets[step, :3], turned], axis=1)
        observed = np.concatenate([off, seen.velocity_m_s - targets[step, 3:6], rates, action], axis=1)
        action = np.clip(policy.evaluate_step(np.nan_to_num(observed)), -1.0, 1.0)
        force_n = world.mass_kg * mission.force_m_s2(float(time_s))
        speeds = (action + 1.0) / 2.0 * fastest
        hold(simulation.rotor_vel_control, simulation, speeds, np.broadcast_to(force_n, (worlds, 3)))
    return Flight3d(position_m, level)
