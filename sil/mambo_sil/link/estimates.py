"""The estimates of a flight as they come: the newest, whether it is late, and whether to believe it."""

import math
from typing import Final

from mambo_sil.link.records import EstimatedState
from mambo_sil.link.steady_frame import doubt

OLDEST_S: Final = 0.1
"""Age of an estimate beyond which nothing is flown by it."""
CLOCK_DRIFT: Final = 0.02
"""By how much the autopilot's clock may be slower than the pilot's; that of PX4's simulator is, by 1.2 %."""
CLOCK_LEAP_S: Final = 1.0
"""Estimates whose clock is ahead by more than this of what it was are not of this autopilot."""


class Estimates:
    """Takes estimates in any order, and keeps those that are newer than all before them."""

    def __init__(self) -> None:
        self.newest: EstimatedState | None = None
        self.fresh_s = 0.0
        """When the last one that was not late has come."""
        self.doubt: str | None = None
        """Why the last one cannot follow the one before it; None if it can."""
        self._fresh: EstimatedState | None = None
        self._lag_s = math.inf

    def receive(self, estimate: EstimatedState, now_s: float, *, in_flight: bool) -> None:
        """Take an estimate that has come; before a flight its clock may leap: the first ones may be old."""
        self.doubt, last, lag_s = None, self.newest, now_s - estimate.time_s
        if last is not None and estimate.time_s <= last.time_s:
            return
        if in_flight and lag_s < self._lag_s - CLOCK_LEAP_S:
            return
        since_s = 0.0 if last is None else estimate.time_s - last.time_s
        self._lag_s = min(self._lag_s + CLOCK_DRIFT * since_s, lag_s)
        self.newest, self.doubt = estimate, None if last is None else doubt(last, estimate)
        if lag_s - self._lag_s <= OLDEST_S:
            self._fresh, self.fresh_s = estimate, now_s

    def take(self) -> EstimatedState | None:
        """Return the newest estimate that is not late, once; None if there is none, or it has been taken."""
        fresh, self._fresh = self._fresh, None
        return fresh
