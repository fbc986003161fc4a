"""Fill what a log has lost, and say how well: as well as the rest of the log is filled in the same way."""

from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_sil.drone.plant.arrays import FloatArray

_FEW: Final = 10
"""Samples without which nothing says how well a gap is filled: then it is held to be as bad as the spread."""

_TIMES: Final = (1, 2, 3, 4)
"""How many times as long a gap may be that shows how well another one is filled."""


def fill(values: FloatArray, there: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
    """Return a column (k,) filled where it is not `there` (k,), and the standard deviations (k,) of that.

    A gap is filled by a straight line or, where that fits the rest of the log better, by a cubic through the
    two samples before it and the two behind it. Beyond the first and the last sample they are held.
    """
    places = np.flatnonzero(there)
    filled = np.interp(np.arange(len(values)), places, values[there])
    spread = np.zeros(len(values))
    known = np.where(there, values, np.nan)
    largest = float(values[there].std())
    found: dict[tuple[int, int, bool], float] = {}
    for before, after in pairwise(places.tolist()):
        has_cubic = before > 0 and after + 1 < len(values) and there[before - 1] and there[after + 1]
        for place in range(before + 1, after):
            errors = []
            for cubic in (False, True)[: 1 + has_cubic]:
                way = (after - before, place - before, cubic)
                if way not in found:
                    found[way] = _error(known, *way, largest)
                errors.append(found[way])
            spread[place] = min(errors)
            if errors[-1] < errors[0]:
                offsets, weights = _weights(after - before, place - before, cubic=True)
                filled[place] = values[before + offsets] @ weights
    spread[: places[0]] = spread[places[-1] + 1 :] = largest
    return filled, spread


def _weights(length: int, at: int, *, cubic: bool) -> tuple[NDArray[np.int64], FloatArray]:
    """Return places about the beginning of a gap of `length`, and the weights of their samples at `at`."""
    offsets = np.array([-1, 0, length, length + 1] if cubic else [0, length])
    parts = [np.prod([(at - other) / (one - other) for other in offsets if other != one]) for one in offsets]
    return offsets, np.array(parts)


def _error(known: FloatArray, length: int, at: int, cubic: bool, largest: float) -> float:
    """Return the root mean square error of filling in one way what the log `known` (k,) has.

    Where it has no rows to try that, of filling a gap that is some times as long.
    """
    offsets, weights = _weights(length, at, cubic=cubic)
    for times in _TIMES:
        places = times * offsets
        starts = np.arange(-int(places[0]), max(len(known) - int(places[-1]), -int(places[0])))
        guesses = sum(weight * known[starts + place] for place, weight in zip(places, weights, strict=True))
        errors = known[starts + times * at] - guesses
        errors = errors[np.isfinite(errors)]
        if len(errors) >= _FEW:
            return float(np.sqrt((errors * errors).mean()))
    return largest
