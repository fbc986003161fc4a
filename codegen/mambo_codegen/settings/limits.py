"""Limits of inputs that are the same for every controller, whatever its settings."""

from typing import Final

ATTITUDE_LIMIT_RAD: Final = 3.25
"""Largest measured roll or pitch: just over half a turn, so that most values in degrees are refused."""

YAW_LIMIT_RAD: Final = 1024.0
"""Largest yaw, either way: its 652 quarter turns fit in ten bits, so the argument reduction is exact."""

WEIGHT_LIMIT: Final = 1e6
"""Largest weight at run time; the same as the bound of the settings of `cost`."""
