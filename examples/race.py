"""Race through gates: a controller for the course lsy_drone_racing; alone, it plans a lap through four gates.

$ python race.py
crazyflie-brushless: ... s through 6 points
...
"""

from functools import lru_cache, partial

import numpy as np
from scipy.spatial.transform import Rotation

from mambo_nmpc import Controller as Nmpc
from mambo_nmpc import DroneState, Plan, PlanPoint, TargetState, Vehicle, attitude_of_quaternion, plan
from mambo_nmpc.curves import sample

try:
    from lsy_drone_racing.control import Controller
except ImportError:
    Controller = object  # outside the course

DRONE, MASS_KG, PERIOD_S = "crazyflie-brushless", 0.0434, 0.02
WIDTH_M, BELOW_M = 0.228, 0.02  # in a gate of 0.4 m, of a drone that touches as a ball of 0.086 m
VIA = {}  # points on the way to a gate, by its number from 0: {1: [PlanPoint(1.4, 0.0, 0.95)]}
START = (-1.0, 1.0, 0.01)  # and gates, each with a place and the direction of flight, of a demonstration
GATES = ((0.5, 1, 0.8, 1, 0, 0), (1.4, 0, 1.2, 0, -1, 0), (0.2, -0.9, 0.9, -1, 0, 0), (-1.2, 0, 1.2, 0, 1, 0))
nmpc = partial(Nmpc.from_vehicle, DRONE, sensors="true", update_period_s=PERIOD_S)


@lru_cache
def lap(start: tuple, gates: tuple) -> Plan:
    """Plan from 0.2 m above a start through gates, each with place and direction, to rest behind the last."""
    points = [PlanPoint(start[0], start[1], start[2] + 0.2)]
    for number, (x, y, z, *way) in enumerate(gates):
        points += [*VIA.get(number, []), PlanPoint(x, y, z - BELOW_M, normal=(*way,), width_m=WIDTH_M)]
    points.append(PlanPoint(*np.add((x, y, z), np.multiply(0.5, way)).tolist(), tolerance_m=0.2))
    return plan(points, Vehicle.of(Vehicle.from_preset(DRONE).drone.with_sensors("true")), nmpc())


class Racer(Controller):
    """Plans when a race begins, and flies the plan."""

    step_callback = staticmethod(lambda *_: False)  # the course decides when a race is over

    def __init__(self, obs: dict, _info: dict, config: dict) -> None:
        gates = np.hstack([obs["gates_pos"], Rotation.from_quat(obs["gates_quat"]).apply([1.0, 0.0, 0.0])])
        start, gates = config["env"]["track"]["drones"][0]["pos"], gates.astype(float).round(3).tolist()
        self.curve, self.nmpc, self.time_s = lap(tuple(start), tuple(map(tuple, gates))).curve, nmpc(), 0.0

    def compute_control(self, obs: dict, _info: dict | None = None) -> np.ndarray:
        """Return roll, pitch, yaw in rad and the thrust in N."""
        now, ahead = (sample(self.curve, self.time_s + late_s, "NWU") for late_s in (0.0, 0.05))
        self.time_s += PERIOD_S
        target = TargetState.in_frame("NWU", *now, yaw_rad=0.0, ahead_m_s2=ahead.acceleration_m_s2)
        state = DroneState.in_frame("NWU", obs["pos"], obs["vel"], attitude_of_quaternion(obs["quat"]))
        return self.nmpc.step(state, target).attitude_thrust("NWU", mass_kg=MASS_KG).astype(np.float32)


if __name__ == "__main__":
    print(lap(START, GATES))
