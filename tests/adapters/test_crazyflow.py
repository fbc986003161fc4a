"""Flights in crazyflow whose commands XLA computes, beside those that Python asks for."""

import os
import subprocess
import sys
from typing import Final

import pytest

from tests.support.tools import require_module

FLIGHTS: Final = """
import numpy as np
from crazyflow.sim import Sim

from mambo_nmpc import Controller
from mambo_nmpc.adapters import crazyflow
from mambo_nmpc.curves import Circle, Gerono


def flown(measure):
    sim, log = Sim(n_worlds=3, n_drones=2, drone="cf2x_L250"), []
    controller = Controller.from_vehicle("crazyflie-l250", n=6, sensors="true")
    curves = [Circle(1.0, 1.5), Gerono(1.0, 1.0)]
    pilot = crazyflow.attach(sim, controller, curves, yaw_rad=0.3, measure=measure)

    def fly(*counts):
        for count in counts:
            sim.step(count)
            states, commands = sim.data.states, sim.data.controls.attitude.staged_cmd
            log.extend(np.array(each) for each in (states.pos, states.quat, states.vel, commands))
            log.append(controller.disturbance_m_s2)

    fly(1, 4, 7, 500, 13, 5)
    sim.reset(np.array([False, True, False]))
    pilot.yaw_rad, pilot.mass_kg = np.array([[2.0, -2.0]] * 3), np.array([[0.033, 0.034]] * 3)
    fly(2, 1003)
    controller.reset()
    fly(500)
    sim.reset()
    fly(500)
    return log


called, asked = flown(None), flown(lambda *seen: seen)
assert abs(called[-10][..., 2] - 1.0).max() < 0.3, "flies"
print(len(called), sum(np.array_equal(*pair) for pair in zip(called, asked, strict=True)))
"""


@pytest.mark.long
@pytest.mark.thorough
def test_commands_inside_a_program_of_jax_have_the_bits_of_commands_in_python() -> None:
    """States, commands and what is learnt: with partial steps, worlds of two ages, resets, new headings."""
    require_module("crazyflow")  # in a process of its own: it wants to be imported before SciPy
    command = [sys.executable, "-W", "ignore", "-c", FLIGHTS]
    done = subprocess.run(command, env=os.environ, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    called, equal = map(int, done.stdout.split()[-2:])
    assert called == equal == 50
