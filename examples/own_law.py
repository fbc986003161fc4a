"""Compare a law of your own with the generated C: the same drone, circle, cameras and wind.

$ python own_law.py
PID: FlightResult(rms error 8 cm)
MPC: FlightResult(rms error 0.47 cm)
"""

import numpy as np

from mambo_nmpc import Controller, DroneState, TargetState, Vehicle, fly

GRAVITY_M_S2 = 9.81


class Pid:
    """A PID on the position, with the target's acceleration; angles for the drone's own attitude loop."""

    update_period_s = 0.01

    def __init__(self) -> None:
        self.integral_m_s = np.zeros(3)

    def step(self, state: DroneState, target: TargetState) -> list[float]:
        """Return roll and pitch in rad; positions are north, east, down."""
        error_m = target.position_m - state.position_m
        self.integral_m_s += error_m * self.update_period_s
        wanted_m_s2 = 8.0 * error_m + 4.5 * (target.velocity_m_s - state.velocity_m_s)
        wanted_m_s2 += 3.0 * self.integral_m_s
        if target.acceleration_m_s2 is not None:
            wanted_m_s2 += target.acceleration_m_s2
        yaw_rad = state.attitude_rad[2]
        ahead = wanted_m_s2[0] * np.cos(yaw_rad) + wanted_m_s2[1] * np.sin(yaw_rad)
        right = wanted_m_s2[1] * np.cos(yaw_rad) - wanted_m_s2[0] * np.sin(yaw_rad)
        return [right / GRAVITY_M_S2, -ahead / GRAVITY_M_S2]


if __name__ == "__main__":
    for name, law in {"PID": Pid(), "MPC": Controller.from_vehicle("crazyflie")}.items():
        flown = fly(
            law,
            Vehicle.from_preset("crazyflie"),
            "circle",
            size_m=1.0,
            rate_rad_s=1.5,
            duration_s=20.0,
            sensors="mocap",
            wind_speed_m_s=3.0,  # 6 m above the ground, with its gusts
            measured_from_s=6.0,
        )
        print(f"{name}: {flown}")
