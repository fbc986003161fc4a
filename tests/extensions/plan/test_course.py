"""Courses: pieces between knots, least snap, and what a plan may choose."""

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from mambo_extensions.plan.course import PlannedCourse, course_of
from mambo_extensions.plan.hermite import TURN_PEAK, motion, pieces_of
from mambo_extensions.plan.points import PlanPoint
from mambo_sil.drone.plant.arrays import FloatArray

POINTS = ((0.0, 0.0, 1.0), (1.2, 0.5, 1.3), (1.5, -0.8, 0.9), (0.2, -1.0, 1.1))


def drawn(seed: int, count: int = 4) -> tuple[FloatArray, FloatArray]:
    """Return random knots (count + 1, 4, 3) and durations (count,)."""
    random = np.random.default_rng(seed)
    return random.normal(size=(count + 1, 4, 3)), random.uniform(0.3, 2.0, count)


@pytest.mark.parametrize("seed", range(3))
def test_pieces_join_up_to_the_jerk(seed: int) -> None:
    """Both ends of each polynomial, by NumPy's derivatives, are the knots beside it."""
    knots, duration_s = drawn(seed)
    course = pieces_of(knots, duration_s)
    for number, piece in enumerate(course.pieces):
        for axis, (row, sign) in enumerate(((piece.north, 1), (piece.east, -1), (piece.height, 1))):
            polynomial = sign * np.polynomial.Polynomial(row)
            for order in range(4):
                found = polynomial.deriv(order) if order else polynomial
                at_ends = found(np.array([0.0, piece.duration_s]))
                np.testing.assert_allclose(at_ends, knots[number : number + 2, order, axis], atol=1e-9)


def test_the_motion_is_that_of_the_polynomials() -> None:
    """Position to snap within the pieces are the derivatives of what flights are given."""
    knots, duration_s = drawn(7)
    tau = np.linspace(0.0, 1.0, 11)
    found = motion(knots, duration_s, tau)
    for number, piece in enumerate(pieces_of(knots, duration_s).pieces):
        polynomial = np.polynomial.Polynomial(piece.height)
        for order in range(5):
            wanted = polynomial.deriv(order) if order else polynomial
            np.testing.assert_allclose(
                found[order, number, :, 2], wanted(tau * piece.duration_s), rtol=1e-7, atol=1e-7
            )


def test_least_snap_is_the_spline_of_degree_7() -> None:
    """The course of least snap, at rest at both ends, is the interpolating spline that SciPy finds."""
    duration_s = np.array([1.0, 0.7, 1.4])
    times_s, rest = np.array([0.0, 1.0, 1.7, 3.1]), [(order, np.zeros(3)) for order in (1, 2, 3)]
    spline = make_interp_spline(times_s, np.array(POINTS), k=7, bc_type=(rest, rest))
    course = course_of([PlanPoint(*point) for point in POINTS], closed=False).smooth(duration_s)
    for order in range(4):
        np.testing.assert_allclose(course.knots[:, order], spline(times_s, order), atol=1e-8)


def test_a_closed_lap_of_least_snap_is_smooth_where_it_closes() -> None:
    """Snap to sixth derivative are the same before and behind the first point, as of a periodic spline."""
    course = course_of([PlanPoint(*point) for point in POINTS], closed=True).smooth(
        np.array([1.0, 0.7, 1.4, 0.9])
    )
    first, *_, last = pieces_of(course.knots, course.duration_s).pieces
    for row in ("north", "east", "height"):
        for order in range(7):
            begins = np.polynomial.Polynomial(getattr(first, row)).deriv(order)(0.0)
            ends = np.polynomial.Polynomial(getattr(last, row)).deriv(order)(last.duration_s)
            assert begins == pytest.approx(ends, rel=1e-6, abs=1e-6)


def test_a_slower_course_has_the_same_path() -> None:
    """At half the rate the same places come at twice the time, with half the speed, and so on to the snap."""
    course = course_of([PlanPoint(*point) for point in POINTS], closed=False).smooth(np.ones(3))
    slow, tau = course.slower(0.5), np.linspace(0.0, 1.0, 5)
    before, after = (motion(one.knots, one.duration_s, tau) for one in (course, slow))
    assert slow.time_s == pytest.approx(2.0 * course.time_s)
    for order in range(5):
        np.testing.assert_allclose(after[order], 0.5**order * before[order], atol=1e-9)


@pytest.mark.parametrize("closed", [False, True])
def test_a_halved_course_is_the_same_path_with_a_free_knot_in_each_piece(closed: bool) -> None:
    """Its legs end at the same points at the same times; the knots between have no tolerance and no axes."""
    course = course_of([PlanPoint(*point) for point in POINTS], closed=closed).smooth(np.ones(3 + closed))
    halved = course.halved
    before = motion(course.knots, course.duration_s, np.linspace(0.0, 1.0, 9))
    after = motion(halved.knots, halved.duration_s, np.linspace(0.0, 1.0, 5))
    np.testing.assert_allclose(after[:, ::2], before[:, :, :5], atol=1e-9)
    np.testing.assert_allclose(after[:, 1::2], before[:, :, 4:], atol=1e-9)
    np.testing.assert_allclose(halved.leg_s, course.duration_s)
    choice = halved.choice
    numbers = [course.choice.point_of(knot) for knot in range(4 + closed)]
    assert [choice.point_of(knot) for knot in choice.points] == numbers
    assert [choice.near(piece) for piece in (2, 3)] == [(2, 3), (2, 3)]
    assert choice.free[1::2].all()
    assert not choice.reach_m[1::2].any()
    assert (choice.reach_m[::2] == course.choice.reach_m).all()


def test_speed_and_direction_of_a_point_stay() -> None:
    """Whatever else changes, the drone passes with the given speed along the given direction."""
    points = [
        PlanPoint(0, 0, 1),
        PlanPoint(1, 0, 1, speed_m_s=1.5, direction=(0.0, 2.0, 0.0)),
        PlanPoint(2, 1, 1, speed_m_s=0.8),
        PlanPoint(3, 0, 1),
    ]
    course = course_of(points, closed=False)
    moved = course.smooth(np.ones(3)).stepped(np.random.default_rng(0).normal(size=course.choice.index[2]))
    np.testing.assert_allclose(moved.knots[1, 1], [0.0, 1.5, 0.0], atol=1e-12)
    np.testing.assert_allclose(moved.knots[2, 1], [0.8, 0.0, 0.0], atol=1e-12)
    assert not moved.knots[[0, -1], 1:].any()


def test_a_gate_moves_the_course_in_its_plane_only() -> None:
    """The knot of a gate stays in the gate's plane."""
    points = [PlanPoint(0, 0, 1), PlanPoint(1, 0, 1, normal=(1.0, 1.0, 0.0), width_m=0.4), PlanPoint(2, 1, 1)]
    course = course_of(points, closed=False)
    step = np.random.default_rng(1).normal(size=course.choice.index[2])
    moved: PlannedCourse = course.smooth(np.ones(2)).stepped(0.1 * step)
    off_m = moved.knots[1, 0] - [1.0, 0.0, 1.0]
    assert off_m @ [1.0, 1.0, 0.0] == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.norm(off_m) > 0.01


def test_the_largest_rate_of_a_turn() -> None:
    """A piece at rest at both ends turns TURN_PEAK times as quickly as its mean, in its middle."""
    knots = np.zeros((2, 4, 3))
    knots[1, 0] = 1.0
    rate = motion(knots, np.array([2.0]), np.linspace(0.0, 1.0, 101))[1, 0, :, 0]
    assert rate.max() == pytest.approx(TURN_PEAK / 2.0)
