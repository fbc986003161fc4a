"""A flight by the wall clock: one request every update period, and the replies that come later than that."""

import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Deadlines:
    """How a flight kept its period."""

    period_s: float
    misses: int
    """Replies that came later than a period after their request."""
    worst_lateness_s: float
    """How much later the latest came; 0 if none did."""
    late_requests: int
    """Requests that this machine sent after their time though the reply before was in time."""


class Pace:
    """Holds each request back until a period after the one before.

    A request whose time is over is sent at once, and the next one a period after it, so one delay counts
    once. `clock` returns the time in s, `sleep` waits for some.
    """

    def __init__(
        self,
        period_s: float,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._period_s, self._clock, self._sleep = period_s, clock, sleep
        self._due_s: float | None = None
        self._sent_s = self._worst_lateness_s = 0.0
        self._misses = self._late_requests = 0
        self._missed = False

    @property
    def deadlines(self) -> Deadlines:
        """What was met and missed so far."""
        return Deadlines(self._period_s, self._misses, self._worst_lateness_s, self._late_requests)

    def wait(self) -> None:
        """Wait until the next request is due; the first one is due now."""
        now_s = self._clock()
        due_s = now_s if self._due_s is None else self._due_s
        if now_s > due_s:
            self._late_requests += not self._missed
            due_s = now_s
        while now_s < due_s:
            self._sleep(due_s - now_s)
            now_s = self._clock()
        self._sent_s, self._due_s = now_s, due_s + self._period_s

    def note_reply(self) -> None:
        """Note that the reply to the last request is there."""
        lateness_s = self._clock() - self._sent_s - self._period_s
        self._missed = lateness_s > 0.0
        self._misses += self._missed
        self._worst_lateness_s = max(self._worst_lateness_s, lateness_s)
