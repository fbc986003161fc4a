"""The estimates of a flight as they come: the newest, whether it is late, whether to believe it.

The delay of a link varies, and with it the age of the newest estimate, but a controller counts on one age. It
gets the newest one carried to the mean age, by the change of position, velocity and angles shortly before.
"""

import math
from collections import deque
from typing import Final

from mambo_sil.flight.frames import wrapped
from mambo_sil.life.records import EstimatedState
from mambo_sil.life.steady_frame import doubt

OLDEST_S: Final = 0.1
"""Age of an estimate beyond which nothing is flown by it."""
CLOCK_DRIFT: Final = 0.02
"""By how much the autopilot's clock may be slower than the pilot's; that of PX4's simulator is, by 1.2 %."""
CLOCK_LEAP_S: Final = 1.0
"""Estimates whose clock is ahead by more than this of what it was are not of this autopilot."""
AVERAGE_S: Final = 0.5
"""Time constant of the mean age."""
CHANGE_S: Final = 0.05
"""Least time over which the change of velocity and angles is taken."""
RECENT: Final = 20
"""How many estimates are kept for that."""
SAME_S: Final = 1e-4
"""A state that is carried by less than this stays as it came."""


class Estimates:
    """Takes estimates in any order, and keeps those that are newer than all before them."""

    def __init__(self) -> None:
        self.newest: EstimatedState | None = None
        self.fresh_s = 0.0
        """When the last one that was not late has come."""
        self.doubt: str | None = None
        """Why the last one cannot follow the one before it; None if it can."""
        self._fresh: EstimatedState | None = None
        self._least_lag_s = self._mean_lag_s = math.inf
        """The pilot's clock less the time of an estimate when it came."""
        self._recent: deque[EstimatedState] = deque(maxlen=RECENT)
        """Those that were not late, as long as the estimator moves its frame by no jump that it counts."""

    def receive(self, estimate: EstimatedState, now_s: float, *, in_flight: bool) -> None:
        """Take an estimate that has come; before a flight its clock may leap: the first ones may be old."""
        self.doubt, last, lag_s = None, self.newest, now_s - estimate.time_s
        if last is not None and estimate.time_s <= last.time_s:
            return
        if in_flight and lag_s < self._least_lag_s - CLOCK_LEAP_S:
            return
        since_s = 0.0 if last is None else estimate.time_s - last.time_s
        self._least_lag_s = min(self._least_lag_s + CLOCK_DRIFT * since_s, lag_s)
        self.newest, self.doubt = estimate, None if last is None else doubt(last, estimate)
        if lag_s - self._least_lag_s <= OLDEST_S:
            self._fresh, self.fresh_s = estimate, now_s
            self._remember(estimate, lag_s, since_s)

    def _remember(self, estimate: EstimatedState, lag_s: float, since_s: float) -> None:
        """Keep an estimate that is not late, and its share of the mean age."""
        if abs(lag_s - self._mean_lag_s) <= OLDEST_S:
            lag_s = self._mean_lag_s + min(since_s / AVERAGE_S, 1.0) * (lag_s - self._mean_lag_s)
        self._mean_lag_s = lag_s
        if self._recent and self._recent[-1].resets != estimate.resets:
            self._recent.clear()
        self._recent.append(estimate)

    def take(self) -> EstimatedState | None:
        """Return the newest estimate that is not late, once; None if there is none, or it has been taken."""
        fresh, self._fresh = self._fresh, None
        return fresh

    def carried(self, now_s: float) -> EstimatedState | None:
        """Return the newest estimate that is not late, carried to the mean age; None if there is none."""
        return carry(self._recent, now_s - self._mean_lag_s) if self._recent else None


def carry(recent: deque[EstimatedState], time_s: float) -> EstimatedState:
    """Return the newest of the recent estimates, carried to a time."""
    newest = recent[-1]
    ahead_s = time_s - newest.time_s
    if abs(ahead_s) < SAME_S:
        return newest
    before = next((one for one in reversed(recent) if newest.time_s - one.time_s >= CHANGE_S), recent[0])
    share = ahead_s / max(newest.time_s - before.time_s, CHANGE_S)
    velocity_m_s = newest.velocity_m_s + share * (newest.velocity_m_s - before.velocity_m_s)
    return EstimatedState(
        time_s,
        newest.position_m + 0.5 * ahead_s * (newest.velocity_m_s + velocity_m_s),
        velocity_m_s,
        wrapped(newest.attitude_rad + share * wrapped(newest.attitude_rad - before.attitude_rad)),
        newest.resets,
    )
