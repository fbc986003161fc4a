"""The PDs with which the NMPC is compared: the paper's, and one with feed-forward.

`PdController` is the stock PD position controller of the Mambo, the paper's baseline. Source: block "XY to
angles" of the MathWorks asbQuadcopter example; Kp = 0.24, Kd = 0.1 as in the paper (section III), after
Pounds et al. It neither knows that the target moves nor that it turns.

`PdFeedForwardController` does. Source of its gains: the search in benchmarks/pd_feedforward.py.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.elementary import sine_cosine
from mambo_sil.flight.names import PdName

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


@dataclass(frozen=True)
class PdGains:
    """Gains of the PD with feed-forward.

    position_rad_m:        tilt per position error.
    velocity_rad_s_m:      tilt per velocity error.
    acceleration_rad_s2_m: tilt per acceleration of the target; 1/g would be that of a drone without lag.
    """

    position_rad_m: float
    velocity_rad_s_m: float
    acceleration_rad_s2_m: float


GAINS: Final = PdGains(0.436, 0.357, 0.0905)
TILT_LIMIT_RAD: Final = 0.35
"""The tilt limit of the presets."""


class PdFeedForwardController:
    """Tilt = P x position error + D x velocity error + A x target acceleration, in body axes, clamped.

    Position and velocity errors are those to the moving target, whose acceleration is given.
    """

    def __init__(self, gains: PdGains = GAINS) -> None:
        self.gains = gains

    def step(
        self,
        state: FloatArray,
        target: FloatArray,
        thrust_acceleration_m_s2: FloatArray,  # noqa: ARG002 - part of the interface
    ) -> PdOutcome:
        """Return the commands for states (n, 7) and targets (n, 6); the last two are accelerations."""
        gains = self.gains
        sine, cosine = sine_cosine(state[:, 6])
        tilt_x, tilt_y = (
            gains.position_rad_m * (target[:, axis] - state[:, axis])
            + gains.velocity_rad_s_m * (target[:, 2 + axis] - state[:, 2 + axis])
            + gains.acceleration_rad_s2_m * target[:, 4 + axis]
            for axis in (0, 1)
        )
        command_rad = np.stack([cosine * tilt_y - sine * tilt_x, -(cosine * tilt_x + sine * tilt_y)], axis=-1)
        return PdOutcome(
            np.clip(command_rad, -TILT_LIMIT_RAD, TILT_LIMIT_RAD), np.zeros(len(state), dtype=np.int64)
        )


def pd_controller(name: PdName) -> PdController | PdFeedForwardController:
    """Return the PD called `name`."""
    return PdController() if name == "pd" else PdFeedForwardController()
