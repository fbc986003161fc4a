"""The PD position controllers: the stock one, and the one with feed-forward."""

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_sil.flight.controllers.pd import (
    GAINS,
    TILT_LIMIT_RAD,
    PdController,
    PdFeedForwardController,
    PdGains,
)
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.metrics import measure
from mambo_sil.flight.trajectories import Bernoulli, Circle, Hover, Trajectory

FloatArray = NDArray[np.float64]


def command(state: list[float], target: list[float]) -> FloatArray:
    """Return roll and pitch (2,) for one state [x, y, vx, vy, roll, pitch, yaw] and one target."""
    outcome = PdController().step(np.array([state]), np.array([target]), np.array([9.81]))
    return np.asarray(outcome.command_rad[0])


def test_position_error_leans_towards_the_target() -> None:
    """A target ahead lowers the nose, one to the right rolls right, both by 0.24 rad/m."""
    np.testing.assert_allclose(command([0.0] * 7, [0.5, 1.0, 0.0, 0.0]), [0.24, -0.12], rtol=1e-15)


def test_velocity_is_damped() -> None:
    """Moving ahead raises the nose, moving right rolls left, both by 0.1 rad s/m."""
    moving = [0.0, 0.0, 0.3, 0.4, 0.0, 0.0, 0.0]
    np.testing.assert_allclose(command(moving, [0.0] * 4), [-0.04, 0.03], rtol=1e-15)


def test_error_is_clamped_to_three_metres() -> None:
    """Each axis is clamped to 3 m; the angle has no limit."""
    np.testing.assert_allclose(command([0.0] * 7, [9.0, 1.0, 0.0, 0.0]), [0.24, -0.72], rtol=1e-15)
    np.testing.assert_allclose(command([0.0] * 7, [1.0, -9.0, 0.0, 0.0]), [-0.72, -0.24], rtol=1e-15)
    fast = [0.0, 0.0, 20.0, 0.0, 0.0, 0.0, 0.0]
    np.testing.assert_allclose(command(fast, [-9.0, 0.0, 0.0, 0.0]), [0.0, 2.72], rtol=1e-15)


def test_target_velocity_is_unknown_to_the_pd() -> None:
    """The stock block has no reference velocity, so a moving target changes nothing."""
    state = [0.1, -0.2, 0.3, 0.4, 0.05, -0.05, 0.3]
    np.testing.assert_array_equal(command(state, [1.0, 2.0, 0.0, 0.0]), command(state, [1.0, 2.0, 5.0, -5.0]))


@pytest.mark.parametrize("yaw_rad", [0.8, -2.0, np.pi / 2])
def test_heading_turns_error_and_velocity_into_the_body_frame(yaw_rad: float) -> None:
    """If position, velocity, target and yaw rotate together, the command stays the same."""
    cosine, sine = np.cos(yaw_rad), np.sin(yaw_rad)
    turn = np.array([[cosine, -sine], [sine, cosine]])
    position, velocity, target = np.array([0.2, -0.4]), np.array([0.3, 0.1]), np.array([4.0, 0.7])
    level = command([*position, *velocity, 0.0, 0.0, 0.0], [*target, 0.0, 0.0])
    turned = command([*turn @ position, *turn @ velocity, 0.0, 0.0, yaw_rad], [*turn @ target, 0.0, 0.0])
    np.testing.assert_allclose(turned, level, rtol=1e-12)


def test_flights_of_a_batch_do_not_touch_each_other() -> None:
    """Every row has the command of a single step, and status 0."""
    rng = np.random.default_rng(4)
    states, targets = rng.normal(0.0, 2.0, (30, 7)), rng.normal(0.0, 2.0, (30, 4))
    outcome = PdController().step(states, targets, np.full(30, 9.81))
    for flight in range(30):
        alone = command(states[flight].tolist(), targets[flight].tolist())
        np.testing.assert_array_equal(outcome.command_rad[flight], alone)
    np.testing.assert_array_equal(outcome.status, np.zeros(30))


def feed_forward(
    state: list[float], target: list[float], trajectory: Trajectory | None = None, gains: PdGains = GAINS
) -> FloatArray:
    """Return roll and pitch (2,) for a target (4,) with a trajectory's acceleration at t = 0, or none."""
    given = np.append(target, (trajectory or Hover()).acceleration(0.0))
    step = PdFeedForwardController(gains).step(np.array([state]), given[None], np.array([9.81]))
    return np.asarray(step.command_rad[0])


def test_feed_forward_leans_by_every_term() -> None:
    """Errors of position and velocity, and the acceleration of a circle, which points to its centre."""
    gains = PdGains(0.5, 0.25, 0.125)
    np.testing.assert_allclose(
        feed_forward([0.0] * 7, [0.1, 0.2, 0.0, 0.0], None, gains), [0.1, -0.05], rtol=1e-15
    )
    moving = [0.0, 0.0, 0.1, 0.4, 0.0, 0.0, 0.0]
    np.testing.assert_allclose(
        feed_forward(moving, [0.0, 0.0, 0.3, 0.2], None, gains), [-0.05, -0.05], rtol=1e-14
    )
    on_circle = Circle(0.5, 2.0)
    state = [*on_circle.target(0.0), 0.0, 0.0, 0.0]
    np.testing.assert_allclose(
        feed_forward(state, state[:4], on_circle, gains), [0.0, 0.25], atol=1e-15, rtol=1e-15
    )


def test_feed_forward_is_clamped_to_the_tilt_limit() -> None:
    """Each angle, to both sides."""
    for sign in (1.0, -1.0):
        found = feed_forward([0.0] * 7, [sign * 9.0, sign * 9.0, 0.0, 0.0])
        np.testing.assert_array_equal(found, [sign * TILT_LIMIT_RAD, -sign * TILT_LIMIT_RAD])


@pytest.mark.parametrize("yaw_rad", [0.8, -2.0, np.pi / 2])
def test_heading_turns_every_term_into_the_body_frame(yaw_rad: float) -> None:
    """Seen from the body, a tilt towards the target points the same way of the world at every heading."""
    curve = Circle(0.5, 1.0)
    state, target = [0.6, 0.1, 0.1, 0.4, 0.0, 0.0], curve.target(0.0).tolist()
    (roll, pitch), (level_roll, level_pitch) = (
        feed_forward([*state, heading], target, curve) for heading in (yaw_rad, 0.0)
    )
    cosine, sine = np.cos(yaw_rad), np.sin(yaw_rad)
    towards = [-pitch * cosine - roll * sine, -pitch * sine + roll * cosine]
    np.testing.assert_allclose(towards, [-level_pitch, level_roll], rtol=1e-12)


def test_feed_forward_follows_the_curve_that_the_stock_pd_lags_behind() -> None:
    """A tenth of the stock PD's IAE in the Table II case, at any heading."""
    flight = Flight(Bernoulli(2.0, 0.5), flights=2, yaw_rad=np.array([0.0, 0.8]))
    stock, followed = (measure(fly(flight, one)) for one in (PdController(), PdFeedForwardController()))
    assert (followed.iae_m_s < 0.1 * stock.iae_m_s).all()
