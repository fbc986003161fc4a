"""Trajectories: target position and velocity in the world frame as pure functions of time.

Every curve has its centre at the origin, and starts on its first point: before t = 0 the target waits
there at rest. Half-width and radius are in metres, angular rate in rad/s.
"""

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, Self

import numpy as np
from numpy.typing import ArrayLike

from sil.arrays import FloatArray
from sil.errors import TrajectoryError

STEP_TIME_S = 1.0
COLUMNS = ("time_s", "x_m", "y_m")


class Trajectory(Protocol):
    """What the closed loop asks of a trajectory, of one flight or of many."""

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] in m and m/s.

        Times of shape (...) give (..., 4), or (..., n, 4) if n flights have a target of their own.
        """
        ...


def _held_before_start(time_s: FloatArray, target: FloatArray) -> FloatArray:
    """Take the velocity out of targets (..., 4) whose time (...) lies before the start."""
    target[..., 2:] *= (time_s >= 0.0)[..., np.newaxis]
    return target


@dataclass(frozen=True)
class Bernoulli:
    """Lemniscate of Bernoulli from its centre, along x: the figure of eight of the paper."""

    half_width_m: float
    angular_rate_rad_s: float

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., 4)."""
        times = np.asarray(time_s, dtype=np.float64)
        phase = self.angular_rate_rad_s * np.maximum(times, 0.0)
        sine, cosine = np.sin(phase), np.cos(phase)
        denominator = 1.0 + cosine * cosine
        x = self.half_width_m * sine / denominator
        speed = self.half_width_m * self.angular_rate_rad_s / (denominator * denominator)
        return _held_before_start(
            times,
            np.stack(
                [
                    x,
                    x * cosine,
                    speed * cosine * (denominator + 2.0 * sine * sine),
                    speed * (3.0 * cosine * cosine - 1.0),
                ],
                axis=-1,
            ),
        )


@dataclass(frozen=True)
class Lissajous:
    """x = a sin(w t), y = a h sin(2 w t) with a height h relative to the half-width a."""

    half_width_m: float
    angular_rate_rad_s: float
    height: float = 1.0

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., 4)."""
        times = np.asarray(time_s, dtype=np.float64)
        phase = self.angular_rate_rad_s * np.maximum(times, 0.0)
        width, height = self.half_width_m, self.height * self.half_width_m
        rate = self.angular_rate_rad_s
        return _held_before_start(
            times,
            np.stack(
                [
                    width * np.sin(phase),
                    height * np.sin(2.0 * phase),
                    width * rate * np.cos(phase),
                    2.0 * height * rate * np.cos(2.0 * phase),
                ],
                axis=-1,
            ),
        )


@dataclass(frozen=True)
class Gerono:
    """Lemniscate of Gerono, x = a sin(w t), y = a sin(w t) cos(w t): a Lissajous curve of half height."""

    half_width_m: float
    angular_rate_rad_s: float

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., 4)."""
        return Lissajous(self.half_width_m, self.angular_rate_rad_s, height=0.5).target(time_s)


@dataclass(frozen=True)
class Circle:
    """Circle about the origin from (radius, 0), towards +y."""

    radius_m: float
    angular_rate_rad_s: float

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., 4)."""
        times = np.asarray(time_s, dtype=np.float64)
        phase = self.angular_rate_rad_s * np.maximum(times, 0.0)
        x, y = self.radius_m * np.cos(phase), self.radius_m * np.sin(phase)
        rate = self.angular_rate_rad_s
        return _held_before_start(times, np.stack([x, y, -rate * y, rate * x], axis=-1))


@dataclass(frozen=True)
class Hover:
    """The origin, for ever."""

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., 4)."""
        return np.zeros((*np.shape(time_s), 4))


@dataclass(frozen=True)
class Step:
    """The origin, and from `STEP_TIME_S` on another point at rest."""

    x_m: float
    y_m: float

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., 4)."""
        stepped = np.asarray(time_s) >= STEP_TIME_S
        return np.where(stepped[..., np.newaxis], [self.x_m, self.y_m, 0.0, 0.0], 0.0)


@dataclass(frozen=True)
class Waypoints:
    """Straight lines between points, each reached at its time; the first and the last point are held."""

    points: tuple[tuple[float, float, float], ...]
    """Rows of (time s, x m, y m), times increasing."""

    def __post_init__(self) -> None:
        if not self.points:
            raise TrajectoryError("no waypoint: at least one row is needed")
        for number, point in enumerate(self.points, start=1):
            if not all(math.isfinite(value) for value in point):
                raise TrajectoryError(f"row {number}: {point} must be finite numbers")
        for number, (before, after) in enumerate(zip(self.points, self.points[1:], strict=False), start=2):
            if after[0] <= before[0]:
                raise TrajectoryError(
                    f"row {number}: time_s = {after[0]:g} must be later than {before[0]:g} of the row before"
                )

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a CSV file with the columns time_s, x_m, y_m; row 1 is the first below the header.

        Raises `TrajectoryError`, naming file, row and rule.
        """
        try:
            with path.open(newline="", encoding="utf-8-sig") as file:
                return cls(_points(csv.DictReader(file)))
        except (OSError, UnicodeDecodeError, csv.Error) as error:
            raise TrajectoryError(f"{path}: cannot be read: {error}") from error
        except TrajectoryError as error:
            raise TrajectoryError(f"{path}: {error}") from error

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., 4)."""
        times = np.asarray(time_s, dtype=np.float64)
        knots, x, y = np.array(self.points).T
        clock = np.maximum(times, 0.0)
        leg = np.searchsorted(knots, clock, side="right")
        velocity = np.zeros((len(knots) + 1, 2))
        velocity[1:-1] = np.stack([np.diff(x), np.diff(y)], axis=-1) / np.diff(knots)[:, np.newaxis]
        position = np.stack([np.interp(clock, knots, x), np.interp(clock, knots, y)], axis=-1)
        return _held_before_start(times, np.concatenate([position, velocity[leg]], axis=-1))


def _points(rows: "csv.DictReader[str]") -> tuple[tuple[float, float, float], ...]:
    """Turn the rows of a CSV file into points; errors name row and column."""
    missing = [column for column in COLUMNS if column not in (rows.fieldnames or ())]
    if missing:
        raise TrajectoryError(f"header: column {', '.join(missing)} is missing; need {', '.join(COLUMNS)}")
    return tuple(
        (_number(row, number, "time_s"), _number(row, number, "x_m"), _number(row, number, "y_m"))
        for number, row in enumerate(rows, start=1)
    )


def _number(row: dict[str, str], number: int, column: str) -> float:
    """Return one field of a CSV row as a number."""
    text = row[column]
    try:
        return float(text)
    except (TypeError, ValueError):
        raise TrajectoryError(f"row {number}: {column} = {text!r} must be a number") from None


@dataclass(frozen=True)
class Trajectories:
    """One trajectory for each of n flights."""

    each: tuple[Trajectory, ...]

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., n, 4)."""
        return np.stack([trajectory.target(time_s) for trajectory in self.each], axis=-2)
