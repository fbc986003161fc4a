"""Random numbers of n flights, each from its own seed: a flight draws the same alone and among others.

Every purpose has a stream of its own, so that sensors, gusts and dropped updates do not shift each other's
numbers: Philox, keyed by NumPy's SeedSequence from the seed and the purpose.
"""

from collections.abc import Sequence
from enum import IntEnum

import numpy as np

from mambo_nmpc.sil.plant.arrays import FloatArray

BLOCK = 64
"""Rows drawn at a time; the numbers do not depend on it."""


class Purpose(IntEnum):
    """What the numbers are for."""

    SENSORS = 0
    GUSTS = 1
    DROPS = 2


def generators(seeds: Sequence[int], purpose: Purpose) -> list[np.random.Generator]:
    """Return the generator of each flight for a purpose."""
    return [
        np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=(purpose,))))
        for seed in seeds
    ]


class Draws:
    """Rows of independent numbers (width, n), drawn in blocks: column i comes from flight i's stream."""

    def __init__(self, seeds: Sequence[int], purpose: Purpose, width: int, *, normal: bool = True) -> None:
        self._generators = generators(seeds, purpose)
        self._block = np.empty((BLOCK, width, len(seeds)))
        self._normal = normal
        self._row = BLOCK

    def next(self) -> FloatArray:
        """Return the next row: standard normal, or uniform in [0, 1)."""
        if self._row == BLOCK:
            shape = self._block.shape[:2]
            for flight, generator in enumerate(self._generators):
                drawn = generator.standard_normal(shape) if self._normal else generator.random(shape)
                self._block[:, :, flight] = drawn
            self._row = 0
        row: FloatArray = self._block[self._row]
        self._row += 1
        return row
