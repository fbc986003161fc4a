"""Attitude and velocity filters against kinematics, gravity and geometry, tick by tick."""

from dataclasses import replace

import numpy as np
import pytest

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.rigid_body import to_body
from mambo_sil.drone.plant.vehicle import STEP_S, Seen
from mambo_sil.drone.sensors.estimators import ACCELEROMETER_TAPS, Attitude, Suite, Velocity, velocity_gain
from mambo_sil.drone.sensors.instruments import Instruments, Readings, Sensors

GRAVITY = np.array([[0.0], [0.0], [-GRAVITY_M_S2]])
"""Specific force of a drone at rest, in the world frame."""
UNTRUSTED = 0.5 * GRAVITY
"""Specific force whose magnitude is not near g: it does not correct the tilt."""
NO_RATES = np.zeros((3, 1))


def column(*values: float) -> FloatArray:
    """Return an array (k, 1)."""
    return np.array(values)[:, np.newaxis]


def euler_rates(euler_rad: FloatArray, rates_rad_s: FloatArray) -> FloatArray:
    """Return the rates (3,) of roll, pitch, yaw from body rates (3,): equations 4 and 5 in matrix form."""
    roll, pitch, _ = euler_rad
    matrix = np.array(
        [
            [1.0, np.sin(roll) * np.tan(pitch), np.cos(roll) * np.tan(pitch)],
            [0.0, np.cos(roll), -np.sin(roll)],
            [0.0, np.sin(roll) / np.cos(pitch), np.cos(roll) / np.cos(pitch)],
        ]
    )
    return np.asarray(matrix @ rates_rad_s)


@pytest.mark.parametrize("seed", range(3))
def test_attitude_integrates_the_body_rates(seed: int) -> None:
    """One tick adds the Euler rates of equations 4 and 5 times 5 ms, at any attitude."""
    rng = np.random.default_rng(seed)
    euler_rad, rates_rad_s = rng.uniform(-1.0, 1.0, 3), rng.uniform(-3.0, 3.0, 3)
    attitude = Attitude(euler_rad[:, np.newaxis])
    attitude.update(np.concatenate([UNTRUSTED, rates_rad_s[:, np.newaxis]]))
    expected = euler_rad + STEP_S * euler_rates(euler_rad, rates_rad_s)
    np.testing.assert_allclose(attitude.euler_rad[:, 0], expected, rtol=1e-12)


def test_attitude_approaches_the_tilt_that_gravity_shows() -> None:
    """At rest, each tick corrects roll and pitch by a thousandth of their error; yaw is not observed.

    The coefficients of the low-pass are rounded to a sum of 1 - 5e-6.
    """
    true_rad, start_rad = np.array([0.2, -0.3, 0.9]), np.array([0.05, 0.1, 0.4])
    attitude = Attitude(start_rad[:, np.newaxis])
    imu = np.concatenate([to_body(true_rad[:, np.newaxis], GRAVITY), NO_RATES])
    for _ in range(50):
        attitude.update(imu)
    expected = true_rad + (start_rad - true_rad) * 0.999**50
    np.testing.assert_allclose(attitude.euler_rad[:2, 0], expected[:2], rtol=2e-6)
    assert attitude.euler_rad[2, 0] == 0.4


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("delay", range(8))
def test_attitude_trusts_the_low_passed_force(delay: int, sign: float) -> None:
    """A spike counts with the weight of its tap: up to 0.2 % of g after it, up or down, it is trusted."""
    tap = [*ACCELEROMETER_TAPS, 0.0, 0.0][delay]
    rest = np.concatenate([GRAVITY, NO_RATES])
    for weighted, trusted in ((0.99 * 0.002, True), (1.01 * 0.002, tap == 0.0)):
        attitude = Attitude(column(0.1, 0.0, 0.0))
        attitude.update(rest)
        for tick in range(delay + 1):
            before = attitude.euler_rad[0, 0]
            spike = 1.0 + sign * weighted / (tap or 1.0) if tick == 0 else 1.0
            attitude.update(np.concatenate([spike * GRAVITY, NO_RATES]))
        assert (attitude.euler_rad[0, 0] != before) == trusted


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_attitude_survives_a_force_beyond_g(sign: float) -> None:
    """A force above g along body x within the gate counts as a pitch of 90 degrees, not as NaN."""
    attitude = Attitude(np.zeros((3, 1)))
    attitude.update(np.concatenate([column(sign * 1.001 * GRAVITY_M_S2, 0.0, -1e-3), NO_RATES]))
    np.testing.assert_allclose(attitude.euler_rad[1, 0], sign * 0.001 * np.pi / 2.0, rtol=1e-12)


def test_attitude_keeps_the_integrated_angles_in_free_fall() -> None:
    """Without specific force there is no tilt: 0 / 0 does not enter; the flight beside it is corrected."""
    attitude = Attitude(np.array([[0.1, 0.1], [-0.2, -0.2], [0.3, 0.3]]))
    imu = np.zeros((6, 2))
    imu[2, 0] = -GRAVITY_M_S2
    with np.errstate(invalid="ignore"):
        attitude.update(imu)
    np.testing.assert_array_equal(attitude.euler_rad[:, 1], [0.1, -0.2, 0.3])
    np.testing.assert_allclose(attitude.euler_rad[:, 0], [0.0999, -0.1998, 0.3], rtol=1e-12)


@pytest.mark.parametrize("derotated", [True, False])
def test_flow_is_derotated_by_height_times_gyro_rate(derotated: bool) -> None:
    """At 2 m, pitching at 0.5 rad/s adds 1 m/s forward; rolling at 0.3 rad/s adds 0.6 m/s to the left."""
    flow_m_s, rotation_m_s = column(0.7, -0.4), column(1.0, -0.6)
    readings = Readings(
        column(0.0, 0.0, -GRAVITY_M_S2, 0.3, 0.5, 0.9), np.full(1, 2.0), np.zeros(1), flow_m_s
    )
    velocity = Velocity(np.zeros((2, 1)), derotated=derotated)
    velocity.update(readings, np.zeros((2, 1)), np.full(1, -2.0), np.zeros((2, 1)))
    translation_m_s = flow_m_s - rotation_m_s if derotated else flow_m_s
    np.testing.assert_allclose(velocity.velocity_m_s, velocity_gain() * translation_m_s, rtol=1e-12)


def test_velocity_integrates_a_fifth_of_the_acceleration() -> None:
    """Below 0.4 m no flow is accepted: each axis gains 0.2 times 5 ms times its acceleration a tick."""
    velocity = Velocity(column(0.1, -0.2), derotated=False)
    readings = Readings(np.zeros((6, 1)), np.zeros(1), np.zeros(1), np.zeros((2, 1)))
    for _ in range(11):
        velocity.update(readings, np.zeros((2, 1)), np.zeros(1), column(3.0, -5.0))
    np.testing.assert_allclose(velocity.velocity_m_s, column(0.1 + 0.03, -0.2 - 0.05), rtol=1e-12)


def test_estimates_follow_a_steady_motion_from_the_first_tick() -> None:
    """Level at any heading and velocity: without noise the errors are those of the delay of one tick.

    The position is the integral of the estimated velocity, one tick behind it.
    """
    velocity_m_s = column(1.0, -2.0, -0.5)
    euler_rad = column(0.0, 0.0, 0.8)
    position_m = column(3.0, 4.0, -1.5)
    suite = None
    seen = []
    for _ in range(200):
        true = Seen(position_m, velocity_m_s, euler_rad, NO_RATES)
        suite = suite or Suite(Sensors(noise_scale=0.0, derotated=True), (0,), true)
        seen.append(suite.estimate(true))
        np.testing.assert_allclose(seen[-1].velocity_m_s, velocity_m_s, atol=0.01)
        np.testing.assert_allclose(seen[-1].position_m, position_m, atol=0.006)
        np.testing.assert_allclose(seen[-1].euler_rad, euler_rad, atol=1e-9)
        position_m = position_m + STEP_S * velocity_m_s
    moved_m = seen[-1].position_m - seen[-2].position_m
    np.testing.assert_allclose(moved_m[:2], STEP_S * seen[-2].velocity_m_s[:2], atol=1e-14)


def test_estimates_of_a_leaning_drone_at_rest_stay() -> None:
    """Gravity, turned by the estimated angles, cancels the specific force on all axes."""
    true = Seen(column(0.0, 0.0, -1.1), NO_RATES, column(0.2, -0.3, 0.9), NO_RATES)
    suite = Suite(Sensors(noise_scale=0.0), (0,), true)
    for _ in range(300):
        seen = suite.estimate(true)
    np.testing.assert_allclose(seen.velocity_m_s, 0.0, atol=1e-5)
    np.testing.assert_allclose(seen.position_m, true.position_m, atol=1e-5)
    np.testing.assert_allclose(seen.euler_rad, true.euler_rad, atol=1e-6)


@pytest.mark.parametrize(
    ("euler_rad", "accepted"), [((0.0, 0.0, 2.0), True), ((1.0, 0.0, 0.0), False), ((0.0, 1.0, 0.0), False)]
)
def test_roll_and_pitch_gate_the_flow_and_the_heading_does_not(
    euler_rad: tuple[float, float, float], accepted: bool
) -> None:
    """Rolling at 0.6 rad/s, the camera sees a motion that is accepted up to 0.6 rad of tilt, at any yaw."""
    true = Seen(column(0.0, 0.0, -1.1), NO_RATES, column(*euler_rad), column(0.6, 0.0, 0.0))
    seen = Suite(Sensors(noise_scale=0.0), (0,), true).estimate(true)
    assert bool(np.abs(seen.velocity_m_s[:2]).max() > 0.01) == accepted


@pytest.mark.parametrize("axis", [0, 1])
def test_acceleration_drives_the_velocity_of_its_own_axis(axis: int) -> None:
    """Below 0.4 m, without flow, 1 m/s^2 along one axis for half a second gives a fifth of 0.5 m/s."""
    velocity_m_s, position_m = np.zeros((3, 1)), column(0.0, 0.0, -0.2)
    suite = Suite(Sensors(noise_scale=0.0), (0,), Seen(position_m, velocity_m_s, NO_RATES, NO_RATES))
    for tick in range(100):
        velocity_m_s = np.zeros((3, 1))
        velocity_m_s[axis] = STEP_S * (tick + 1)
        seen = suite.estimate(Seen(position_m, velocity_m_s, NO_RATES, NO_RATES))
    np.testing.assert_allclose(seen.velocity_m_s[axis], 0.1, rtol=0.05)
    np.testing.assert_allclose(seen.velocity_m_s[1 - axis], 0.0, atol=1e-9)


def test_accelerometer_shows_acceleration_minus_gravity_in_body_axes() -> None:
    """After the IMU's transient a leaning drone reads R transposed (a - g), and its own rates."""
    acceleration_m_s2, euler_rad = column(1.0, -2.0, 0.5), column(0.2, -0.3, 0.9)
    rates_rad_s = column(0.3, -0.5, 0.7)
    true = Seen(column(0.0, 0.0, -1.1), np.zeros((3, 1)), euler_rad, rates_rad_s)
    instruments = Instruments(Sensors(noise_scale=0.0), (0,), true)
    for tick in range(1, 40):
        reading = instruments.read(replace(true, velocity_m_s=STEP_S * tick * acceleration_m_s2))
    expected = to_body(euler_rad, acceleration_m_s2 + GRAVITY)
    np.testing.assert_allclose(reading.imu, np.concatenate([expected, rates_rad_s]), rtol=1e-6)
