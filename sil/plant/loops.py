"""The stock control loops at 200 Hz: attitude, yaw and altitude, with the gains of the nominal Mambo.

Source: `controllerVars` and the flight control system of the MathWorks asbQuadcopter example, R2018b to
R2020a. Pairs are in the order roll, pitch.
"""

import numpy as np

from mambo_nmpc.sil.plant.airframe import GRAVITY_M_S2, MAMBO
from mambo_nmpc.sil.plant.arrays import FloatArray, PerFlight

PERIOD_S = 0.005

ATTITUDE_P_N_M = np.array([[0.010], [0.013]])
ATTITUDE_I_N_M_S = 0.010
ATTITUDE_D_N_M_S = np.array([[0.0028], [0.0020]])
INTEGRAL_LIMIT_RAD_S = 2.0
INTEGRAL_LEAK_1_S = 0.001

YAW_P_N_M = 0.004
YAW_D_N_M_S = 0.0012

ALTITUDE_P_N_M = 0.8
ALTITUDE_D_N_S_M = 0.3
THRUST_LIMIT_N = 1.20204

WEIGHT_N = float(MAMBO.mass_kg * GRAVITY_M_S2)

TAKE_OFF_S = 1.0
TAKE_OFF_THRUST_N = WEIGHT_N * (1.0 + 0.45)
"""Constant total thrust, without feedback, of the first second of a take-off."""


def attitude_torque(
    command_rad: FloatArray, angle_rad: FloatArray, rate_rad_s: FloatArray, integral_rad_s: FloatArray
) -> FloatArray:
    """Return the torques (2, n) in N m about body x and y; all arguments are (2, n), roll then pitch."""
    return (
        ATTITUDE_P_N_M * (command_rad - angle_rad)
        + ATTITUDE_I_N_M_S * integral_rad_s
        - ATTITUDE_D_N_M_S * rate_rad_s
    )


def attitude_integral(
    command_rad: FloatArray, angle_rad: FloatArray, integral_rad_s: FloatArray
) -> FloatArray:
    """Return the integral (2, n) of the angle error one period later; it leaks and saturates."""
    growth = (command_rad - angle_rad) - INTEGRAL_LEAK_1_S * integral_rad_s
    return np.clip(integral_rad_s + PERIOD_S * growth, -INTEGRAL_LIMIT_RAD_S, INTEGRAL_LIMIT_RAD_S)


def yaw_torque(reference_rad: PerFlight, yaw_rad: FloatArray, rate_rad_s: FloatArray) -> FloatArray:
    """Return the torque (n,) in N m about body z."""
    return YAW_P_N_M * (reference_rad - yaw_rad) - YAW_D_N_M_S * rate_rad_s


def altitude_thrust(reference_m: float, z_m: FloatArray, velocity_z_m_s: FloatArray) -> FloatArray:
    """Return the total thrust (n,) in N, positive upwards, that the altitude loop demands; z points down."""
    thrust = WEIGHT_N - ALTITUDE_P_N_M * (reference_m - z_m) + ALTITUDE_D_N_S_M * velocity_z_m_s
    return np.clip(thrust, -THRUST_LIMIT_N, THRUST_LIMIT_N)
