"""Courses of the pilot: plans in their own time, other curves softly."""

from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.port.taken import AHEAD_S
from mambo_extensions.mavlink.simulated import STARTS_M
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.polynomials import PiecesInSpace
from mambo_sil.flight.trajectories import Circle, Trajectory, vertical_of
from mambo_sil.life.courses import SOFT_S, Along
from tests.extensions.mavlink.support.pilots import simulated
from tests.support.laps import write_lap

START_M = np.array([0.3, -0.2, -1.0])


@pytest.fixture
def lap(tmp_path: Path) -> PiecesInSpace:
    """Return two legs from rest to rest, read from a file as `plan` writes it."""
    return write_lap(tmp_path / "lap.csv")


def motion(curve: Trajectory, time_s: float) -> FloatArray:
    """Return position, velocity and acceleration (3, 3) of a curve, z down."""
    x, y, vx, vy = curve.target(time_s)
    ax, ay = curve.acceleration(time_s)
    height, climb, upwards = vertical_of(curve, time_s)
    return np.array([[x, y, -height], [vx, vy, -climb], [ax, ay, -upwards]])


@pytest.mark.parametrize("time_s", [0.0, 0.4, 1.6, 2.9, 3.5])
def test_a_plan_is_flown_in_its_own_time_with_its_accelerations(lap: PiecesInSpace, time_s: float) -> None:
    """Moved to where the drone is: position, velocity, acceleration, and the one ahead are the pieces'."""
    target = Along(lap, START_M, 4.0).target(time_s)
    position_m, velocity_m_s, acceleration_m_s2 = motion(lap, time_s)
    np.testing.assert_allclose(target.position_m, START_M + position_m - motion(lap, 0.0)[0], atol=1e-12)
    np.testing.assert_array_equal(target.velocity_m_s, velocity_m_s)
    np.testing.assert_array_equal(target.acceleration_m_s2, acceleration_m_s2)
    np.testing.assert_array_equal(target.ahead_m_s2, motion(lap, time_s + AHEAD_S)[2])


def test_a_curve_in_flight_begins_and_ends_softly(lap: PiecesInSpace) -> None:
    """A circle, and a plan that the time ends in the middle: at rest, and without a jump."""
    for course in (Along(Circle(1.0, 1.0), START_M, 20.0), Along(lap, START_M, 2.25)):
        ends = [course.target(time_s).velocity_m_s for time_s in (0.0, course.duration_s)]
        np.testing.assert_allclose(ends, np.zeros((2, 3)), atol=1e-12)
        times_s = np.linspace(0.0, course.duration_s, 401)
        targets = [course.target(time_s) for time_s in times_s.tolist()]
        moved = np.gradient([one.position_m for one in targets], times_s, axis=0)
        velocity_m_s = np.array([one.velocity_m_s for one in targets])
        np.testing.assert_allclose(moved[1:-1], velocity_m_s[1:-1], atol=1e-2)
    circle = Along(Circle(1.0, 1.0), START_M, 20.0)
    assert np.linalg.norm(circle.target(SOFT_S).velocity_m_s) == pytest.approx(1.0)


def test_a_plan_is_flown_by_an_autopilot_and_lands(lap: PiecesInSpace) -> None:
    """All of it, near the plan with all its accelerations, and at its end the autopilot lands."""
    pilot, autopilot, updates = simulated("px4")
    with pilot:
        pilot.take_off(1.0)
        pilot.fly(lap, lap.duration_s + 1.0)
        end_m = autopilot.true.position_m[:, 0] - STARTS_M
        assert pilot.land() == "landed: as planned"
    moved_m = motion(lap, lap.duration_s)[0] - motion(lap, 0.0)[0]
    np.testing.assert_allclose(end_m, [*moved_m[:2], moved_m[2] - 1.0], atol=0.1)
    error_m = np.array([one.estimate.position_m - one.target.position_m for one in updates])
    assert np.linalg.norm(error_m, axis=1).max() < 0.1
    fastest = max(float(np.linalg.norm(one.target.velocity_m_s)) for one in updates)
    assert fastest == pytest.approx(
        max(float(np.linalg.norm(motion(lap, time_s)[1])) for time_s in np.arange(0.0, 3.0, 0.01)), rel=0.02
    )
