"""Frames: jumps of an estimator told from motion and noise; roll and pitch seen from two headings."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.elementary import sine_cosine
from mambo_sil.drone.plant.rigid_body import to_world
from mambo_sil.flight.frames import turned_tilt
from mambo_sil.life.records import EstimatedState
from mambo_sil.life.steady_frame import LONGEST_S, SteadyFrame

FASTEST_RAD_S = 2.5
"""Rate of a circle of 2 m: 5 m/s, and 1.3 g."""


def estimates(rate_rad_s: float, random: np.random.Generator, duration_s: float) -> Iterator[EstimatedState]:
    """Yield what an estimator says of a drone on a circle, in single precision.

    The position errs by 2 mm, the velocity by 0.15 m/s, white and slow; the time is of another thread, wrong
    by up to 3 ms; gaps are of 0.1 s at most.
    """
    time_s, turned_rad, slow_m_s = 0.0, random.uniform(-math.pi, math.pi), np.zeros(3)
    while time_s < duration_s:
        passed_s = 0.01 if random.random() < 0.9 else random.uniform(0.004, 0.1)
        time_s, turned_rad = time_s + passed_s, turned_rad + rate_rad_s * passed_s
        slow_m_s += random.normal(scale=0.12 * math.sqrt(2.0 * passed_s), size=3) - passed_s * slow_m_s
        circle = np.array([math.cos(turned_rad), math.sin(turned_rad), 0.1])
        tangent = np.array([-math.sin(turned_rad), math.cos(turned_rad), 0.0])
        yield EstimatedState(
            time_s + random.uniform(0.0, 0.003),
            (2.0 * circle + random.normal(scale=0.002, size=3)).astype(np.float32).astype(np.float64),
            2.0 * rate_rad_s * tangent + slow_m_s + random.normal(scale=0.09, size=3),
            np.array([0.0, 0.0, 0.3]),
        )


@pytest.mark.parametrize("rate_rad_s", [0.0, 1.0, FASTEST_RAD_S])
def test_motion_and_noise_are_no_jumps(rate_rad_s: float) -> None:
    """In hover and on circles of 2 and 5 m/s, half a minute of each."""
    frame = SteadyFrame()
    for estimate in estimates(rate_rad_s, np.random.default_rng(4), 30.0):
        frame.follow(estimate)
    assert frame.jumps == 0


@pytest.mark.parametrize(("rate_rad_s", "missed_m"), [(0.0, 0.2), (1.0, 0.4)])
def test_a_jump_that_takes_half_a_second_is_seen_to_its_end(rate_rad_s: float, missed_m: float) -> None:
    """As of EKF3: 2 m, 8 cm in the first step, 4 % less in each one after it, but for the last of them."""
    frame, jumped_m, moved_m = SteadyFrame(), np.zeros(3), np.zeros(3)
    for count, estimate in enumerate(estimates(rate_rad_s, np.random.default_rng(7), 3.0)):
        if count >= 20:
            jumped_m += [0.08 * 0.96 ** (count - 20), 0.0, 0.0]
        moved = EstimatedState(
            estimate.time_s, estimate.position_m + jumped_m, estimate.velocity_m_s, estimate.attitude_rad
        )
        if (found := frame.follow(moved)) is not None:
            moved_m += found.position_m
    assert jumped_m[0] > 1.9
    np.testing.assert_allclose(moved_m, jumped_m, atol=missed_m)


@pytest.mark.parametrize("rate_rad_s", [0.0, 1.0, FASTEST_RAD_S])
def test_a_jump_of_ten_centimetres_is_seen(rate_rad_s: float) -> None:
    """Wherever the drone is on its circle, and by how far within 5 cm."""
    random = np.random.default_rng(5)
    for direction_rad in np.linspace(0.0, math.pi, 12):
        frame, jump_m, found_m = SteadyFrame(), np.zeros(3), np.zeros(3)
        for count, estimate in enumerate(estimates(rate_rad_s, random, 0.5)):
            if count == 5 and estimate.time_s < LONGEST_S:
                jump_m = 0.1 * np.array([math.cos(direction_rad), math.sin(direction_rad), 0.0])
            moved = EstimatedState(
                estimate.time_s, estimate.position_m + jump_m, estimate.velocity_m_s, estimate.attitude_rad
            )
            if (found := frame.follow(moved)) is not None:
                found_m += found.position_m
        np.testing.assert_allclose(found_m, jump_m, atol=0.05)
        assert (frame.jumps > 0) == jump_m.any()


def test_the_thrust_points_where_it_did() -> None:
    """In the world, for random tilts of up to 69 degrees and headings, against the rotation of the plant."""
    random = np.random.default_rng(6)
    for roll_rad, pitch_rad, yaw_rad, turn_rad in random.uniform(-1.2, 1.2, (50, 4)) * [1.0, 1.0, 1.0, 2.6]:
        there = [*turned_tilt(roll_rad, pitch_rad, turn_rad), yaw_rad + turn_rad]
        np.testing.assert_allclose(direction(there), direction([roll_rad, pitch_rad, yaw_rad]), atol=1e-12)


def direction(attitude_rad: list[float]) -> FloatArray:
    """Return where the thrust points (3,) at roll, pitch, yaw."""
    return to_world(*sine_cosine(np.array(attitude_rad)), np.array([0.0, 0.0, -1.0]))
