"""What every controller admits, whatever its settings: ranges of inputs that are not a matter of choice."""

from typing import Final

ATTITUDE_LIMIT_RAD: Final = 3.25
"""Largest measured roll or pitch: a little more than half a turn, so that degrees are refused."""

YAW_LIMIT_RAD: Final = 1024.0
"""Largest heading, either way, for which the reduction is exact: 652 quarter turns fit in ten bits."""

WEIGHT_LIMIT: Final = 1e6
"""Largest run-time weight, the bound of `cost.tracking_weight` and `cost.effort_weight`."""
