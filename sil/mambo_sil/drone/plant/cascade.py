"""The cascade: a PID of each angle around a PID of each body rate, as in the Crazyflie's firmware.

The commands run its equal in C, `flight/engine/cascade.h`, which has the same bits.

The angle error and its integral, less the body rate, demand a body rate; the rate error and its integral,
less the change of the rate, demand an addition to the motor commands. Every integral is limited, and so are
the demanded rate and the addition.
"""

from typing import Final

import numpy as np

from mambo_sil.drone.plant.airframe import airframe_of
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.loops import Demand
from mambo_sil.drone.plant.rotors import distribute, wrench_per_command
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import CascadeAttitude, CascadeGains

ANGLE_INTEGRAL: Final = slice(0, 3)
RATE_INTEGRAL: Final = slice(3, 6)
LAST_RATE: Final = slice(6, 9)
"""Rows of the memory."""


def gain(attitude: CascadeAttitude, name: str) -> FloatArray:
    """Return one gain of roll, pitch and yaw (3, 1)."""
    axes: tuple[CascadeGains, ...] = (attitude.roll, attitude.pitch, attitude.yaw)
    return np.array([[getattr(axis, name)] for axis in axes])


class CascadeLoop:
    """The cascade of a drone; its memory is the integrals of angles and rates, and the last rates."""

    rows = 9

    def __init__(self, drone: VehicleFile, attitude: CascadeAttitude) -> None:
        self._nominal = airframe_of(drone)
        self._step_s = drone.step_s
        self._attitude = attitude
        self._gains = {name: gain(attitude, name) for name in CascadeGains.model_fields}

    def command_motors(self, demand: Demand, memory: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the motor commands (4, n), and the memory (9, n) one tick later."""
        shares, later = self._shares(demand, memory)
        return distribute(self._nominal, shares), later

    def demand_wrench(self, demand: Demand, memory: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return thrust and torques (4, n), and the memory (9, n) one tick later."""
        shares, later = self._shares(demand, memory)
        return shares * wrench_per_command(self._nominal), later

    def _shares(self, demand: Demand, memory: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what thrust, roll, pitch and yaw take of the motor commands (4, n), and the memory."""
        gains, step_s = self._gains, self._step_s
        rates_rad_s = demand.rates_rad_s
        reference_rad = np.empty_like(rates_rad_s)
        reference_rad[:2] = demand.command_rad
        reference_rad[2] = demand.yaw_rad
        error_rad = reference_rad - demand.angles_rad
        angle_integral = _limited(memory[ANGLE_INTEGRAL] + step_s * error_rad, gains["integral_limit_rad_s"])
        rate_demand = gains["p_1_s"] * error_rad + gains["i_1_s2"] * angle_integral - gains["d"] * rates_rad_s
        rate_error = _limited(rate_demand, self._attitude.rate_max_rad_s) - rates_rad_s
        rate_integral = _limited(
            memory[RATE_INTEGRAL] + step_s * rate_error, gains["rate_integral_limit_rad"]
        )
        change_rad_s2 = (rates_rad_s - memory[LAST_RATE]) / step_s
        output = (
            gains["rate_p_s_rad"] * rate_error
            + gains["rate_i_1_rad"] * rate_integral
            - gains["rate_d_s2_rad"] * change_rad_s2
        )
        shares = np.empty((4, rates_rad_s.shape[1]))
        shares[0] = demand.thrust_n / (4.0 * self._nominal.thrust_per_command_n)
        shares[1:] = _limited(output, self._attitude.output_max)
        return shares, np.concatenate([angle_integral, rate_integral, rates_rad_s])


def _limited(value: FloatArray, limit: FloatArray | float) -> FloatArray:
    """Return `value` within plus or minus `limit`."""
    return np.asarray(np.clip(value, -limit, limit))
