"""The laws without a model: the stock PD, and PD and PID with feed-forward."""

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.controllers.pd import (
    GAINS,
    INTEGRAL_LIMIT_RAD,
    INTEGRATED_ERROR_M,
    JERK_LIMIT_M_S3,
    TILT_LIMIT_RAD,
    PdController,
    PdFeedForwardController,
    PdGains,
    PidFeedForwardController,
    PidGains,
    pd_controller,
    pid_gains,
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


def pid(**gains: float) -> PidFeedForwardController:
    """Return one controller with some gains; all others are 0, and the low-pass passes everything."""
    none = dict.fromkeys(PidGains.__dataclass_fields__, 0.0)
    return PidFeedForwardController(PidGains(**none | gains))


def pid_command(
    controller: PidFeedForwardController,
    target: tuple[float, ...],
    state: tuple[float, ...] = (0.0,) * 7,
) -> list[float]:
    """Return roll and pitch of one step; a target has x, y, vx, vy, ax, ay."""
    step = controller.step(np.array([state]), np.array([target]), np.array([9.81]))
    assert not step.status.any()
    return [float(angle_rad) for angle_rad in step.command_rad[0]]


def test_pid_without_its_own_gains_is_the_pd() -> None:
    """The same bits in any state, but for the sign of zero."""
    rng = np.random.default_rng(5)
    for state, target in zip(rng.normal(0.0, 0.3, (20, 7)), rng.normal(0.0, 0.3, (20, 6)), strict=True):
        controller = PidFeedForwardController(PidGains(0.5, 0.25, 0.125, 0.0, 0.0, 0.0, 0.0))
        expected = PdFeedForwardController(PdGains(0.5, 0.25, 0.125)).step(
            state[None], target[None], np.array([9.81])
        )
        assert pid_command(controller, (*target,), (*state,)) == list(expected.command_rad[0])


def test_pid_leans_by_the_jerk_of_the_target_but_not_by_a_jump() -> None:
    """The change of the acceleration since the last update; 0 in the first update and at a jump."""
    controller = pid(jerk_rad_s3_m=0.01)
    assert pid_command(controller, (0.0,) * 4 + (0.5, 0.0)) == [0.0, 0.0]
    np.testing.assert_allclose(pid_command(controller, (0.0,) * 4 + (0.6, -0.1)), [-0.1, -0.1], rtol=1e-12)
    jump = 0.6 + 1.001 * 0.01 * JERK_LIMIT_M_S3
    assert pid_command(controller, (0.0,) * 4 + (jump, -0.1)) == [0.0, 0.0]


def test_pid_integrates_small_errors_up_to_a_limit() -> None:
    """By error, period and gain; a large error along either axis, or a clamped tilt, leaves the integral."""
    controller = pid(integral_rad_m_s=1.0)
    assert pid_command(controller, (0.5, -0.2, 0.0, 0.0, 0.0, 0.0)) == [0.0, 0.0]
    still = (0.0,) * 6
    np.testing.assert_allclose(pid_command(controller, still), [-0.002, -0.005], rtol=1e-12)
    far = (INTEGRATED_ERROR_M, 0.1, 0.0, 0.0, 0.0, 0.0)
    pid_command(controller, far)
    np.testing.assert_allclose(pid_command(controller, still), [-0.002, -0.005], rtol=1e-12)
    for _ in range(60):
        pid_command(controller, (0.5, -0.5, 0.0, 0.0, 0.0, 0.0))
    np.testing.assert_allclose(
        pid_command(controller, still), [-INTEGRAL_LIMIT_RAD, -INTEGRAL_LIMIT_RAD], rtol=1e-12
    )
    steep = pid(integral_rad_m_s=1.0, position_rad_m=1.01 * TILT_LIMIT_RAD / 0.5)
    pid_command(steep, (0.5, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert pid_command(steep, still) == [0.0, 0.0]


def test_pid_corrects_the_tilt_for_what_is_measured() -> None:
    """Measured against the tilt that the target's acceleration needs; at that tilt nothing is corrected."""
    controller = pid(tilt_feedback=0.5)
    np.testing.assert_allclose(
        pid_command(controller, (0.0,) * 6, (0.0, 0.0, 0.0, 0.0, 0.1, 0.2, 0.0)), [-0.05, -0.1], rtol=1e-12
    )
    right = (0.0, 0.0, 0.0, 0.0, 0.1, -0.2, 0.0)
    accelerated = (0.0, 0.0, 0.0, 0.0, 0.2 * GRAVITY_M_S2, 0.1 * GRAVITY_M_S2)
    np.testing.assert_allclose(pid_command(controller, accelerated, right), [0.0, 0.0], atol=1e-15)


def test_pid_low_pass_approaches_the_tilt_by_a_share_of_each_update() -> None:
    """With a time constant of one period by half of what is missing."""
    controller = pid(position_rad_m=0.1, low_pass_s=0.01)
    ahead = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    found = [pid_command(controller, ahead)[1] for _ in range(3)]
    np.testing.assert_allclose(found, [-0.05, -0.075, -0.0875], rtol=1e-12)


def test_pid_keeps_its_memory_where_the_state_is_nan() -> None:
    """Of one flight in a batch; the other is stepped."""
    gains = pid_gains()["mambo"]
    batch, alone = PidFeedForwardController(gains, 2), PidFeedForwardController(gains, 1)
    rng = np.random.default_rng(6)
    states, targets = rng.normal(0.0, 0.2, (9, 2, 7)), rng.normal(0.0, 0.2, (9, 2, 6))
    for number, (state, target) in enumerate(zip(states, targets, strict=True)):
        dropped = number in (0, 4)
        if dropped:
            state[1, number] = np.nan
        both = batch.step(state, target, np.full(2, 9.81))
        if not dropped:
            one = alone.step(state[1:], target[1:], np.array([9.81]))
            np.testing.assert_array_equal(both.command_rad[1:], one.command_rad)


@pytest.mark.parametrize("yaw_rad", [0.8, -2.0, np.pi / 2])
def test_heading_turns_every_term_of_the_pid(yaw_rad: float) -> None:
    """Seen from the world, the tilt is the same at every heading; so is the measured one."""
    gains = pid_gains()["mambo"]
    target, commands = (0.2, -0.1, 0.3, 0.1, 0.4, -0.2), []
    cosine, sine = float(np.cos(yaw_rad)), float(np.sin(yaw_rad))
    turned = (0.1 * cosine + 0.05 * sine, 0.05 * cosine - 0.1 * sine)
    for heading_rad, tilt_rad in ((0.0, (0.1, 0.05)), (yaw_rad, turned)):
        controller = PidFeedForwardController(gains)
        commands.append(pid_command(controller, target, (0.1, 0.1, -0.1, 0.2, *tilt_rad, heading_rad)))
    (level_roll, level_pitch), (roll, pitch) = commands
    towards = [roll * cosine - pitch * sine, roll * sine + pitch * cosine]
    np.testing.assert_allclose(towards, [level_roll, level_pitch], rtol=1e-12)


def test_a_drone_without_tuned_gains_flies_those_of_the_mambo() -> None:
    """The others fly their own; the number of controllers and the period are those of the flight."""
    tuned = pid_gains()
    for name in (*tuned, "mine"):
        drone = vehicle_toml.preset("crazyflie").model_copy(update={"name": name})
        flight = Flight(Hover(), flights=3, vehicle=Vehicle.of(drone), update_period_s=0.02)
        controller = pd_controller("pid-feedforward", flight)
        assert isinstance(controller, PidFeedForwardController)
        assert controller.gains == tuned.get(name, tuned["mambo"])
        assert (controller.n, controller.update_period_s) == (3, 0.02)
