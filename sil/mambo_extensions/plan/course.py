"""What a plan may choose: the durations of its pieces, and what is free at the knots.

There is a knot at each point, and in a halved course one more between two of them, which is free.

The unknowns are the logarithms of the durations, and at each knot the free derivatives along axes of its own,
times a power of the time that the pieces beside it take: so other durations leave the path nearly as it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_extensions.plan.hermite import motion
from mambo_extensions.plan.least_snap import least_snap
from mambo_extensions.plan.points import PlanPoint
from mambo_sil.drone.plant.arrays import FloatArray

PLANNED_SHARE: Final = 0.5
"""Of a tolerance, what the plan takes; the rest is for the drone."""
FORWARD_M_S: Final = 0.8
"""Least speed along the normal of a gate: a plan that turns back behind it, at 6 m/s^2, comes 5 cm behind its
plane, so that drones beside the plan cross it too."""
START_S_PER_ROOT_M: Final = 1.2
"""First guess of a duration over the root of the distance; it is lengthened until no limit is passed."""


@dataclass(frozen=True, eq=False)
class Choice:
    """What a plan of n pieces may choose; the values at knots are along axes of their own.

    points:  (p + 1,) the knots that are points; a leg leads from one to the next.
    place_m: (n + 1, 3) the points, and places beside which the other knots are.
    axes:    (n + 1, 4, 3, 3) of each knot and derivative; a column is an axis.
    free:    (n + 1, 4, 3) which values along these axes may change.
    reach_m: (n + 1,) how far from the point the plan may pass; 0 of a knot that is none.
    normal:  (n + 1, 3) of the gates; 0 of others.
    allowed: (n,) share of tilt and spare thrust that each piece may take.
    closed:  the last knot is the first.
    """

    points: NDArray[np.intp]
    place_m: FloatArray
    axes: FloatArray
    free: NDArray[np.bool_]
    reach_m: FloatArray
    normal: FloatArray
    allowed: FloatArray
    closed: bool

    @property
    def count(self) -> int:
        """The number of pieces."""
        return len(self.place_m) - 1

    @cached_property
    def distance_m(self) -> FloatArray:
        """From each knot's place to the next (n,)."""
        return np.asarray(np.linalg.norm(np.diff(self.place_m, axis=0), axis=1))

    @cached_property
    def owner(self) -> NDArray[np.intp]:
        """The knot (n + 1,) that has the unknowns of a knot: the first has those of a closed lap's last."""
        owner = np.arange(self.count + 1)
        if self.closed:
            owner[-1] = 0
        return owner

    @cached_property
    def leg(self) -> NDArray[np.intp]:
        """The leg (n,) of each piece, from 0 on."""
        return np.searchsorted(self.points, np.arange(self.count), side="right") - 1

    def point_of(self, knot: int) -> int:
        """Return the number of a knot's point, or of the one before it, from 1 on."""
        return int(np.searchsorted(self.points, self.owner[knot], side="right"))

    def near(self, piece: int) -> tuple[int, int]:
        """Return the numbers of the points at the ends of a piece's leg."""
        begins = int(self.leg[piece])
        return self.point_of(self.points[begins]), self.point_of(self.points[begins + 1])

    @cached_property
    def beside(self) -> FloatArray:
        """Weights (n + 1, n) of the pieces in the time of a knot, a geometric mean."""
        weights = np.zeros((self.count + 1, self.count))
        pieces = np.arange(self.count)
        weights[pieces, pieces] = weights[pieces + 1, pieces] = 0.5
        if self.closed:
            weights[[0, -1]] = weights[0] + weights[-1]
        return np.asarray(weights / weights.sum(axis=1, keepdims=True))

    @cached_property
    def index(self) -> tuple[NDArray[np.intp], NDArray[np.intp], int]:
        """Places of the unknowns: of knots (n + 1, 12), -1 for none, of durations (n,), and their number.

        Those of a piece stand beside those of its knots.
        """
        knots, durations, used = np.full((self.count + 1, 12), -1), np.zeros(self.count, np.intp), 0
        for knot in range(self.count + 1):
            if self.owner[knot] == knot:
                chosen = self.free[knot].ravel()
                knots[knot, chosen] = used + np.arange(chosen.sum())
                used += int(chosen.sum())
            if knot < self.count:
                durations[knot] = used
                used += 1
        return knots[self.owner], durations, used

    def powers(self, duration_s: FloatArray) -> FloatArray:
        """Return the factors (n + 1, 4) of the unknowns of a knot over its values."""
        time_s = np.exp(self.beside @ np.log(duration_s))
        return np.asarray(time_s[:, np.newaxis] ** np.arange(4.0))


@dataclass(frozen=True, eq=False)
class PlannedCourse:
    """A course: what it has at the knots, (n + 1, 4, 3), along the axes of its choice, and durations (n,)."""

    choice: Choice
    value: FloatArray
    duration_s: FloatArray

    @cached_property
    def knots(self) -> FloatArray:
        """Position to jerk at the knots (n + 1, 4, 3)."""
        knots = np.einsum("kocd,kod->koc", self.choice.axes, self.value)
        knots[:, 0] += self.choice.place_m
        return np.asarray(knots)

    @cached_property
    def powers(self) -> FloatArray:
        """Those of the choice."""
        return self.choice.powers(self.duration_s)

    @property
    def time_s(self) -> float:
        """The whole time."""
        return float(self.duration_s.sum())

    @property
    def leg_s(self) -> FloatArray:
        """The time from each point to the next (p,)."""
        return np.add.reduceat(self.duration_s, self.choice.points[:-1])

    @property
    def halved(self) -> "PlannedCourse":
        """The same course, of twice as many pieces: with a free knot in the middle of each.

        A lap of one polynomial from point to point takes 4 % more: its acceleration is not large for long.
        """
        choice = self.choice
        middle = motion(self.knots, self.duration_s, np.array([0.5]))[:4, :, 0].swapaxes(0, 1)
        place_m, value = middle[:, 0].copy(), middle
        value[:, 0] = 0.0
        some, every = np.zeros(choice.count), np.arange(1, choice.count + 1)
        halves = Choice(
            points=2 * choice.points,
            place_m=np.insert(choice.place_m, every, place_m, axis=0),
            axes=np.insert(choice.axes, every, np.eye(3), axis=0),
            free=np.insert(choice.free, every, values=True, axis=0),
            reach_m=np.insert(choice.reach_m, every, some),
            normal=np.insert(choice.normal, every, 0.0, axis=0),
            allowed=np.repeat(choice.allowed, 2),
            closed=choice.closed,
        )
        return PlannedCourse(
            halves, np.insert(self.value, every, value, axis=0), np.repeat(self.duration_s / 2.0, 2)
        )

    def stepped(self, step: FloatArray) -> "PlannedCourse":
        """Return the course with other unknowns: `step` is added."""
        choice = self.choice
        knots, durations, _ = choice.index
        duration_s = self.duration_s * np.exp(step[durations])
        change = np.append(step, 0.0)[knots].reshape(-1, 4, 3)
        before, after = self.powers[:, :, np.newaxis], choice.powers(duration_s)[:, :, np.newaxis]
        moved = (self.value * before + change) / after
        return PlannedCourse(choice, np.where(choice.free, moved, self.value), duration_s)

    def within(self, allowed: FloatArray) -> "PlannedCourse":
        """Return the course whose pieces may take other shares (n,) of tilt and spare thrust."""
        return replace(self, choice=replace(self.choice, allowed=allowed))

    def smooth(self, duration_s: FloatArray) -> "PlannedCourse":
        """Return the course of least snap with durations, through the middle of the points."""
        choice = self.choice
        plain = PlannedCourse(choice, np.where(choice.free, 0.0, self.value), duration_s)
        any_free = np.asarray(choice.free.any(axis=2))
        any_free[:, 0] = False
        knots = least_snap(plain.knots, duration_s, any_free, closed=choice.closed)
        found = np.einsum("kocd,koc->kod", choice.axes, knots)
        found[:, 0] = 0.0
        return PlannedCourse(choice, np.where(choice.free, found, plain.value), duration_s)

    def slower(self, rate: float) -> "PlannedCourse":
        """Return the same path flown at `rate` times its speed."""
        return PlannedCourse(
            self.choice, self.value * rate ** np.arange(4.0)[:, np.newaxis], self.duration_s / rate
        )


def course_of(points: Sequence[PlanPoint], *, closed: bool) -> PlannedCourse:
    """Return what a plan through points may choose; a closed lap returns to the first one."""
    through = [*points, points[0]] if closed else list(points)
    place_m = np.array([point.position_m for point in through])
    count = len(through)
    axes = np.broadcast_to(np.eye(3), (count, 4, 3, 3)).copy()
    value, free = np.zeros((count, 4, 3)), np.ones((count, 4, 3), np.bool_)
    normal = np.zeros((count, 3))
    for knot, point in enumerate(through):
        ends = not closed and knot in (0, count - 1)
        rests = ends and not point.speed_m_s
        if ends:
            free[knot, 0] = False
        if point.normal is not None and not rests:
            normal[knot] = np.array(point.normal) / np.linalg.norm(point.normal)
            axes[knot, 0] = _beginning_with(normal[knot])
            free[knot, 0, 0] = False
        if rests:
            free[knot, 1:] = False
        elif point.speed_m_s is not None or point.direction is not None:
            axes[knot, 1] = _beginning_with(_direction(through, knot, closed=closed))
            free[knot, 1, 1:] = False
            if point.speed_m_s is not None:
                value[knot, 1, 0], free[knot, 1, 0] = point.speed_m_s, False
    reach_m = PLANNED_SHARE * np.array([point.reach_m for point in through])
    reach_m[~free[:, 0].any(axis=1)] = 0.0
    choice = Choice(np.arange(count), place_m, axes, free, reach_m, normal, np.ones(count - 1), closed)
    return PlannedCourse(choice, value, START_S_PER_ROOT_M * np.sqrt(choice.distance_m))


def _direction(points: Sequence[PlanPoint], knot: int, *, closed: bool) -> FloatArray:
    """Return the direction of flight at a point, by default from the one before it to the one after it."""
    given: Any = points[knot].direction
    if given is None:
        before, after = max(knot - 1, 0), min(knot + 1, len(points) - 1)
        if closed and knot in (0, len(points) - 1):
            before, after = len(points) - 2, 1
        given = np.array(points[after].position_m) - np.array(points[before].position_m)
        if not np.linalg.norm(given) > 1e-6:
            given = np.array(points[after].position_m) - np.array(points[knot].position_m)
    return np.asarray(given / np.linalg.norm(given))


def _beginning_with(axis: FloatArray) -> FloatArray:
    """Return three perpendicular axes as columns, the first along `axis`, of length 1."""
    helper = np.eye(3)[np.argmin(np.abs(axis))]
    second = np.cross(axis, helper)
    second /= np.linalg.norm(second)
    return np.stack([axis, second, np.cross(axis, second)], axis=1)
