"""Four rotors: mixer, motor command limits, motor lag and wrench.

The commands run its equal in C, `flight/engine/vehicle.h`, which has the same bits.

Rotors seen from above: 1 front left, 2 front right, 3 rear right, 4 rear left. Rotors 1 and 3 spin clockwise
(positive about body z), 2 and 4 counter-clockwise. Thrust is positive upwards, along -z of the body; in the
stock code it is negative upwards.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from mambo_sil.drone.plant.airframe import Airframe
from mambo_sil.drone.plant.arrays import FloatArray, PerFlight
from mambo_sil.drone.plant.elementary import exponential

WRENCH_SIGNS = np.array(
    [
        [1.0, 1.0, 1.0, 1.0],  # thrust
        [1.0, -1.0, -1.0, 1.0],  # roll torque: positive from the left rotors
        [1.0, 1.0, -1.0, -1.0],  # pitch torque: positive from the front rotors
        [-1.0, 1.0, -1.0, 1.0],  # yaw torque: reaction opposite to the spin
    ]
)
"""Sign of each rotor (column) in thrust, roll, pitch and yaw torque (row).

The rows are orthogonal, so the inverse, which the mixer applies, is a quarter of the transpose.
"""

LEAST_YAW: Final = 0.02
"""Share of the largest command that mixer `yaw-last` keeps for yaw in any case."""


def wrench_per_command(nominal: Airframe) -> FloatArray:
    """Return the wrench (4, 1) of four rotors at one unit of command each, if all added to each component."""
    offset = nominal.rotor_offset_m
    lever = np.array([[1.0], [offset], [offset], [nominal.torque_per_thrust_m]])
    return np.asarray(4.0 * lever * nominal.thrust_per_command_n)


def mix(nominal: Airframe, wrench: FloatArray) -> FloatArray:
    """Return the motor commands (4, n) that produce a wrench (4, n), clipped to the command limits."""
    return distribute(nominal, wrench / wrench_per_command(nominal))


def distribute(nominal: Airframe, shares: FloatArray) -> FloatArray:
    """Return the motor commands (4, n) that sum up shares (4, n) of thrust, roll, pitch and yaw, in limits.

    Mixer `yaw-last` takes of yaw what thrust, roll and pitch leave, but at least `LEAST_YAW`. Mixers `lower`
    and `yaw-last` lower all four commands by the excess of the largest one. All of them clip what is left.
    """
    return limit_commands(nominal, WRENCH_SIGNS[:, :, np.newaxis] * shares[:, np.newaxis, :])


def limit_commands(nominal: Airframe, signed: FloatArray) -> FloatArray:
    """Return motor commands (4, n) within their limits, the sums of those of thrust, roll, pitch and yaw.

    signed: (4, 4, n) by what asks for them and by motor; the mixer changes those of yaw.
    """
    if nominal.mixer == "yaw-last":
        others = np.add.reduce(signed[:3], axis=0)
        above, below = nominal.command_max - others.max(axis=0), others.min(axis=0) - nominal.command_min
        room = np.maximum(np.minimum(above, below), LEAST_YAW * nominal.command_max)
        with np.errstate(divide="ignore"):
            signed[3] *= np.minimum(room / np.abs(signed[3]).max(axis=0), 1.0)
    commands: FloatArray = np.add.reduce(signed, axis=0)
    if nominal.mixer != "clip":
        commands = commands - np.maximum(commands.max(axis=0) - nominal.command_max, 0.0)
    return np.asarray(np.clip(commands, nominal.command_min, nominal.command_max))


@dataclass(frozen=True, eq=False)
class Rotors:
    """The rotors of an airframe; their speed follows the command with a first-order lag, 0 for none."""

    airframe: Airframe
    lag_s: PerFlight

    def commanded_speed_rad_s(self, command: FloatArray) -> FloatArray:
        """Return the steady rotor speeds (4, n) of motor commands (4, n)."""
        return np.sqrt(self.airframe.speed_squared_per_command_rad2_s2 * command)

    def decay(self, time_s: FloatArray) -> FloatArray:
        """Return the share (k, 1, n or 1) of a speed error that remains after each of k times (k,)."""
        lag_s = np.atleast_1d(self.lag_s)
        lagging = lag_s > 0.0
        exponent = time_s[:, np.newaxis] / np.where(lagging, lag_s, 1.0)
        return np.asarray(np.where(lagging, exponential(-exponent), 0.0)[:, np.newaxis, :])

    def wrench(self, speed_rad_s: FloatArray) -> FloatArray:
        """Return the wrenches (4, k, n) of rotor speeds (k, 4, n)."""
        thrusts_n = self.airframe.thrust_factor_n_s2 * (speed_rad_s * speed_rad_s)
        wrench: FloatArray = np.add.reduce(WRENCH_SIGNS[:, np.newaxis, :, np.newaxis] * thrusts_n, axis=2)
        wrench[1:3] *= self.airframe.rotor_offset_m
        wrench[3] *= self.airframe.torque_per_thrust_m
        return wrench
