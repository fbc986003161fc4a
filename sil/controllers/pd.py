"""The stock PD position controller of the Mambo, the paper's baseline.

Source: block "XY to angles" of the MathWorks asbQuadcopter example; Kp = 0.24, Kd = 0.1 as in the paper
(section III), after Pounds et al.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mambo_nmpc.sil.plant.arrays import FloatArray
from mambo_nmpc.sil.plant.elementary import sine_cosine

POSITION_P_RAD_M = 0.24
POSITION_D_RAD_S_M = 0.1
ERROR_LIMIT_M = 3.0


@dataclass(frozen=True, eq=False)
class PdOutcome:
    """Result of one step: `command_rad` (n, 2), roll and pitch, and `status` (n,), always 0."""

    command_rad: FloatArray
    status: NDArray[np.int64]


class PdController:
    """Tilt = P x position error - D x velocity, in body axes.

    The error is clamped per axis, the tilt is not; the target's velocity is ignored.
    """

    def step(
        self,
        state: FloatArray,
        target: FloatArray,
        thrust_acceleration_m_s2: FloatArray,  # noqa: ARG002 - part of the interface
    ) -> PdOutcome:
        """Return the commands for states (n, 7) and targets (n, 4) in the world frame.

        The columns are [x, y, vx, vy, roll, pitch, yaw] and [x, y, vx, vy] in m, m/s and rad.
        """
        sine, cosine = sine_cosine(state[:, 6])
        error_x, error_y = target[:, 0] - state[:, 0], target[:, 1] - state[:, 1]
        velocity_x, velocity_y = state[:, 2], state[:, 3]
        forward = np.clip(cosine * error_x + sine * error_y, -ERROR_LIMIT_M, ERROR_LIMIT_M)
        right = np.clip(cosine * error_y - sine * error_x, -ERROR_LIMIT_M, ERROR_LIMIT_M)
        command_rad = np.empty((len(state), 2))
        command_rad[:, 0] = POSITION_P_RAD_M * right - POSITION_D_RAD_S_M * (
            cosine * velocity_y - sine * velocity_x
        )
        command_rad[:, 1] = POSITION_D_RAD_S_M * (cosine * velocity_x + sine * velocity_y) - (
            POSITION_P_RAD_M * forward
        )
        return PdOutcome(command_rad, np.zeros(len(state), dtype=np.int64))
