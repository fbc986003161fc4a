"""Fly the generated C in MuJoCo, where a drone has four motors and nothing else; needs the extra mujoco.

$ python mujoco_flight.py
from 6 s on 1.2 mm off (rms)
"""

import mujoco
import numpy as np

from mambo_nmpc import Controller, DroneState, TargetState, attitude_of_quaternion
from mambo_nmpc.adapters.motors import Motors
from mambo_nmpc.curves import Circle, sample

PLACES = [(0.106, 0.106), (0.106, -0.106), (-0.106, -0.106), (-0.106, 0.106)]  # ahead, left
TURNS = [1, -1, 1, -1]  # which way a rotor's torque turns the drone, about the axis up
ROTORS = "".join(f'<site name="r{k}" pos="{x} {y} 0"/>' for k, (x, y) in enumerate(PLACES))
MOTORS = "".join(f'<motor site="r{k}" gear="0 0 1 0 0 {0.016 * turn}"/>' for k, turn in enumerate(TURNS))
WORLD = f"""<mujoco>
<option timestep="0.002" integrator="RK4"/>
<worldbody><body><freejoint/>{ROTORS}
<inertial pos="0 0 0" mass="0.5" diaginertia="0.003 0.003 0.005"/></body></worldbody>
<actuator>{MOTORS}</actuator>
</mujoco>"""

model = mujoco.MjModel.from_xml_string(WORLD)
data = mujoco.MjData(model)
controller = Controller.from_vehicle("quad.toml", sensors="true")
motors = Motors("quad.toml", rotors_m=PLACES, reaction=TURNS)
circle, errors_m = Circle(1.0, 1.5), []
data.qpos[:3] = sample(circle, 0.0, "NWU", height_m=1.0).position_m

for step in range(1500):
    now, ahead = (sample(circle, 0.01 * step + late_s, "NWU", height_m=1.0) for late_s in (0.0, 0.05))
    errors_m.append(float(np.linalg.norm(now.position_m - data.qpos[:3])))
    attitude_rad = attitude_of_quaternion(np.roll(data.qpos[3:7], -1))  # MuJoCo's w comes first
    state = DroneState.in_frame("NWU", data.qpos[:3], data.qvel[:3], attitude_rad)
    target = TargetState.in_frame("NWU", *now, yaw_rad=0.0, ahead_m_s2=ahead.acceleration_m_s2)
    command = controller.step(state, target).attitude_thrust("NWU", mass_kg=0.5)
    for _ in range(round(controller.update_period_s / motors.tick_s)):
        data.ctrl[:] = motors.thrusts_n(command, np.roll(data.qpos[3:7], -1), data.qvel[3:6])
        mujoco.mj_step(model, data)

print(f"from 6 s on {1000 * np.sqrt(np.mean(np.square(errors_m[600:]))):.1f} mm off (rms)")
