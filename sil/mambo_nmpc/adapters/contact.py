"""Contact with the floor, which simulators do not report but imply: at the floor's height, without climb."""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

HEIGHT_M: Final = 0.01
"""A drone that is less above its height at rest touches the floor."""
CLIMB_M_S: Final = 0.05
"""A drone that climbs or descends faster does not."""


def touches_floor(position_m: Any, velocity_m_s: Any, rest_m: float = 0.0) -> NDArray[np.bool_]:
    """Return whether drones (...) with positions and velocities (..., 3), z up, touch the floor.

    rest_m: the height that the simulator gives for a drone that lies on it.
    """
    height_m, climb_m_s = np.asarray(position_m)[..., 2], np.asarray(velocity_m_s)[..., 2]
    return np.asarray((height_m < rest_m + HEIGHT_M) & (np.abs(climb_m_s) < CLIMB_M_S))
