"""What a picture shows besides a flight."""

import math
from dataclasses import dataclass

from mambo_sil.flight.fences import Walls


@dataclass(frozen=True)
class FlightMarks:
    """The fence, the speed limit in m/s (0: none, or never near), and when the drone crashed (NaN: never)."""

    walls: Walls | None = None
    speed_limit_m_s: float = 0.0
    crash_s: float = math.nan


NO_MARKS = FlightMarks()
