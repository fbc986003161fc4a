"""Copy an object of the sensors with other numbers in its memory."""

import copy
from collections.abc import Callable
from typing import Any

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.randomness import Draws

_PACKAGE = "mambo_sil.drone.sensors"


class GivenDraws:
    """Stands in for the random numbers of the sensors: returns the row (width, n) that it is given."""

    def __init__(self, row: FloatArray) -> None:
        self._row = row

    def next(self) -> FloatArray:
        """Return the row."""
        return self._row


def rebuild(thing: Any, columns: int, change: Callable[[FloatArray], FloatArray], draws: GivenDraws) -> Any:
    """Return a deep copy of the sensors `thing` of n = `columns` flights with other numbers.

    Every array (..., n) in it becomes what `change` returns for it, always in the same order; random numbers
    come from `draws`.
    """

    def copied(value: Any) -> Any:
        match value:
            case np.ndarray() if value.ndim and value.shape[-1] == columns and value.dtype == np.float64:
                return change(value)
            case list():
                return [copied(one) for one in value]
            case tuple():
                return tuple(copied(one) for one in value)
            case Draws() | GivenDraws():
                return draws
            case _ if type(value).__module__.startswith(_PACKAGE):
                twin = copy.copy(value)
                for name, one in vars(value).items():
                    object.__setattr__(twin, name, copied(one))
                return twin
        return value

    return copied(thing)
