"""Polynomial pieces: their derivatives, their ends, and the files that hold them."""

import re
from pathlib import Path

import numpy as np
import pytest

from mambo_sil.errors import TrajectoryError
from mambo_sil.flight.polynomials import COLUMNS, Piece, Pieces, PiecesInSpace, read_course
from mambo_sil.flight.trajectories import Waypoints

STILL = (0.0,) * 8
BENT = Piece(2.0, (0.5, 0.25, -0.5, 0.125, 0.0625, 0.0, -0.03125, 0.25), STILL, (1.0, 0.0, 0.5, *STILL[:5]))
BACK = Piece(1.0, (4.0, -2.0, *STILL[:6]), (0.0, 0.0, 1.0, *STILL[:5]), (3.0, *STILL[:7]))


def row_of(duration: float, **axes: str) -> str:
    """Return a row of a file: `axes` have the first coefficients of their polynomials."""
    fields = [str(duration)]
    for axis in ("x", "y", "z", "yaw"):
        given = axes.get(axis, "").split()
        fields += given + ["0"] * (8 - len(given))
    return ",".join(fields)


def written(tmp_path: Path, *rows: str) -> Path:
    """Return a file with the header of a planner and `rows`."""
    path = tmp_path / "piece.csv"
    path.write_text("\n".join([",".join(("Duration", *COLUMNS[1:])), *rows]) + "\n", "utf-8")
    return path


def test_a_piece_has_the_derivatives_of_its_polynomials() -> None:
    """Position as NumPy evaluates it; velocity and acceleration by its derivatives, at any time within."""
    course, times_s = PiecesInSpace((BENT, BACK)), np.linspace(0.0, 1.999, 50)
    north, height = np.polynomial.Polynomial(BENT.north), np.polynomial.Polynomial(BENT.height)
    target, up = course.target(times_s), course.vertical(times_s)
    np.testing.assert_allclose(target[:, 0], north(times_s), rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(target[:, 2], north.deriv()(times_s), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(course.acceleration(times_s)[:, 0], north.deriv(2)(times_s), rtol=1e-12)
    np.testing.assert_allclose(up[:, 0], height(times_s), rtol=1e-13)
    np.testing.assert_array_equal(up[:, 2], 1.0)


def test_pieces_follow_each_other_and_the_target_rests_around_them() -> None:
    """A piece begins when the last one ends; before the first and from the last end on nothing moves."""
    course = PiecesInSpace((BENT, BACK))
    assert course.duration_s == 3.0
    np.testing.assert_array_equal(course.target([-1.0, 0.0]), [[0.5, 0, 0, 0], [0.5, 0, 0.25, 0]])
    np.testing.assert_array_equal(course.target([2.0, 2.5]), [[4, 0, -2, 0], [3, 0.25, -2, 1]])
    np.testing.assert_array_equal(
        course.acceleration([-1e-9, 2.5, 3.0, 9.0]), [[0, 0], [0, 2], [0, 0], [0, 0]]
    )
    np.testing.assert_array_equal(course.target([3.0, 9.0]), [[2, 1, 0, 0]] * 2)
    np.testing.assert_array_equal(course.vertical([3.0]), [[3.0, 0.0, 0.0]])


def test_a_file_has_x_ahead_y_left_and_z_up(tmp_path: Path) -> None:
    """As the Crazyflie's commander takes it; waypoints are recognised by their header."""
    path = written(tmp_path, row_of(1.5, x="0 1", y="0.25 2", z="1"), "", row_of(0.5, x="1.5"))
    course = read_course(path)
    assert isinstance(course, PiecesInSpace)
    assert [piece.duration_s for piece in course.pieces] == [1.5, 0.5]
    np.testing.assert_array_equal(course.target(0.5), [0.5, -1.25, 1.0, -2.0])
    np.testing.assert_array_equal(course.vertical(0.5), [1.0, 0.0, 0.0])
    path.write_text("time_s,x_m,y_m\n0,1,2\n", "utf-8")
    assert read_course(path) == Waypoints(((0.0, 1.0, 2.0),))


def test_a_file_without_a_height_is_level(tmp_path: Path) -> None:
    """Where every z is 0 the pieces are flown at the hover height."""
    course = read_course(written(tmp_path, row_of(1.5, x="0 1")))
    assert type(course) is Pieces
    assert not hasattr(course, "vertical")


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ((), "holds no piece; at least one is needed"),
        ((row_of(1.0), row_of(0.0)), "line 3: duration = 0.0 must be a number of seconds, 1e-06 to 1e+06"),
        ((row_of(1.0), row_of(float("nan"))), "line 3: duration = nan must be a number"),
        ((row_of(1.0, y="0 0 inf"),), "line 2: y^2 = -inf must be a finite number of magnitude 1e+06"),
        ((row_of(1.0, z="0 2e6"),), "line 2: z^1 = 2000000.0 must be a finite number"),
        ((row_of(1.0, yaw="0 0.1"),), "line 2: yaw^1 = 0.1 must be 0: a flight keeps its heading"),
        ((row_of(1.0, x="0 two"),), "line 2: x^1 = two must be a number"),
        (("1.0,0,0",), "line 2: x^2 is missing"),
        ((row_of(1.0) + ",7",), "line 2: has more fields than the 33 of the header"),
    ],
)
def test_bad_pieces_are_refused_with_file_line_and_rule(
    tmp_path: Path, rows: tuple[str, ...], message: str
) -> None:
    """The reader names the file, the line, the column and the rule."""
    with pytest.raises(TrajectoryError, match=rf"^[^:]*piece\.csv: {re.escape(message)}"):
        read_course(written(tmp_path, *rows))


def test_a_column_that_is_missing_is_named(tmp_path: Path) -> None:
    """The header must name all of them."""
    path = written(tmp_path, row_of(1.0))
    path.write_text(path.read_text("utf-8").replace("yaw^7", "yaw7"), "utf-8")
    with pytest.raises(TrajectoryError, match=r"line 1: column yaw\^7 is missing; the header must name dura"):
        read_course(path)


def test_a_piece_needs_every_coefficient() -> None:
    """A polynomial in Python has eight of them too."""
    with pytest.raises(TrajectoryError, match=r"piece 1: y has 7 coefficients; 8 are needed"):
        Pieces((Piece(1.0, STILL, STILL[:7], STILL),))
