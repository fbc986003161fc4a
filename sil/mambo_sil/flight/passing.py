"""Points that a course passes, each at the end of a piece: how far from them a drone has flown."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.results.number_format import distance
from mambo_sil.results.summary import Number, Summary

LATE_S: Final = 0.4
"""A drone passes a point within this of its time, and within half a piece."""

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class PassedPoint:
    """A point to be passed, in m along x ahead, y to the left, z up.

    number:  in the list of points, from 1 on.
    reach_m: how far from it the drone may pass.
    normal:  of a gate, through whose plane the drone must fly along this direction.
    """

    number: int
    place_m: Vector
    reach_m: float
    normal: Vector | None = None


class PassedSummary(Summary):
    """How far from a point a drone passed; infinity if it did not fly through the plane of a gate."""

    command = "passed-point"

    number: int
    off_m: Number
    reach_m: Number

    @property
    def missed(self) -> bool:
        """Whether it is farther away than allowed."""
        return not self.off_m <= self.reach_m


def missed_words(passed: Sequence[PassedSummary]) -> str:
    """Return whether a drone passed all points, or how many it missed, and the worst of them."""
    missed = [one for one in passed if one.missed]
    if not missed:
        return f"passes all {len(passed)} points"
    worst = max(missed, key=lambda one: math.inf if math.isnan(one.off_m) else one.off_m / one.reach_m)
    how = (
        f"passed {distance(worst.off_m)} away, where {distance(worst.reach_m)} are allowed"
        if math.isfinite(worst.off_m)
        else "through whose gate it does not fly"
    )
    return f"MISSES {len(missed)} of {len(passed)} points; the worst is point {worst.number}, {how}"


def distances_m(
    time_s: FloatArray,
    path_m: FloatArray,
    points: Sequence[PassedPoint],
    passed_s: FloatArray,
) -> FloatArray:
    """Return how far from each of p points n drones pass (n, p), of a gate where they cross it; NaN if lost.

    path_m:   (k, n, 2 or 3) at the times (k,), along the first axes of the points.
    passed_s: (p + 1,) when the course begins, and when it passes each point.
    """
    axes, found = path_m.shape[-1], []
    for number, point in enumerate(points):
        pieces_s = np.diff(passed_s)[number : number + 2]
        near_s = min(LATE_S, *(0.5 * pieces_s))
        first, last = np.searchsorted(
            time_s, [passed_s[number + 1] - near_s, passed_s[number + 1] + near_s]
        ).tolist()
        place = path_m[max(first - 1, 0) : last + 1] - np.array(point.place_m[:axes])
        if point.normal is None:
            found.append(_nearest_m(place))
        else:
            found.append(_crossed_m(place, np.array(point.normal[:axes])))
    return np.stack(found, axis=-1)


def passes(
    points: Sequence[PassedPoint],
    passed_s: FloatArray,
    time_s: FloatArray,
    path_m: FloatArray,
    *,
    repeats: bool,
) -> list[PassedSummary]:
    """Return how far from each point one drone passes, of those whose time has come.

    passed_s: (p + 1,) 0, and when the course passes each point.
    time_s:   (k,) on the course, which begins at 0.
    path_m:   (k, 2 or 3) of the drone.
    repeats:  the course is a lap: the last whole one counts.
    """
    lap_s = float(passed_s[-1])
    laps = math.floor((float(time_s[-1]) + 1e-6) / lap_s) if repeats else 1
    begins_s = lap_s * max(laps - 1, 0)
    due = int(np.sum(begins_s + passed_s[1:] <= time_s[-1] + 1e-6))
    judged = points[:due]
    if not judged:
        return []
    (off_m,) = distances_m(time_s, path_m[:, np.newaxis], judged, begins_s + passed_s)
    return [
        PassedSummary(number=point.number, off_m=float(off), reach_m=point.reach_m)
        for point, off in zip(judged, off_m, strict=True)
    ]


def _nearest_m(place: FloatArray) -> FloatArray:
    """Return the least distance (n,) of paths (k, n, 3), straight between their samples, from the origin."""
    step = np.diff(place, axis=0)
    square = np.maximum(np.sum(step * step, axis=-1), 1e-18)
    share = np.clip(-np.sum(place[:-1] * step, axis=-1) / square, 0.0, 1.0)
    nearest = place[:-1] + share[..., np.newaxis] * step
    return np.asarray(_length_m(nearest).min(axis=0))


def _crossed_m(place: FloatArray, normal: FloatArray) -> FloatArray:
    """Return how far from the origin paths (k, n, 3) cross its plane along the normal; infinity without."""
    along = np.sum(place * normal, axis=-1)
    crosses: NDArray[np.bool_] = (along[:-1] < 0.0) & (along[1:] >= 0.0)
    share = np.where(crosses, -along[:-1] / np.where(crosses, along[1:] - along[:-1], 1.0), 0.0)
    there = place[:-1] + share[..., np.newaxis] * np.diff(place, axis=0)
    return np.asarray(np.where(crosses, _length_m(there), np.inf).min(axis=0))


def _length_m(place: FloatArray) -> FloatArray:
    """Return the length (...) of vectors (..., 2 or 3)."""
    return np.asarray(np.sqrt(np.sum(place * place, axis=-1)))
