"""What a flight is made of: phases, timers, and its end."""

import math
from dataclasses import dataclass
from enum import Enum


class Phase(Enum):
    """Phases of a flight, in words."""

    CONNECTING = "connecting"
    CHECKING = "checking"
    ARMING = "arming"
    CLIMBING = "climbing"
    FLYING = "flying"
    LANDING = "landing"
    STOPPING = "stopping the motors"
    ENDED = "ended"


@dataclass(frozen=True)
class FlightEnd:
    """How a flight ended; good if as planned."""

    sentence: str
    good: bool


class Timer:
    """Is due at once, and then every period."""

    def __init__(self, period_s: float) -> None:
        self._period_s, self._next_s = period_s, -math.inf

    def is_due(self, now_s: float) -> bool:
        """Return whether the period is over; it then begins anew."""
        if now_s < self._next_s:
            return False
        self._next_s = now_s + self._period_s
        return True
