"""How far from points a drone flew: by hand, in laps, in files."""

import math
from pathlib import Path

import numpy as np
import pytest

from mambo_sil.errors import TrajectoryError
from mambo_sil.flight.passing import PassedPoint, PassedSummary, distances_m, missed_words
from mambo_sil.flight.polynomials import COLUMNS, POINT_COLUMNS, Piece, Pieces, PiecesInSpace, read_course

ZERO = (0.0,) * 8
TIMES_S = np.array([0.0, 1.0])
PAST = np.array([[-1.0, 0.3, 0.0], [1.0, 0.3, 0.0]])[:, np.newaxis]


def off_m(path_m: np.ndarray, normal: tuple[float, float, float] | None) -> float:
    """Return the distance from the origin."""
    point = PassedPoint(2, (0.0, 0.0, 0.0), 0.1, normal)
    return float(distances_m(TIMES_S, path_m, [point], np.array([0.0, 0.5]))[0, 0])


def test_distances_of_a_path_by_hand() -> None:
    """A path past the origin, between its samples; through a plane beside it; and one that turns back."""
    assert off_m(PAST, None) == pytest.approx(0.3)
    ahead = (1.0, 0.0, 0.0)
    assert off_m(PAST + np.array([0.5, 0.0, 0.0]), ahead) == pytest.approx(0.3)
    assert off_m(PAST[::-1], ahead) == math.inf


def circle(points: tuple[PassedPoint, ...] = ()) -> PiecesInSpace:
    """Return a lap of two pieces: out and back along a parabola, in flight at both ends."""
    out = Piece(2.0, (0.0, 1.0, -0.5, *ZERO[3:]), (0.0, 1.0, *ZERO[2:]), (1.0, *ZERO[1:]))
    back = Piece(2.0, (0.0, -1.0, 0.5, *ZERO[3:]), (2.0, 1.0, -1.0, 0.0, *ZERO[4:]), (1.0, *ZERO[1:]))
    return PiecesInSpace((out, back), points)


def test_pieces_that_end_as_they_begin_in_flight_repeat() -> None:
    """The target of the second lap is that of the first; the last lap in the time is judged."""
    there = circle()
    assert not there.repeats
    lap = Piece(1.0, (0.0, 1.0, -3.0, 2.0, *ZERO[4:]), (0.0, 0.0, *ZERO[2:]), (1.0, *ZERO[1:]))
    once = Pieces((lap,), (PassedPoint(1, (0.0, 0.0, 1.0), 0.1),))
    assert once.repeats
    assert once.flown_s == 2.4
    since_s = np.linspace(0.0, 0.99, 12)
    np.testing.assert_allclose(once.target(since_s + 3.0), once.target(since_s), atol=1e-12)
    assert once.target(-1.0).tolist() == [0.0, 0.0, 0.0, 0.0]
    times_s = np.linspace(0.0, 2.4, 241)
    error_m = np.zeros((241, 3))
    error_m[:150, 1] = 1.0
    (passed,) = once.passes(times_s, error_m)
    assert (passed.number, passed.missed) == (1, False)
    error_m[150:, 1] = 0.2
    assert once.passes(times_s, error_m)[0].off_m == pytest.approx(0.2, abs=0.01)


def test_a_lap_from_rest_to_rest_does_not_repeat() -> None:
    """It is flown once, and LATE_S more."""
    rests = Piece(1.0, (0.0, 0.0, 1.0, -2.0, 1.0, *ZERO[5:]), ZERO, (1.0, *ZERO[1:]))
    assert not Pieces((rests,)).repeats
    assert Pieces((rests,)).flown_s == 1.4


def test_points_whose_time_has_not_come_are_not_judged() -> None:
    """Of two points, the flight ends between them."""
    points = PassedPoint(2, (0.0, 2.0, 1.0), 0.1), PassedPoint(3, (0.0, 0.0, 1.0), 0.1)
    times_s = np.linspace(0.0, 3.0, 301)
    passed = circle(points).passes(times_s, np.zeros((301, 3)))
    assert [one.number for one in passed] == [2]


def test_words_name_the_worst_point() -> None:
    """By its distance over what is allowed; a gate that was not crossed is worst."""
    near, wide, lost = (
        PassedSummary(number=number, off_m=off_m, reach_m=reach_m)
        for number, off_m, reach_m in ((2, 0.3, 0.1), (3, 0.5, 0.4), (4, math.inf, 0.1))
    )
    assert "MISSES 2 of 2 points; the worst is point 2, passed 30 cm away" in missed_words([near, wide])
    assert "point 4, through whose gate it does not fly" in missed_words([near, lost])
    good = PassedSummary(number=2, off_m=0.1, reach_m=0.1)
    assert missed_words([good]) == "passes all 1 points"


@pytest.mark.parametrize(
    ("fields", "fault"),
    [
        ("2,0,0,1,0.1,,,", ""),
        ("2,0,0,1,0.1,1,0,", "must be there all, or none"),
        ("2.5,0,0,1,0.1,,,", "must be a whole number"),
        ("2,0,0,1,0,,,", "reach above 0"),
        ("2,0,inf,1,0.1,,,", "places finite"),
        ("2,,0,1,0.1,,,", "point_x is missing"),
    ],
)
def test_a_file_names_its_points(tmp_path: Path, fields: str, fault: str) -> None:
    """A normal may be left out; what is wrong is named with its line."""
    path = tmp_path / "lap.csv"
    header = ",".join((*COLUMNS, *POINT_COLUMNS))
    path.write_text(f"{header}\n1,{','.join(['0'] * 32)},{fields}\n", "utf-8")
    if fault:
        with pytest.raises(TrajectoryError, match=rf"lap.csv: line 2: .*{fault}"):
            read_course(path)
        return
    course = read_course(path)
    assert isinstance(course, Pieces)
    assert course.points == (PassedPoint(2, (0.0, 0.0, 1.0), 0.1),)


def test_a_file_whose_last_piece_ends_at_no_point_has_no_points_at_all(tmp_path: Path) -> None:
    """Else the time of a lap would not be known."""
    path, header = tmp_path / "lap.csv", ",".join((*COLUMNS, *POINT_COLUMNS))
    piece, at_point, empty = f"1,{','.join(['0'] * 32)},", "2,0,0,1,0.1,,,", "," * 7
    path.write_text(f"{header}\n{piece}{empty}\n{piece}{empty}\n", "utf-8")
    course = read_course(path)
    assert isinstance(course, Pieces)
    assert course.points == ()
    path.write_text(f"{header}\n{piece}{at_point}\n{piece}{empty}\n", "utf-8")
    with pytest.raises(TrajectoryError, match=r"lap.csv: line 3: the last piece must end at a point"):
        read_course(path)
