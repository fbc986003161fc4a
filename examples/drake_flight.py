"""Fly the generated C in Drake's QuadrotorPlant, whose four rotors stand as a plus; needs the extra drake.

$ python drake_flight.py
from 6 s on 1.1 mm off (rms)
"""

import numpy as np
from pydrake.examples import QuadrotorPlant
from scipy.spatial.transform import Rotation

from mambo_nmpc import Controller, DroneState, TargetState
from mambo_nmpc.adapters.motors import Motors
from mambo_nmpc.curves import Circle, sample

plant = QuadrotorPlant()
context, mass_kg, arm_m = plant.CreateDefaultContext(), plant.m(), plant.length()
controller = Controller.from_vehicle("drake.toml", sensors="true")
plus, turns = [(arm_m, 0.0), (0.0, arm_m), (-arm_m, 0.0), (0.0, -arm_m)], [1, -1, 1, -1]
motors = Motors("drake.toml", rotors_m=plus, reaction=turns)


def derivative(state: np.ndarray, thrusts_n: np.ndarray) -> np.ndarray:
    """Return the time derivative of a state: position, roll, pitch, yaw, and their rates."""
    context.SetContinuousState(state)
    plant.get_input_port(0).FixValue(context, thrusts_n / plant.force_constant())
    return plant.EvalTimeDerivatives(context).CopyToVector()


def body_rates_rad_s(state: np.ndarray) -> np.ndarray:
    """Return the rates about the axes of the body."""
    (roll, pitch, _), (d_roll, d_pitch, d_yaw) = state[3:6], state[9:]
    return np.array(
        [
            d_roll - np.sin(pitch) * d_yaw,
            np.cos(roll) * d_pitch + np.sin(roll) * np.cos(pitch) * d_yaw,
            -np.sin(roll) * d_pitch + np.cos(roll) * np.cos(pitch) * d_yaw,
        ]
    )


circle, errors_m, state = Circle(1.0, 1.5), [], np.zeros(12)
state[:3] = sample(circle, 0.0, "NWU", height_m=1.0).position_m
for step in range(1500):
    now, ahead = (sample(circle, 0.01 * step + late_s, "NWU", height_m=1.0) for late_s in (0.0, 0.05))
    errors_m.append(float(np.linalg.norm(now.position_m - state[:3])))
    target = TargetState.in_frame("NWU", *now, yaw_rad=0.0, ahead_m_s2=ahead.acceleration_m_s2)
    outcome = controller.step(DroneState.in_frame("NWU", state[:3], state[6:9], state[3:6]), target)
    command = outcome.attitude_thrust("NWU", mass_kg=mass_kg)
    for half_tick in range(4):
        if half_tick % 2 == 0:
            quaternion = Rotation.from_euler("xyz", state[3:6]).as_quat()
            thrusts_n = motors.thrusts_n(command, quaternion, body_rates_rad_s(state))
        half = state + 0.00125 * derivative(state, thrusts_n)
        state = state + 0.0025 * derivative(half, thrusts_n)

print(f"from 6 s on {1000 * np.sqrt(np.mean(np.square(errors_m[600:]))):.1f} mm off (rms)")
