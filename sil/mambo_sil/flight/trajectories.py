"""Trajectories: target position, velocity and acceleration in the world frame as pure functions of time.

Every curve is centred at the origin. Before t = 0 the target rests on the first point of its curve.
A jump of the position or of the velocity has no acceleration. A trajectory in space has a height, too.
Half-width and radius are in metres, the angular rate in rad/s.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Final, Protocol, Self, TypeGuard

import numpy as np
from numpy.typing import ArrayLike

from mambo_codegen.port.taken import MOST_KNOWN
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.elementary import sine_cosine
from mambo_sil.errors import TrajectoryError
from mambo_sil.flight.course_file import named, read_text, rows_of
from mambo_sil.flight.height_profiles import (
    HeightProfile,
    Swing,
    TakeOffAndLanding,
    UpAndDown,
    helix_climb,
    level,
)
from mambo_sil.flight.names import CurveName

STEP_TIME_S = 1.0
SWING_M: Final = 0.3
"""Amplitude of the height of `tilted-circle` and `swinging-eight`, whatever their size."""
HELIX_PITCH_M: Final = 0.5
"""Rise of `helix` in each turn."""
COLUMNS = ("time_s", "x_m", "y_m")
LARGEST = (1e6, 1e4, 1e4)
"""Largest magnitude of a waypoint's time in s, x in m and y in m."""

SHORTEST_LEG_S = 1e-6
"""Least time from one waypoint to the next, which bounds the velocity."""

Point = tuple[float, float, float]
"""A waypoint: time in s, x and y in m."""


class Trajectory(Protocol):
    """The interface of a trajectory to the closed loop, for one flight or for n.

    A trajectory may have an attribute `known`, what its targets know of their acceleration; 2 without it.
    """

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] in m and m/s.

        Times of shape (...) give (..., 4), or (..., n, 4) with one target for each of n flights.
        """
        ...

    def acceleration(self, time_s: ArrayLike) -> FloatArray:
        """Return [ax, ay] in m/s^2: (..., 2), or (..., n, 2)."""
        ...


class SpatialTrajectory(Trajectory, Protocol):
    """A trajectory with a height; any other one is level, at the hover height."""

    def vertical(self, time_s: ArrayLike) -> FloatArray:
        """Return [height, climb, vertical acceleration] in m, m/s, m/s^2, up: (..., 3), or (..., n, 3)."""
        ...


def _rest_before_start(time_s: ArrayLike, *target: FloatArray) -> FloatArray:
    """Return x, y, vx, vy, each (...), as (..., 4), with velocity 0 where the time (...) is before t = 0."""
    stacked = np.stack(target, axis=-1)
    stacked[..., 2:] *= (np.asarray(time_s) >= 0.0)[..., np.newaxis]
    return stacked


def _none_before_start(time_s: ArrayLike, *acceleration: FloatArray) -> FloatArray:
    """Return ax, ay, each (...), as (..., 2), with 0 where the time (...) is before t = 0."""
    return np.stack(acceleration, axis=-1) * (np.asarray(time_s) >= 0.0)[..., np.newaxis]


@dataclass(frozen=True)
class Bernoulli:
    """Lemniscate of Bernoulli with its long axis along x, from its centre: the paper's figure of eight."""

    half_width_m: float
    angular_rate_rad_s: float

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., 4)."""
        phase = self.angular_rate_rad_s * np.maximum(time_s, 0.0)
        sine, cosine = sine_cosine(phase)
        denominator = 1.0 + cosine * cosine
        x = self.half_width_m * sine / denominator
        speed = self.half_width_m * self.angular_rate_rad_s / (denominator * denominator)
        vx = speed * cosine * (denominator + 2.0 * sine * sine)
        return _rest_before_start(time_s, x, x * cosine, vx, speed * (3.0 * cosine * cosine - 1.0))

    def acceleration(self, time_s: ArrayLike) -> FloatArray:
        """Return [ax, ay] (..., 2)."""
        rate = self.angular_rate_rad_s
        sine, cosine = sine_cosine(rate * np.maximum(time_s, 0.0))
        square = cosine * cosine
        denominator = 1.0 + square
        scale = self.half_width_m * rate * rate * sine / (denominator * denominator * denominator)
        ax = scale * ((12.0 - square) * square - 3.0)
        return _none_before_start(time_s, ax, 2.0 * scale * cosine * (3.0 * square - 5.0))


@dataclass(frozen=True)
class Lissajous:
    """x = a sin(w t), y = a h sin(2 w t): half-width a, ratio h of height to width."""

    half_width_m: float
    angular_rate_rad_s: float
    height: float = 1.0

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., 4)."""
        rate, width, height = self.angular_rate_rad_s, self.half_width_m, self.height * self.half_width_m
        phase = rate * np.maximum(time_s, 0.0)
        (sine, cosine), (sine_2, cosine_2) = sine_cosine(phase), sine_cosine(2.0 * phase)
        vx, vy = width * rate * cosine, 2.0 * height * rate * cosine_2
        return _rest_before_start(time_s, width * sine, height * sine_2, vx, vy)

    def acceleration(self, time_s: ArrayLike) -> FloatArray:
        """Return [ax, ay] (..., 2)."""
        x, y = np.moveaxis(self.target(time_s)[..., :2], -1, 0)
        square = self.angular_rate_rad_s * self.angular_rate_rad_s
        return _none_before_start(time_s, -square * x, -4.0 * square * y)


@dataclass(frozen=True)
class Gerono(Lissajous):
    """Lemniscate of Gerono, x = a sin(w t), y = a sin(w t) cos(w t): a Lissajous curve of half height."""

    height: float = 0.5


@dataclass(frozen=True)
class Circle:
    """Circle about the origin; it starts at (radius, 0) towards +y."""

    radius_m: float
    angular_rate_rad_s: float

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., 4)."""
        rate = self.angular_rate_rad_s
        phase = rate * np.maximum(time_s, 0.0)
        sine, cosine = sine_cosine(phase)
        x, y = self.radius_m * cosine, self.radius_m * sine
        return _rest_before_start(time_s, x, y, -rate * y, rate * x)

    def acceleration(self, time_s: ArrayLike) -> FloatArray:
        """Return [ax, ay] (..., 2)."""
        x, y = np.moveaxis(self.target(time_s)[..., :2], -1, 0)
        square = self.angular_rate_rad_s * self.angular_rate_rad_s
        return _none_before_start(time_s, -square * x, -square * y)


@dataclass(frozen=True)
class Hover:
    """The origin at all times."""

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., 4)."""
        return np.zeros((*np.shape(time_s), 4))

    def acceleration(self, time_s: ArrayLike) -> FloatArray:
        """Return zeros (..., 2)."""
        return np.zeros((*np.shape(time_s), 2))


@dataclass(frozen=True)
class PositionStep:
    """The origin, and from `STEP_TIME_S` on the point (x, y); the target velocity is always 0."""

    x_m: float
    y_m: float

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., 4)."""
        stepped = np.asarray(time_s) >= STEP_TIME_S
        return np.where(stepped[..., np.newaxis], [self.x_m, self.y_m, 0.0, 0.0], 0.0)

    def acceleration(self, time_s: ArrayLike) -> FloatArray:
        """Return zeros (..., 2)."""
        return np.zeros((*np.shape(time_s), 2))


@dataclass(frozen=True)
class Waypoints:
    """Straight lines between waypoints, each at constant speed; the target rests before and after them.

    Its velocity jumps at a waypoint, so no acceleration is known.

    Raises `TrajectoryError` unless times increase and all numbers are within `LARGEST`.
    """

    points: tuple[Point, ...]
    """Rows of time in s, x and y in m."""

    known: ClassVar = 0

    def __post_init__(self) -> None:
        _check([f"point {number}" for number in range(1, len(self.points) + 1)], self.points)

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a CSV file with the columns time_s, x_m, y_m, in any order; other columns are ignored.

        Raises `TrajectoryError`, which names file, line, column and rule.
        """
        with named(path):
            points: dict[str, Any] = rows_of(read_text(path), COLUMNS)
            _check(list(points), tuple(points.values()))
        return cls(tuple(points.values()))

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., 4)."""
        (knots, x, y), (vx, vy) = self._columns
        clock = np.maximum(time_s, 0.0)
        leg = np.searchsorted(knots, clock, side="right")
        place = np.interp(clock, knots, x), np.interp(clock, knots, y)
        return _rest_before_start(time_s, *place, vx[leg], vy[leg])

    @cached_property
    def _columns(self) -> tuple[FloatArray, FloatArray]:
        """Times, x and y (3, k) of the points, and the velocities (2, k + 1) before, between and after them.

        A pilot asks 400 times a second: of thousands of points they are made once.
        """
        columns = np.array(self.points).T.copy()
        return columns, np.pad(np.diff(columns[1:]) / np.diff(columns[0]), ((0, 0), (1, 1)))

    def acceleration(self, time_s: ArrayLike) -> FloatArray:
        """Return zeros (..., 2)."""
        return np.zeros((*np.shape(time_s), 2))


def known_of(trajectory: Trajectory) -> ArrayLike:
    """Return what the targets of a trajectory know of their acceleration, of n flights perhaps (n,)."""
    found: ArrayLike = getattr(trajectory, "known", MOST_KNOWN)
    return found


def _check(places: Sequence[str], points: Sequence[Point]) -> None:
    """Raise `TrajectoryError` for points that cannot be flown; `places` names each point in the message."""
    if not points:
        raise TrajectoryError("holds no waypoint; at least one is needed")
    for place, point in zip(places, points, strict=True):
        for column, value, largest in zip(COLUMNS, point, LARGEST, strict=True):
            if not abs(value) <= largest:
                raise TrajectoryError(
                    f"{place}: {column} = {value} must be a finite number of magnitude {largest:g} or less"
                )
    for place, before, after in zip(places[1:], points, points[1:], strict=False):
        if after[0] - before[0] < SHORTEST_LEG_S:
            raise TrajectoryError(
                f"{place}: time_s = {after[0]} must be later than the {before[0]} before it, "
                f"by {SHORTEST_LEG_S:g} or more"
            )


@dataclass(frozen=True)
class InSpace:
    """A horizontal trajectory with a height."""

    plan: Trajectory
    profile: HeightProfile

    @property
    def known(self) -> ArrayLike:
        """What is known of the plan's acceleration."""
        return known_of(self.plan)

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., 4)."""
        return self.plan.target(time_s)

    def acceleration(self, time_s: ArrayLike) -> FloatArray:
        """Return [ax, ay] (..., 2)."""
        return self.plan.acceleration(time_s)

    def vertical(self, time_s: ArrayLike) -> FloatArray:
        """Return [height, climb, vertical acceleration] (..., 3)."""
        return self.profile.vertical(time_s)


@dataclass(frozen=True)
class Trajectories:
    """One trajectory for each of n flights."""

    each: tuple[Trajectory, ...]

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., n, 4)."""
        found = {id(one): one.target(time_s) for one in self._different}
        return np.stack([found[id(one)] for one in self.each], axis=-2)

    def acceleration(self, time_s: ArrayLike) -> FloatArray:
        """Return [ax, ay] (..., n, 2)."""
        found = {id(one): one.acceleration(time_s) for one in self._different}
        return np.stack([found[id(one)] for one in self.each], axis=-2)

    def vertical(self, time_s: ArrayLike) -> FloatArray:
        """Return [height, climb, vertical acceleration] (..., n, 3)."""
        found = {id(one): vertical_of(one, time_s) for one in self._different}
        return np.stack([found[id(one)] for one in self.each], axis=-2)

    @property
    def known(self) -> ArrayLike:
        """What is known of the acceleration of each (n,)."""
        return np.array([known_of(one) for one in self.each])

    @property
    def spatial(self) -> bool:
        """Whether any of them has a height."""
        return any(is_spatial(one) for one in self._different)

    @property
    def _different(self) -> Iterable[Trajectory]:
        """Each trajectory once: equal ones need not have the same bits, as -0 equals 0."""
        return {id(one): one for one in self.each}.values()


def is_trajectory(value: object) -> bool:
    """Return whether `value` is an object with the methods of a trajectory; a class is none."""
    methods = (getattr(value, name, None) for name in ("target", "acceleration"))
    return not isinstance(value, type) and all(map(callable, methods))


def is_spatial(trajectory: Trajectory) -> bool:
    """Return whether a trajectory, or any of several, has a height."""
    if isinstance(trajectory, Trajectories):
        return trajectory.spatial
    return _has_height(trajectory)


def vertical_of(trajectory: Trajectory, time_s: ArrayLike) -> FloatArray:
    """Return [height, climb, vertical acceleration] of a trajectory (..., 3), or of each (..., n, 3)."""
    return trajectory.vertical(time_s) if _has_height(trajectory) else level(time_s)


def _has_height(trajectory: Trajectory) -> TypeGuard[SpatialTrajectory]:
    """Return whether a trajectory has a method `vertical`; `isinstance` of a protocol takes 20 us."""
    return callable(getattr(trajectory, "vertical", None))


CURVES: Final[dict[CurveName, Callable[[float, float], Trajectory]]] = {
    "bernoulli": Bernoulli,
    "gerono": Gerono,
    "lissajous": Lissajous,
    "circle": Circle,
    "hover": lambda size_m, rate_rad_s: Hover(),  # noqa: ARG005 - has neither size nor rate
    "step": lambda size_m, rate_rad_s: PositionStep(size_m, 0.0),  # noqa: ARG005 - has no rate
    "tilted-circle": lambda size_m, rate_rad_s: InSpace(
        Circle(size_m, rate_rad_s), Swing(SWING_M, rate_rad_s)
    ),
    "helix": lambda size_m, rate_rad_s: InSpace(
        Circle(size_m, rate_rad_s), helix_climb(rate_rad_s, HELIX_PITCH_M)
    ),
    "swinging-eight": lambda size_m, rate_rad_s: InSpace(
        Bernoulli(size_m, rate_rad_s), Swing(SWING_M, 2.0 * rate_rad_s)
    ),
    "height-step": lambda size_m, rate_rad_s: InSpace(Hover(), UpAndDown(size_m)),  # noqa: ARG005 - no rate
    "take-off-and-landing": lambda size_m, rate_rad_s: InSpace(  # noqa: ARG005 - no rate
        Hover(), TakeOffAndLanding(size_m)
    ),
}
"""Curve by name, as a function of size (half-width, radius, step, height, in m) and angular rate in rad/s."""
