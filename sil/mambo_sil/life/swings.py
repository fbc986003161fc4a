"""Notices a loop that swings between its limits of tilt, by settings too quick for the link or the drone."""

from collections import deque
from typing import Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray

NEAR: Final = 0.7
"""Share of the tilt limit from which on a command counts as at one side."""
MOST, WITHIN_S = 10, 3.0
"""So many changes of side, of roll and pitch together, in so short a time are flown by no curve."""


class Swings:
    """Watches commands (2,) of a controller with a tilt limit."""

    def __init__(self, limit_rad: float) -> None:
        self._near_rad = NEAR * limit_rad
        self.begin()

    def begin(self) -> None:
        """Forget what was commanded."""
        self._sides: FloatArray = np.zeros(2)
        self._changes_s: deque[float] = deque(maxlen=MOST)
        self.are_there = False

    def watch(self, command_rad: FloatArray, time_s: float) -> None:
        """Take the command of a time."""
        sides = np.where(np.abs(command_rad) > self._near_rad, np.sign(command_rad), 0.0)
        self._changes_s.extend([time_s] * int((sides * self._sides < 0.0).sum()))
        self._sides = np.where(sides == 0.0, self._sides, sides)
        self.are_there = len(self._changes_s) == MOST and time_s - self._changes_s[0] < WITHIN_S
