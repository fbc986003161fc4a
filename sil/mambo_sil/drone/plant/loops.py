"""The inner loops of a drone: the altitude loop, and the attitude loops that command motors.

The commands run its equal in C, `flight/engine/vehicle.h`, which has the same bits.

Pairs are in the order roll, pitch; triples end with yaw.
"""

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from mambo_sil.drone.plant.airframe import Airframe, airframe_of
from mambo_sil.drone.plant.arrays import FloatArray, PerFlight
from mambo_sil.drone.plant.rotors import mix
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import MamboAttitude

TAKE_OFF_S: Final = 1.0
TAKE_OFF_EXCESS: Final = 0.45
"""Thrust beyond the weight, as a share of it, without feedback, in the first second of a take-off."""


def take_off_thrust_n(drone: VehicleFile) -> float:
    """Return the constant demand of thrust in the first second of a take-off."""
    return drone.hover_demand_n * (1.0 + TAKE_OFF_EXCESS)


def altitude_thrust(
    drone: VehicleFile, reference_m: PerFlight, z_m: FloatArray, velocity_z_m_s: FloatArray
) -> FloatArray:
    """Return the total thrust (n,) in N, positive upwards, that the altitude loop demands; z points down."""
    gains = drone.altitude
    thrust = drone.weight_n - gains.p_n_m * (reference_m - z_m) + gains.d_n_s_m * velocity_z_m_s
    return np.clip(thrust, -gains.thrust_max_n, gains.thrust_max_n)


@dataclass(frozen=True, eq=False)
class Demand:
    """What an attitude loop is asked for, and what it sees, at one tick."""

    command_rad: FloatArray
    """Roll and pitch (2, n)."""
    yaw_rad: PerFlight
    """Reference of yaw."""
    thrust_n: FloatArray
    """Total thrust (n,)."""
    angles_rad: FloatArray
    """Roll, pitch, yaw (3, n), true or estimated."""
    rates_rad_s: FloatArray
    """Body rates (3, n), true or estimated."""


class MotorLoop(Protocol):
    """An attitude loop that commands motors."""

    @property
    def rows(self) -> int:
        """Rows of its memory, which starts as zeros."""
        ...

    def command_motors(self, demand: Demand, memory: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the motor commands (4, n), and the memory (rows, n) one tick later."""
        ...

    def demand_wrench(self, demand: Demand, memory: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return thrust and torques (4, n) that it asks the motors for, and the same memory."""
        ...


class StockLoop:
    """The Mambo's loop: a PID of each angle demands a torque; its memory is the integrals of roll and pitch.

    Source: the flight control system of the MathWorks asbQuadcopter example, R2018b to R2020a.
    """

    rows = 2

    def __init__(self, drone: VehicleFile, gains: MamboAttitude) -> None:
        self._nominal: Airframe = airframe_of(drone)
        self._gains, self._step_s = gains, drone.step_s
        self._p, self._i, self._d = (
            np.array([[getattr(gains.roll, name)], [getattr(gains.pitch, name)]])
            for name in ("p_n_m", "i_n_m_s", "d_n_m_s")
        )

    def command_motors(self, demand: Demand, memory: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the motor commands (4, n), and the integrals (2, n) one tick later."""
        wrench, integral = self.demand_wrench(demand, memory)
        return mix(self._nominal, wrench), integral

    def demand_wrench(self, demand: Demand, memory: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return thrust and torques (4, n), and the integrals (2, n) one tick later."""
        angles_rad, rates_rad_s = demand.angles_rad, demand.rates_rad_s
        wrench = np.empty((4, angles_rad.shape[1]))
        wrench[0] = demand.thrust_n
        wrench[1:3] = self.attitude_torque(demand.command_rad, angles_rad[:2], rates_rad_s[:2], memory)
        wrench[3] = self.yaw_torque(demand.yaw_rad, angles_rad[2], rates_rad_s[2])
        return wrench, self.attitude_integral(demand.command_rad, angles_rad[:2], memory)

    def attitude_torque(
        self,
        command_rad: FloatArray,
        angle_rad: FloatArray,
        rate_rad_s: FloatArray,
        integral_rad_s: FloatArray,
    ) -> FloatArray:
        """Return the torques (2, n) in N m about body x and y; all arguments are (2, n)."""
        return np.asarray(
            self._p * (command_rad - angle_rad) + self._i * integral_rad_s - self._d * rate_rad_s
        )

    def attitude_integral(
        self, command_rad: FloatArray, angle_rad: FloatArray, integral_rad_s: FloatArray
    ) -> FloatArray:
        """Return the integral (2, n) of the angle error one tick later; it leaks and saturates."""
        limit = self._gains.integral_limit_rad_s
        growth = (command_rad - angle_rad) - self._gains.integral_leak_1_s * integral_rad_s
        return np.clip(integral_rad_s + self._step_s * growth, -limit, limit)

    def yaw_torque(self, reference_rad: PerFlight, yaw_rad: FloatArray, rate_rad_s: FloatArray) -> FloatArray:
        """Return the torque (n,) in N m about body z."""
        gains = self._gains.yaw
        return gains.p_n_m * (reference_rad - yaw_rad) - gains.d_n_m_s * rate_rad_s
