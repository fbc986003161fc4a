"""Trajectories of polynomial pieces, as planners write them and the Crazyflie's commander takes them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import perm
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
from numpy.typing import ArrayLike

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import TrajectoryError
from mambo_sil.flight.course_file import header_of, named, read_text, rows_of
from mambo_sil.flight.trajectories import Trajectory, Waypoints

COEFFICIENTS: Final = 8
"""Of a polynomial, from the constant to that of the seventh power of the time since its piece began."""
COLUMNS: Final = (
    "duration",
    *(f"{axis}^{power}" for axis in ("x", "y", "z", "yaw") for power in range(COEFFICIENTS)),
)
"""In s, m and rad; x ahead, y to the left, z up."""
LARGEST: Final = 1e6
"""Largest magnitude of a coefficient, and of a duration."""
SHORTEST_S: Final = 1e-6

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

    A jump from one piece to the next has neither velocity nor acceleration.
    Raises `TrajectoryError` unless durations are positive and all numbers are within `LARGEST`.
    """

    pieces: tuple[Piece, ...]

    def __post_init__(self) -> None:
        _check([f"piece {number}" for number in range(1, len(self.pieces) + 1)], self.pieces)

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a CSV file with `COLUMNS`, in any order; other columns are ignored.

        Raises `TrajectoryError`, which names file, line, column and rule.
        """
        with named(path):
            rows = rows_of(read_text(path), COLUMNS)
            pieces = tuple(_piece(line, row) for line, row in rows.items())
            _check(list(rows), pieces)
        return cls(pieces)

    @property
    def duration_s(self) -> float:
        """The time at which the last piece ends."""
        return float(self._ends[-1])

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., 4)."""
        return self._stacked(time_s, ("north", 0), ("east", 0), ("north", 1), ("east", 1))

    def acceleration(self, time_s: ArrayLike) -> FloatArray:
        """Return [ax, ay] (..., 2)."""
        return self._stacked(time_s, ("north", 2), ("east", 2))

    @cached_property
    def _ends(self) -> FloatArray:
        return np.cumsum([piece.duration_s for piece in self.pieces])

    def _stacked(self, time_s: ArrayLike, *wanted: tuple[str, int]) -> FloatArray:
        """Return derivatives of coordinates, each by its name and order, at times (...), as (..., k)."""
        clock = np.clip(time_s, 0.0, self.duration_s)
        which = np.minimum(np.searchsorted(self._ends, clock, side="right"), len(self.pieces) - 1)
        since = clock - np.concatenate([[0.0], self._ends])[which]
        moves = (np.asarray(time_s) >= 0.0) & (np.asarray(time_s) < self.duration_s)
        found = []
        for name, order in wanted:
            table = np.array([getattr(piece, name) for piece in self.pieces])
            value: Any = np.zeros_like(since)
            for power in reversed(range(order, COEFFICIENTS)):
                value = value * since + perm(power, order) * table[which, power]
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
    return pieces if any(any(piece.height) for piece in pieces.pieces) else Pieces(pieces.pieces)


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
