"""The link between position controller and inner loops: dropped updates and delayed commands.

The commands run its equal in C, `flight/engine/world.h`, which has the same bits.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_sil.drone.plant.arrays import FloatArray, IntArray, PerFlight
from mambo_sil.drone.plant.randomness import Draws, Purpose

NOT_CALLED: Final = -1
"""Status in the trace for an update at which the controller was not called."""


@dataclass(frozen=True, eq=False)
class Link:
    """Delay and losses, one value for all flights or an array (n,); by default there are none."""

    delay_ticks: int | IntArray = 0
    """Delay of every command in ticks; before the first one arrives, the command is zero tilt."""
    dropped_share: PerFlight = 0.0
    """Probability that an update is dropped: the controller is not called, and its last command is held."""


class Wire:
    """Delays the commands of n flights, each by its own number of ticks."""

    def __init__(self, link: Link, first: FloatArray) -> None:
        """Start with commands `first` (rows, n) on the way."""
        flights = first.shape[1]
        self._delay = np.broadcast_to(np.asarray(link.delay_ticks, np.int64), flights)
        self._sent = np.repeat(first[np.newaxis], int(self._delay.max(initial=0)) + 1, axis=0)
        self._flights = np.arange(flights)
        self._tick = 0

    def carry(self, command: FloatArray) -> FloatArray:
        """Accept the command (rows, n) sent at this tick; return the command that arrives at it."""
        depth = len(self._sent)
        if depth == 1:
            return command
        self._sent[self._tick % depth] = command
        arriving = (self._tick - self._delay) % depth
        self._tick += 1
        return np.ascontiguousarray(self._sent[arriving, :, self._flights].T)


class Drops:
    """Draws which updates are dropped, from a random stream of each flight's own."""

    def __init__(self, link: Link, seeds: Sequence[int]) -> None:
        self._share = np.broadcast_to(np.asarray(link.dropped_share, np.float64), len(seeds))
        self._draws = Draws(seeds, Purpose.DROPS, 1, normal=False) if self._share.any() else None

    def next(self) -> NDArray[np.bool_] | None:
        """Return which flights (n,) miss this update; None if no flight ever drops one."""
        return None if self._draws is None else np.asarray(self._draws.next()[0] < self._share)
