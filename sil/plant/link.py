"""What lies between position controller and stock loops: updates left out, commands late."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_nmpc.sil.plant.arrays import FloatArray, IntArray, PerFlight
from mambo_nmpc.sil.plant.randomness import Draws, Purpose

NOT_CALLED: Final = -1
"""What stands for a status where the controller was not called."""


@dataclass(frozen=True, eq=False)
class Link:
    """Delay and losses, one value for all flights or one for each (n,); the default is perfect."""

    delay_ticks: int | IntArray = 0
    """Ticks of 5 ms by which every command comes late; until the first arrives the command is level."""
    dropped_share: PerFlight = 0.0
    """Probability that an update is left out: its command is held."""


class Wire:
    """Carries the commands of n flights to the stock loops, each flight with its own delay."""

    def __init__(self, link: Link, flights: int) -> None:
        self._delay = np.broadcast_to(np.asarray(link.delay_ticks, np.int64), flights)
        self._sent = np.zeros((int(self._delay.max(initial=0)) + 1, 2, flights))
        self._each = np.arange(flights)
        self._tick = 0

    def carry(self, command_rad: FloatArray) -> FloatArray:
        """Take the command (2, n) sent at this tick and return the one that arrives."""
        depth = len(self._sent)
        if depth == 1:
            return command_rad
        self._sent[self._tick % depth] = command_rad
        arriving = (self._tick - self._delay) % depth
        self._tick += 1
        return np.ascontiguousarray(self._sent[arriving, :, self._each].T)


class Drops:
    """Says which updates are left out, from each flight's own stream."""

    def __init__(self, link: Link, seeds: Sequence[int]) -> None:
        self._share = np.broadcast_to(np.asarray(link.dropped_share, np.float64), len(seeds))
        self._draws = Draws(seeds, Purpose.DROPS, 1, normal=False) if self._share.any() else None

    def next(self) -> NDArray[np.bool_] | None:
        """Return which flights (n,) miss this update; None if none ever does."""
        return None if self._draws is None else np.asarray(self._draws.next()[0] < self._share)
