"""Points that a plan goes through: rows of a CSV file, or of a program; x ahead, y to the left, z up."""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from mambo_codegen.errors import echo
from mambo_extensions.plan.qgroundcontrol import MISSION, places_of
from mambo_sil.errors import TrajectoryError
from mambo_sil.flight.course_file import header_of, named, read_text

POSITION: Final = ("x", "y", "z")
DIRECTION: Final = ("direction_x", "direction_y", "direction_z")
NORMAL: Final = ("normal_x", "normal_y", "normal_z")
OPTIONAL: Final = ("yaw", "time", "speed", "tolerance", "width", *DIRECTION, *NORMAL)
"""In rad, s, m/s, m; a direction and a normal are of any length."""

TOLERANCE_M: Final = 0.1
"""Of a point without tolerance and width."""
_OPTIONAL_SIZES: Final = ("width", "speed", "time", "yaw")
"""What a point need not have."""
LARGEST_M: Final = 1e4
LEAST_TOLERANCE_M: Final = 0.001
MOST_POINTS: Final = 1000
NEAREST_M: Final = 0.01
"""Least distance of a point from the one before it."""

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class PlanPoint:
    """A point of a plan, in m along x ahead, y to the left, z up.

    tolerance_m: a sphere around the point that the drone must reach into.
    width_m:     with `normal`: the diameter of a gate, through which it must fly along that direction.
    speed_m_s, direction: of the drone there; at the first and last point the drone rests without a speed. A
                 `rate` scales the speed; a plan slowed to keep its limits, by 10 % at most, has less of it.
    time_s:      since the start; either all points have one, or none.
    yaw_rad:     heading, from x ahead towards y.
    """

    x_m: float
    y_m: float
    z_m: float
    tolerance_m: float = TOLERANCE_M
    normal: Vector | None = None
    width_m: float | None = None
    speed_m_s: float | None = None
    direction: Vector | None = None
    time_s: float | None = None
    yaw_rad: float | None = None

    @property
    def position_m(self) -> Vector:
        """The place."""
        return self.x_m, self.y_m, self.z_m

    @property
    def reach_m(self) -> float:
        """How far from the place the drone may pass."""
        return self.tolerance_m if self.width_m is None else self.width_m / 2.0


def read_points(path: Path, *, closed: bool = False) -> tuple[PlanPoint, ...]:
    """Read points from a CSV file, or the places of a mission of QGroundControl (.plan); of a `closed` lap.

    Raises `TrajectoryError`, which names file, line, column and rule.
    """
    with named(path):
        text = read_text(path)
        if path.suffix.lower() == MISSION:
            places = places_of(text)
            points, lines = tuple(PlanPoint(*place) for place in places.values()), list(places)
        else:
            rows = _rows(text)
            points, lines = tuple(_point(line, row) for line, row in rows.items()), list(rows)
        check_points(points, lines, closed=closed)
    return points


def check_points(
    points: Sequence[PlanPoint], places: Sequence[str] | None = None, *, closed: bool = False
) -> None:
    """Raise `TrajectoryError` for points that cannot be planned; `places` names each in the message."""
    named_at = places or [f"point {number}" for number in range(1, len(points) + 1)]
    if not 2 <= len(points) <= MOST_POINTS:
        raise TrajectoryError(f"holds {len(points)} points; 2 to {MOST_POINTS} are needed")
    for place, point in zip(named_at, points, strict=True):
        _check(place, point)
    for place, before, after in zip(named_at[1:], points, points[1:], strict=False):
        if math.dist(before.position_m, after.position_m) < NEAREST_M:
            raise TrajectoryError(
                f"{place}: must be {NEAREST_M:g} m or more from the point before it; leave one of them out"
            )
    if closed and math.dist(points[-1].position_m, points[0].position_m) < NEAREST_M:
        raise TrajectoryError(
            f"{named_at[-1]}: is the first point again, to which a closed lap returns; leave it out"
        )
    timed = [point.time_s is not None for point in points]
    if any(timed) and not all(timed):
        missing = named_at[timed.index(False)]
        raise TrajectoryError(f"{missing}: time is missing: give all points a time, or none")
    if all(timed):
        times_s = [float(point.time_s or 0.0) for point in points]
        for place, earlier_s, later_s in zip(named_at[1:], times_s, times_s[1:], strict=False):
            if later_s <= earlier_s:
                raise TrajectoryError(
                    f"{place}: time = {later_s:g} must be later than the {earlier_s:g} before it"
                )


def _check(place: str, point: PlanPoint) -> None:
    """Raise `TrajectoryError` for a point that breaks a rule of its own."""
    vectors = ("direction", point.direction), ("normal", point.normal)
    for name, vector in vectors:
        if vector is not None and not (isinstance(vector, Sequence | np.ndarray) and len(vector) == 3):
            raise TrajectoryError(f"{place}: {name} must be three numbers")
    _require_sizes(place, point, vectors)
    if (point.normal is None) != (point.width_m is None):
        given, other = (
            ("normal", "width") if point.width_m is None else ("width", "normal_x,normal_y,normal_z")
        )
        raise TrajectoryError(f"{place}: {given} without {other}: a gate has both")
    for name, vector in vectors:
        if vector is not None and not math.hypot(*vector) > 1e-6:
            raise TrajectoryError(f"{place}: {name} must not be 0 along all axes")


def _require_sizes(place: str, point: PlanPoint, vectors: Sequence[tuple[str, Vector | None]]) -> None:
    ranges = (
        ("x", point.x_m, -LARGEST_M, LARGEST_M),
        ("y", point.y_m, -LARGEST_M, LARGEST_M),
        ("z", point.z_m, 0.0, LARGEST_M),
        ("tolerance", point.tolerance_m, LEAST_TOLERANCE_M, LARGEST_M),
        ("width", point.width_m, 2.0 * LEAST_TOLERANCE_M, LARGEST_M),
        ("speed", point.speed_m_s, 0.0, 1000.0),
        ("time", point.time_s, 0.0, 1e6),
        ("yaw", point.yaw_rad, -1000.0, 1000.0),
        *((name, value, -1e6, 1e6) for name, vector in vectors if vector is not None for value in vector),
    )
    for name, value, least, most in ranges:
        if value is None and name in _OPTIONAL_SIZES:
            continue
        if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
            raise TrajectoryError(f"{place}: {name} = {echo(repr(value))} must be a number")
        if not least <= value <= most:
            floor = ": the floor is at 0" if name == "z" and value < 0.0 else ""
            raise TrajectoryError(f"{place}: {name} = {value:g} must lie in {least:g}..{most:g}{floor}")


def _rows(text: str) -> dict[str, dict[str, float]]:
    """Return the numbers of each row of a CSV file by column, empty fields left out, by line."""
    rows, found = csv.reader(io.StringIO(text, newline=""), strict=True), {}
    try:
        header = header_of(text)
        next(rows, None)
        for column in POSITION:
            if header.count(column) != 1:
                fault = "appears more than once" if column in header else "is missing"
                known = ",".join((*POSITION, *OPTIONAL))
                raise TrajectoryError(f"line 1: column {column} {fault}; the header may name {known}")
        for column in header:
            if column not in (*POSITION, *OPTIONAL) or header.count(column) > 1:
                known = ",".join((*POSITION, *OPTIONAL))
                raise TrajectoryError(f"line 1: column {column} is none of {known}, each once")
        for row in filter(None, rows):
            line = f"line {rows.line_num}"
            if len(row) > len(header):
                raise TrajectoryError(f"{line}: has more fields than the {len(header)} of the header")
            found[line] = _numbers(line, dict(zip(header, row, strict=False)))
    except csv.Error as error:
        raise TrajectoryError(f"line {rows.line_num}: is not CSV: {error}") from None
    return found


def _numbers(line: str, fields: Mapping[str, str]) -> dict[str, float]:
    numbers = {}
    for column, field in fields.items():
        if not field.strip():
            continue
        try:
            numbers[column] = float(field)
        except ValueError:
            raise TrajectoryError(f"{line}: {column} = {field[:40]!r} must be a number") from None
    return numbers


def _point(line: str, row: Mapping[str, float]) -> PlanPoint:
    for column in POSITION:
        if column not in row:
            raise TrajectoryError(f"{line}: {column} is missing")
    return PlanPoint(
        row["x"],
        row["y"],
        row["z"],
        row.get("tolerance", TOLERANCE_M),
        _vector(line, row, NORMAL),
        row.get("width"),
        row.get("speed"),
        _vector(line, row, DIRECTION),
        row.get("time"),
        row.get("yaw"),
    )


def _vector(line: str, row: Mapping[str, float], columns: tuple[str, str, str]) -> Vector | None:
    """Return three columns of a row; None if all are empty."""
    given = [column in row for column in columns]
    if not any(given):
        return None
    if not all(given):
        raise TrajectoryError(f"{line}: {columns[given.index(False)]} is missing: a vector has three numbers")
    x, y, z = (row[column] for column in columns)
    return x, y, z
