"""The search for the least time: its gradients, and that what it finds keeps its limits."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from mambo_extensions.plan import solver
from mambo_extensions.plan.course import FORWARD_M_S, PlannedCourse, course_of
from mambo_extensions.plan.hermite import pieces_of
from mambo_extensions.plan.limits import Figures, limits_of
from mambo_extensions.plan.planning import shares_of, slowed
from mambo_extensions.plan.points import PlanPoint
from mambo_extensions.plan.solver import first_course, solve
from mambo_nmpc import curves

FIGURES = Figures(
    thrust_m_s2=15.0,
    least_thrust_m_s2=3.0,
    slope=0.6,
    tilt_lag_s=0.07,
    tilt_dead_time_s=0.04,
    thrust_lag_s=0.08,
    thrust_dead_time_s=0.0,
    drag_1_s=0.3,
    speed_m_s=4.0,
    climb_m_s=2.0,
    descent_m_s=1.5,
    walls_m=((1, 1.0, 1.6),),
)
LIMITS = limits_of(FIGURES)
POINTS = [
    PlanPoint(0.0, 0.0, 1.0),
    PlanPoint(1.0, 0.0, 1.2, normal=(1.0, 1.0, 0.0), width_m=0.4),
    PlanPoint(1.5, 1.0, 1.0, direction=(0.0, 1.0, 0.0)),
    PlanPoint(0.5, 1.5, 1.3, speed_m_s=1.0),
    PlanPoint(-0.5, 0.8, 1.2),
]


@pytest.fixture(scope="module", params=[False, True], ids=["open", "closed"])
def found(request: pytest.FixtureRequest) -> PlannedCourse:
    """Return the quickest course through the points."""
    first = first_course(course_of(POINTS, closed=request.param), LIMITS)
    return slowed(solve(first, LIMITS), LIMITS)


@pytest.mark.parametrize("closed", [False, True])
def test_the_gradient_is_that_of_differences(closed: bool) -> None:
    """Of time and passed limits by each unknown, at a random course, with random multipliers."""
    first = first_course(course_of(POINTS, closed=closed), LIMITS)
    random = np.random.default_rng(0)
    state = solver._state(first.stepped(0.1 * random.normal(size=first.choice.index[2])), LIMITS)
    multipliers = (
        random.uniform(0.0, 5.0, state.passed.shape),
        random.uniform(0.0, 9.0, (2, 6 if closed else 5)),
    )
    multipliers[1][0, first.choice.reach_m == 0.0] = 0.0
    lagrangian = solver._Lagrangian(LIMITS, 7.0, *multipliers)
    slope, _ = lagrangian._expanded(state)
    for unknown in range(len(slope)):
        step = np.zeros(len(slope))
        step[unknown] = 1e-6
        after, before = (
            lagrangian.cost(solver._state(state.course.stepped(sign * step), LIMITS)) for sign in (1.0, -1.0)
        )
        assert slope[unknown] == pytest.approx((after - before) / 2e-6, rel=1e-5, abs=1e-5)


def test_the_course_keeps_its_limits_between_the_samples(found: PlannedCourse) -> None:
    """By differences of the flown curve, 2000 times a second: thrust ahead of its lags, speed and wall."""
    course, step_s = pieces_of(found.knots, found.duration_s), 5e-4
    times_s = np.arange(4 * step_s, found.time_s - 4 * step_s, step_s)
    now = curves.sample(course, times_s, "NWU")
    acceleration = now.acceleration_m_s2 + FIGURES.drag_1_s * now.velocity_m_s * [1.0, 1.0, 0.0]
    first = np.gradient(acceleration, step_s, axis=0)
    second = np.gradient(first, step_s, axis=0)
    lag_s, dead_s = np.array([0.07, 0.07, 0.08]), np.array([0.04, 0.04, 0.0])
    thrust = acceleration + (lag_s + dead_s) * first + (lag_s * dead_s + dead_s**2 / 2.0) * second
    thrust[:, 2] += 9.81
    knots_s = np.concatenate([[0.0], np.cumsum(found.duration_s)])  # where the snap jumps
    smooth = (np.abs(times_s[:, np.newaxis] - knots_s).min(axis=1) > 5 * step_s)[2:-2]
    thrust = thrust[2:-2][smooth]
    level = np.hypot(thrust[:, 0], thrust[:, 1])
    assert (level / thrust[:, 2]).max() <= 0.6 * 1.01
    assert np.hypot(level / 0.85, thrust[:, 2]).max() <= 0.92 * 15.0 * 1.003
    assert thrust[:, 2].min() >= 3.0 * 0.99
    assert np.hypot(now.velocity_m_s[:, 0], now.velocity_m_s[:, 1]).max() <= 4.0 * 1.001
    assert now.position_m[:, 1].max() <= 1.6 + 0.01


def test_the_course_passes_points_gates_and_speeds(found: PlannedCourse) -> None:
    """At the knots: within half a tolerance, through the gate along its normal, at the given speed."""
    for knot, point in enumerate(POINTS):
        off_m = found.knots[knot, 0] - np.array(point.position_m)
        assert np.linalg.norm(off_m) <= 0.5 * point.reach_m * 1.02
    assert found.knots[1, 1] @ [1.0, 1.0, 0.0] / np.sqrt(2.0) >= 0.95 * FORWARD_M_S
    np.testing.assert_allclose(np.cross(found.knots[2, 1], [0.0, 1.0, 0.0]), 0.0, atol=1e-9)
    assert found.knots[2, 1, 1] > 0.0
    assert np.linalg.norm(found.knots[3, 1]) == pytest.approx(1.0, rel=0.1)


def test_a_gate_at_rest_is_reached() -> None:
    """The last point of an open course stands in a gate, without a speed along its normal."""
    gate = PlanPoint(1.0, 0.0, 1.1, normal=(1.0, 0.0, 0.0), width_m=0.4)
    course = course_of([gate, PlanPoint(0.0, 1.0, 1.0), gate], closed=False)
    rests = solve(first_course(course, LIMITS), LIMITS)
    assert solver.passed_at_knots(rests).max() <= solver.HELD
    np.testing.assert_array_equal(rests.knots[[0, -1], 0], [gate.position_m] * 2)


def test_a_plan_that_knows_no_lag_passes_the_limits_of_one_that_does() -> None:
    """A planner without jerk and snap is quicker, and asks for more thrust than there is."""
    blind = limits_of(replace(FIGURES, tilt_lag_s=0.0, tilt_dead_time_s=0.0, thrust_lag_s=0.0))
    points = [PlanPoint(0, 0, 1), PlanPoint(1, 0.5, 1.2), PlanPoint(0.6, -0.8, 1), PlanPoint(-0.4, 0.2, 1.2)]
    course = course_of(points, closed=False)
    quick = slowed(solve(first_course(course, blind), blind), blind)
    sure = slowed(solve(first_course(course, LIMITS), LIMITS), LIMITS)
    assert shares_of(quick, LIMITS).max() > 1.1
    assert shares_of(sure, LIMITS).max() <= 1.0
    assert quick.time_s < sure.time_s


def test_the_time_is_not_beaten_by_a_search_over_the_times() -> None:
    """Of least-snap courses through the same points no choice of times, by a simplex, is quicker."""
    points = [PlanPoint(0, 0, 1), PlanPoint(1, 0.5, 1.2), PlanPoint(0.6, -0.8, 1), PlanPoint(-0.4, 0.2, 1.2)]
    course = course_of(points, closed=False)
    first = first_course(course, LIMITS)

    def time_s(logarithms: np.ndarray) -> float:
        smooth = course.smooth(np.exp(logarithms))
        over = max(float(shares_of(smooth, LIMITS).max()) - 1.0, 0.0)
        return float(smooth.time_s + 20.0 * over)

    searched = minimize(time_s, np.log(first.duration_s), method="Nelder-Mead", options={"maxiter": 300})
    assert slowed(solve(first, LIMITS), LIMITS).time_s < searched.fun < first.time_s


def test_one_piece_from_rest_to_rest_takes_what_its_polynomial_does() -> None:
    """Without lags and drag: the one polynomial that rests at both ends, at the tilt's acceleration."""
    plain = replace(
        FIGURES,
        tilt_lag_s=0.0,
        tilt_dead_time_s=0.0,
        thrust_lag_s=0.0,
        drag_1_s=0.0,
        speed_m_s=20.0,
        walls_m=(),
    )
    limits = limits_of(plain)
    course = course_of([PlanPoint(0, 0, 1), PlanPoint(4, 0, 1)], closed=False)
    found = slowed(solve(first_course(course, limits), limits), limits)
    rest_to_rest = np.polynomial.Polynomial([0, 0, 0, 0, 35, -84, 70, -20])
    peak = rest_to_rest.deriv(2)(np.linspace(0.0, 1.0, 10001)).max()
    assert found.time_s == pytest.approx(np.sqrt(peak * 4.0 / (0.6 * 9.81)), rel=0.004)
