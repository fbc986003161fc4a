"""The set-point of the yaw loop beside roll, pitch and thrust.

It goes to the heading of the target at `HEADING_RATE_RAD_S` at most: a jump of it takes from the motors the
thrust that carries the drone.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.settings.limits import YAW_LIMIT_RAD
from mambo_sil.api.frames import wrapped
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.controllers.compiled import CompiledController

HEADING_RATE_RAD_S: Final = 4.0


class Heading:
    """Headings of n drones, which `nmpc_slew_heading` turns; each starts at the measured one."""

    def __init__(self, compiled: CompiledController) -> None:
        self._compiled = compiled
        self._most_rad = HEADING_RATE_RAD_S * compiled.settings.horizon.update_period_s
        self.yaw_rad = np.full(compiled.n, np.nan)
        """The last set-points (n,), NaN before the first measured heading that is a number in its range."""

    def reset(self, which: NDArray[np.bool_]) -> None:
        """Forget the headings of the drones in `which` (n,)."""
        self.yaw_rad = np.where(which, np.nan, self.yaw_rad)

    def shift(self, change_rad: FloatArray) -> None:
        """Change the set-points by `change_rad` (n,): the frame has turned."""
        yaw_rad = self.yaw_rad + change_rad
        self.yaw_rad = np.where(np.abs(yaw_rad) <= YAW_LIMIT_RAD, yaw_rad, wrapped(yaw_rad))

    def turn(self, measured_rad: FloatArray, wanted_rad: FloatArray | None) -> FloatArray:
        """Return the next headings (n,), towards the wanted ones if there are any."""
        measured_rad = np.where(np.abs(measured_rad) <= YAW_LIMIT_RAD, measured_rad, np.nan)
        yaw_rad = np.where(np.isnan(self.yaw_rad), measured_rad, self.yaw_rad)
        if wanted_rad is not None:
            turned_rad = self._compiled.slew_heading(yaw_rad, wanted_rad, self._most_rad)
            yaw_rad = np.where(np.isnan(yaw_rad), np.nan, turned_rad)
        self.yaw_rad = yaw_rad
        return yaw_rad
