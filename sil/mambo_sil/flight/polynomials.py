"""Trajectories of polynomial pieces, as planners write them and the Crazyflie's commander takes them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
from numpy.typing import ArrayLike

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import TrajectoryError
from mambo_sil.flight.course_file import header_of, named, read_text, rows_of
from mambo_sil.flight.passing import LATE_S, PassedPoint, PassedSummary, passes
from mambo_sil.flight.trajectories import Trajectory, Waypoints

COEFFICIENTS: Final = 8
"""Of a polynomial, from the constant to that of the seventh power of the time since its piece began."""
COLUMNS: Final = (
    "duration",
    *(f"{axis}^{power}" for axis in ("x", "y", "z", "yaw") for power in range(COEFFICIENTS)),
)
"""In s, m and rad; x ahead, y to the left, z up."""
POINT_COLUMNS: Final = (
    *("point", "point_x", "point_y", "point_z", "reach"),
    *("normal_x", "normal_y", "normal_z"),
)
"""Of the point at the end of a piece, which a file of `plan` has too: its number, place, how far from it a
drone may pass, and the direction through a gate."""
SAME: Final = 1e-3
"""In m and m/s, by which the end of a lap that repeats may differ from its beginning."""
LARGEST: Final = 1e6
"""Largest magnitude of a coefficient, and of a duration."""
SHORTEST_S: Final = 1e-6

AXES: Final = ("north", "east", "height")

Coefficients = tuple[float, ...]


@dataclass(frozen=True)
class Piece:
    """Polynomials of the time since a piece began, in s: COEFFICIENTS each, in m."""

    duration_s: float
    north: Coefficients
    east: Coefficients
    height: Coefficients


@dataclass(frozen=True)
class Pieces:
    """Polynomial pieces, one after the other, at the hover height; the target rests before and behind them.

    A jump from one piece to the next has neither velocity nor acceleration. Pieces that end as they begin, in
    flight, are a lap that repeats.

    points: those at the ends of the pieces, which a drone must pass, None at an end without one; none at all
            where nothing is known of them.
    Raises `TrajectoryError` unless durations are positive and all numbers are within `LARGEST`.
    """

    pieces: tuple[Piece, ...]
    points: tuple[PassedPoint | None, ...] = ()

    def __post_init__(self) -> None:
        _check([f"piece {number}" for number in range(1, len(self.pieces) + 1)], self.pieces)

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a CSV file with `COLUMNS`, in any order, and points if it has them; other columns are ignored.

        Raises `TrajectoryError`, which names file, line, column and rule.
        """
        with named(path):
            text = read_text(path)
            rows = rows_of(text, COLUMNS)
            pieces = tuple(_piece(line, row) for line, row in rows.items())
            _check(list(rows), pieces)
            points = _points(text)
        return cls(pieces, points)

    @property
    def duration_s(self) -> float:
        """The time at which the last piece ends."""
        return float(self._ends[-1])

    @property
    def flown_s(self) -> float:
        """The time in which a flight of the pieces is judged, in tenths: a second lap if they repeat.

        A drone passes the last point a little late.
        """
        laps = 2 if self.repeats else 1
        return math.ceil(10.0 * (laps * self.duration_s + LATE_S)) / 10.0

    @cached_property
    def repeats(self) -> bool:
        """Whether the pieces end as they begin, in flight: in the same place, with the same velocity."""
        last = self.pieces[-1]
        begins, ends = self._motion(self.pieces[0], 0.0), self._motion(last, last.duration_s)
        return bool(np.max(np.abs(begins[1])) > SAME and np.allclose(begins, ends, rtol=0.0, atol=SAME))

    def passes(self, time_s: FloatArray, error_m: FloatArray) -> list[PassedSummary]:
        """Return how far from each point whose time has come a drone passed.

        time_s:  (k,) since the beginning of the pieces, or of the first lap.
        error_m: (k, 2 or 3) from the target to the drone, along x ahead, y to the left, z up.
        """
        if not self.points:
            return []
        place_m = self._stacked(time_s, *((axis, 0) for axis in AXES)) * (1.0, -1.0, 1.0)
        path_m = place_m[:, : error_m.shape[-1]] + error_m
        passed = [(end_s, point) for end_s, point in zip(self._ends, self.points, strict=True) if point]
        passed_s = np.array([0.0, *(end_s for end_s, _ in passed)])
        points = [point for _, point in passed]
        return passes(points, passed_s, np.asarray(time_s), path_m, repeats=self.repeats)

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., 4)."""
        return self._stacked(time_s, ("north", 0), ("east", 0), ("north", 1), ("east", 1))

    def acceleration(self, time_s: ArrayLike) -> FloatArray:
        """Return [ax, ay] (..., 2)."""
        return self._stacked(time_s, ("north", 2), ("east", 2))

    def _motion(self, piece: Piece, since_s: float) -> FloatArray:
        """Return place and velocity (2, 3) of a piece at a time."""
        powers = np.cumprod([1.0, *(since_s for _ in range(COEFFICIENTS - 1))])
        slopes = np.append(0.0, np.arange(1.0, COEFFICIENTS) * powers[:-1])
        table = np.array([getattr(piece, axis) for axis in AXES])
        return np.array([np.sum(table * factors, axis=1) for factors in (powers, slopes)])

    @cached_property
    def _ends(self) -> FloatArray:
        return np.cumsum([piece.duration_s for piece in self.pieces])

    def _stacked(self, time_s: ArrayLike, *wanted: tuple[str, int]) -> FloatArray:
        """Return derivatives of coordinates, each by its name and order, at times (...), as (..., k)."""
        clock = np.asarray(time_s, np.float64)
        if self.repeats:
            clock = np.where(clock > 0.0, clock % self.duration_s, clock)
        moves = (clock >= 0.0) & (clock < self.duration_s)
        clock = np.clip(clock, 0.0, self.duration_s)
        which = np.minimum(np.searchsorted(self._ends, clock, side="right"), len(self.pieces) - 1)
        since = clock - np.concatenate([[0.0], self._ends])[which]
        found = []
        for name, order in wanted:
            table = np.array([getattr(piece, name) for piece in self.pieces])
            value: Any = np.zeros_like(since)
            for power in reversed(range(order, COEFFICIENTS)):
                value = value * since + math.perm(power, order) * table[which, power]
            found.append(value if order == 0 else np.where(moves, value, 0.0))
        return np.stack(found, axis=-1)


class PiecesInSpace(Pieces):
    """Polynomial pieces with a height."""

    def vertical(self, time_s: ArrayLike) -> FloatArray:
        """Return [height, climb, vertical acceleration] (..., 3)."""
        return self._stacked(time_s, ("height", 0), ("height", 1), ("height", 2))


def read_course(path: Path) -> Trajectory:
    """Read waypoints, or polynomial pieces where the header names a duration: level ones if all z are 0.

    Raises `TrajectoryError`, which names file, line, column and rule.
    """
    with named(path):
        header = header_of(read_text(path))
    if COLUMNS[0] not in header:
        return Waypoints.read(path)
    pieces = PiecesInSpace.read(path)
    level = not any(any(piece.height) for piece in pieces.pieces)
    return Pieces(pieces.pieces, pieces.points) if level else pieces


def _points(text: str) -> tuple[PassedPoint | None, ...]:
    """Return the points at the ends of the pieces of a CSV file; none if it has no such columns."""
    if POINT_COLUMNS[0] not in header_of(text):
        return ()
    rows = rows_of(text, POINT_COLUMNS, may_be_empty=POINT_COLUMNS)
    points = tuple(_passed_point(line, row) for line, row in rows.items())
    if not any(points):
        return ()
    if points[-1] is None:
        raise TrajectoryError(f"{list(rows)[-1]}: the last piece must end at a point, or none may")
    return points


def _passed_point(line: str, row: tuple[float, ...]) -> PassedPoint | None:
    if np.isnan(row).all():
        return None
    for name, value in zip(POINT_COLUMNS[:-3], row, strict=False):
        if math.isnan(value):
            raise TrajectoryError(f"{line}: {name} is missing")
    number, x, y, z, reach_m, *normal = row
    empty = np.isnan(normal)
    if not (number == round(abs(number)) and reach_m > 0.0 and np.isfinite([x, y, z, reach_m]).all()):
        raise TrajectoryError(f"{line}: point must be a whole number, reach above 0, places finite")
    if empty.any() and not empty.all():
        raise TrajectoryError(f"{line}: normal_x, normal_y and normal_z must be there all, or none")
    along = None if empty.all() else (normal[0], normal[1], normal[2])
    return PassedPoint(int(number), (x, y, z), reach_m, along)


def _piece(line: str, row: tuple[float, ...]) -> Piece:
    """Return the piece of a row; a flight keeps its heading, so there must be no yaw."""
    duration_s, *rest = row
    x, y, z, yaw = (tuple(rest[k : k + COEFFICIENTS]) for k in range(0, len(rest), COEFFICIENTS))
    for power, value in enumerate(yaw):
        if value != 0.0:
            raise TrajectoryError(
                f"{line}: yaw^{power} = {value} must be 0: a flight keeps its heading; plan without yaw"
            )
    return Piece(duration_s, x, tuple(0.0 - value for value in y), z)


def _check(places: Sequence[str], pieces: Sequence[Piece]) -> None:
    """Raise `TrajectoryError` for pieces that cannot be flown; `places` names each in the message."""
    if not pieces:
        raise TrajectoryError("holds no piece; at least one is needed")
    for place, piece in zip(places, pieces, strict=True):
        if not SHORTEST_S <= piece.duration_s <= LARGEST:
            raise TrajectoryError(
                f"{place}: duration = {piece.duration_s} must be a number of seconds, "
                f"{SHORTEST_S:g} to {LARGEST:g}"
            )
        for axis, values in (("x", piece.north), ("y", piece.east), ("z", piece.height)):
            if len(values) != COEFFICIENTS:
                raise TrajectoryError(
                    f"{place}: {axis} has {len(values)} coefficients; {COEFFICIENTS} are needed"
                )
            for power, value in enumerate(values):
                if not abs(value) <= LARGEST:
                    raise TrajectoryError(
                        f"{place}: {axis}^{power} = {value} must be a finite number of magnitude "
                        f"{LARGEST:g} or less"
                    )
