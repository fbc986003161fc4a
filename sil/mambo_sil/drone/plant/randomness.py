"""Random numbers of n flights, each from its own seed: a flight draws the same numbers alone and in a batch.

Each flight has one stream per purpose, so switching gusts on does not change the sensor noise. The generator
is Philox; NumPy's SeedSequence derives its key from seed and purpose.
"""

from collections.abc import Sequence
from enum import IntEnum

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray

BLOCK = 64
"""Rows drawn at once, for speed; the numbers do not depend on it."""


class Purpose(IntEnum):
    """Purpose of a random stream."""

    SENSORS = 0
    GUSTS = 1
    DROPS = 2


def generators(seeds: Sequence[int], purpose: Purpose) -> list[np.random.Generator]:
    """Return one generator per flight for a purpose."""
    return [
        np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=(purpose,))))
        for seed in seeds
    ]


class Draws:
    """Draws rows (width, n) of independent numbers; column i comes from the stream of flight i."""

    def __init__(self, seeds: Sequence[int], purpose: Purpose, width: int, *, normal: bool = True) -> None:
        self._generators = generators(seeds, purpose)
        self._block = np.empty((BLOCK, width, len(seeds)))
        self._normal = normal
        self._row = BLOCK

    def next(self) -> FloatArray:
        """Return the next row (width, n): standard normal, or uniform in [0, 1)."""
        if self._row == BLOCK:
            shape = self._block.shape[:2]
            for flight, generator in enumerate(self._generators):
                drawn = generator.standard_normal(shape) if self._normal else generator.random(shape)
                self._block[:, :, flight] = drawn
            self._row = 0
        row: FloatArray = self._block[self._row]
        self._row += 1
        return row
