"""Fly the generated C in four worlds of crazyflow, from the ground to a circle; needs the extra crazyflow.

$ python crazyflow_flight.py
...
on the circle
"""

import numpy as np
from crazyflow.sim import Sim

from mambo_nmpc import Controller
from mambo_nmpc.adapters.crazyflow import attach
from mambo_nmpc.curves import Circle

sim = Sim(n_worlds=4, n_drones=1, drone="cf2x_L250")
controller = Controller.from_vehicle("crazyflie-l250", n=4, sensors="true")
attach(sim, controller, Circle(1.0, 1.5), height_m=1.0)
sim.step(10 * sim.freq)
radius_m = np.linalg.norm(np.asarray(sim.data.states.pos)[:, 0, :2], axis=1)
print("on the circle" if np.allclose(radius_m, 1.0, atol=0.01) else f"off: {radius_m}")
