"""What a step of controllers returns to a program."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mambo_sil.api.frames import FrameName, command_in_frame, yaw_to_ned
from mambo_sil.arguments import require_number
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import ArgumentError


@dataclass(frozen=True, eq=False)
class StepOutcome:
    """The commands of one step, in batches of the shape of the states.

    command_rad: (..., 2) roll and pitch, never beyond the tilt limit.
    status:      (...) 0, or why an input was refused, such as NaN or a position out of range
                 (`mambo_codegen.methods.shared.inputs.Status`).
    saturated:   (...) whether a command lies at the tilt limit; None with a 1-norm.
    cost:        (...) of the plan; None with a quadratic cost, as the next.
    plan_rad:    (..., control, 2) the moves.
    active:      (...) the limits that act (`mambo_codegen.methods.shared.limits.ActiveLimit`), if any.
    thrust_m_s2: (...) thrust over mass; None without `[height]` in the settings and `height`, as the next.
    yaw_rad:     (...) heading.
    """

    command_rad: NDArray[Any]
    status: NDArray[np.int64]
    saturated: NDArray[np.bool_] | None = None
    cost: NDArray[Any] | None = None
    plan_rad: NDArray[Any] | None = None
    active: NDArray[np.int64] | None = None
    thrust_m_s2: NDArray[Any] | None = None
    yaw_rad: FloatArray | None = None

    def attitude_thrust(
        self, frame: FrameName, *, mass_kg: float | None = None, most_thrust_m_s2: float | None = None
    ) -> FloatArray:
        """Return roll, pitch, yaw and thrust (..., 4), angles in a frame by name.

        The thrust is over the mass, in m/s^2; with `mass_kg` in N; with `most_thrust_m_s2`, the largest
        thrust over the mass, a share of it, at most 1. Raises ArgumentError without a thrust.
        """
        if self.thrust_m_s2 is None or self.yaw_rad is None:
            raise ArgumentError(
                'attitude_thrust needs settings with [height], or a controller made with height = "pid", say'
            )
        if mass_kg is not None and most_thrust_m_s2 is not None:
            raise ArgumentError(f"mass_kg = {mass_kg!r} must be left out with most_thrust_m_s2, or that")
        thrust = np.asarray(self.thrust_m_s2, np.float64)
        if mass_kg is not None:
            require_number("mass_kg", mass_kg, 0.001, 1000.0)
            thrust = thrust * mass_kg
        if most_thrust_m_s2 is not None:
            require_number("most_thrust_m_s2", most_thrust_m_s2, 1.0, 1000.0)
            thrust = np.minimum(thrust / most_thrust_m_s2, 1.0)
        command = np.empty((*thrust.shape, 4))
        command[..., :2] = command_in_frame(frame, self.command_rad)
        command[..., 2] = yaw_to_ned(frame, self.yaw_rad)
        command[..., 3] = thrust
        return command
