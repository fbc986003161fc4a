"""Sensors and estimators: readings of each instrument, design of each filter, errors of the estimates."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import STEP_S, Seen
from mambo_sil.drone.sensors import estimators
from mambo_sil.drone.sensors.estimators import Suite
from mambo_sil.drone.sensors.instruments import Instruments, Sensors
from mambo_sil.flight.controllers.pd import PdController
from mambo_sil.flight.loop import Flight, fly
from mambo_sil.flight.names import Start
from mambo_sil.flight.traces import SensedTrace, Trace
from mambo_sil.flight.trajectories import Bernoulli

QUIET = Sensors(noise_scale=0.0)
VARIANCES = (0.3, 0.3, 0.5, 0.002, 0.002, 0.002, 0.001, 50.0)
"""Noise in RollingSpiderEdu: accelerometer x, y, z, gyro x, y, z, sonar, pressure, in SI units squared."""


def hovering(n: int = 1, z_m: float = -1.1) -> Seen:
    """Return the true state of n drones at rest."""
    rest = np.zeros((3, n))
    position_m = rest.copy()
    position_m[2] = z_m
    return Seen(position_m, rest.copy(), rest.copy(), rest.copy())


def fly_eight(sensors: Sensors, duration_s: float = 6.0, start: Start = "hover") -> Trace:
    """Fly the figure of eight of Table II with the PD."""
    return fly(Flight(Bernoulli(2.0, 0.5), duration_s, start=start, sensors=sensors), PdController())


def errors(trace: Trace) -> dict[str, FloatArray]:
    """Return the largest estimation error of each axis."""
    assert isinstance(trace, SensedTrace)
    return {
        "position": np.abs(trace.seen_position_m - trace.position_m).max(axis=(0, 1)),
        "velocity": np.abs(trace.seen_velocity_m_s - trace.velocity_m_s).max(axis=(0, 1)),
        "euler": np.abs(trace.seen_euler_rad - trace.euler_rad).max(axis=(0, 1)),
    }


@pytest.mark.long
def test_noise_free_estimates_follow_the_true_state() -> None:
    """Over 6 s the errors stay below 0.01 rad of tilt, 2 mm of height, 0.15 m of position and 0.2 m/s.

    Rotation left in the flow makes the velocity error at least 1.4 times as large on both axes.
    """
    found = errors(fly_eight(replace(QUIET, derotated=True)))
    assert (found["euler"] < [0.01, 0.01, 0.001]).all(), found
    assert (found["position"] < [0.15, 0.15, 0.002]).all(), found
    assert (found["velocity"] < [0.2, 0.2, 0.01]).all(), found
    assert (errors(fly_eight(QUIET))["velocity"][:2] > 1.4 * found["velocity"][:2]).all()


def test_noise_free_estimates_at_rest_do_not_drift() -> None:
    """After five seconds of hover the estimates are within 1e-9 of the true state."""
    true = hovering(2)
    suite = Suite(QUIET, (0, 1), true)
    for _ in range(1000):
        seen = suite.estimate(true)
    for name in ("position_m", "velocity_m_s", "euler_rad", "rates_rad_s"):
        np.testing.assert_allclose(getattr(seen, name), getattr(true, name), atol=1e-9)


def test_altitude_estimate_follows_a_take_off() -> None:
    """Up to 4 m/s of climb the height error stays below 0.15 m; the drone ends within 3 cm of 1.1 m."""
    trace = fly_eight(QUIET, 1.0, start="take-off")
    assert errors(trace)["position"][2] < 0.15
    assert isinstance(trace, SensedTrace)
    assert abs(trace.position_m[-1, 0, 2] + 1.1) < 0.03


def noise(sensors: Sensors) -> FloatArray:
    """Return the noise (k, 20, 8) of hovering drones: their readings minus those without noise."""
    true = hovering(20)
    both = [Instruments(each, tuple(range(20)), true) for each in (sensors, QUIET)]
    rows = []
    for _ in range(301):
        read = [instruments.read(true) for instruments in both]
        noisy, quiet = (np.vstack([one.imu, one.sonar_m, one.pressure_pa]) for one in read)
        rows.append((noisy - quiet).T)
    return np.array(rows[1:])


def test_noise_has_the_variances_of_the_source() -> None:
    """Variances agree within 7 %; noise is white, zero-mean, independent and proportional to its scale, 1."""
    found = noise(Sensors())
    every = found.reshape(-1, 8)
    np.testing.assert_allclose(every.var(axis=0), VARIANCES, rtol=0.07)
    assert (np.abs(every.mean(axis=0)) < 4.0 * np.sqrt(np.array(VARIANCES) / len(every))).all()
    pairs = np.concatenate([found[1:], found[:-1]], axis=2).reshape(-1, 16)
    assert np.abs(np.corrcoef(pairs.T) - np.eye(16)).max() < 0.06
    np.testing.assert_allclose(noise(Sensors(noise_scale=0.5)), 0.5 * found, atol=1e-6)


def test_bias_adds_to_the_imu() -> None:
    """Each axis of accelerometer and gyro has its own bias."""
    true = hovering()
    biased = Instruments(Sensors(0.0, (0.1, 0.2, 0.3), (0.4, 0.5, 0.6)), (0,), true)
    np.testing.assert_allclose(
        biased.read(true).imu[:, 0], [0.1, 0.2, 0.3 - GRAVITY_M_S2, 0.4, 0.5, 0.6], atol=1e-12
    )


def test_imu_responds_as_the_second_order_system_of_the_source() -> None:
    """A step of the rates gives the response of the exact discretization: 190 rad/s, damping 0.707."""
    true = hovering()
    imu = Instruments(QUIET, (0,), true)
    turning = replace(true, rates_rad_s=np.full((3, 1), 2.0))
    found = [float(imu.read(turning).imu[3, 0]) for _ in range(40)][1:]
    w, d = 190.0, 0.707
    held_input = np.array([[0.0, 1.0, 0.0], [-w * w, -2.0 * d * w, w * w], [0.0, 0.0, 0.0]])
    transition = scipy.linalg.expm(held_input * STEP_S)
    state, expected = np.zeros(2), []
    for rate_rad_s in [1.0] + 38 * [2.0]:  # the input is the mean over a tick: first (0 + 2) / 2
        state = (transition @ [*state, rate_rad_s])[:2]
        expected.append(state[0])
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    assert max(found) > 2.05  # it overshoots


def test_imu_saturates_at_its_limits() -> None:
    """Readings saturate at +/- 50 m/s^2 and +/- 10 rad/s."""
    true = hovering()
    imu = Instruments(QUIET, (0,), true)
    for sign in (1.0, -1.0):
        hit = replace(true, velocity_m_s=np.full((3, 1), 99.0 * sign), rates_rad_s=np.full((3, 1), 40 * sign))
        for _ in range(4):
            imu.read(hit)
        found = imu.read(true).imu[:, 0]
        assert np.abs(found).max() <= 50.0
        np.testing.assert_allclose(found[3:], 10.0 * sign)


def test_sonar_saturates_at_its_least_height() -> None:
    """The sonar reads 0.44 m on the ground and 1 m at 1 m; the pressure falls by 12.01725 Pa per metre."""
    for z_m, height_m in ((0.0, 0.44), (-0.3, 0.44), (-1.0, 1.0)):
        true = hovering(z_m=z_m)
        readings = Instruments(QUIET, (0,), true).read(true)
        assert readings.sonar_m[0] == pytest.approx(height_m)
        assert readings.pressure_pa[0] == pytest.approx(12.01725 * z_m)


def test_optical_flow_is_sampled_at_60_hz_held_and_delayed() -> None:
    """Images are due at t = 0 and every 10/3 ticks; each shows the true velocity of one tick before."""
    true = hovering()
    camera = Instruments(QUIET, (0,), true)
    read = []
    for tick in range(201):
        moving = replace(true, velocity_m_s=np.array([[float(tick)], [0.0], [0.0]]))
        read.append(float(camera.read(moving).flow_m_s[0, 0]))
    changes = np.flatnonzero(np.diff(read)) + 1
    np.testing.assert_array_equal(np.array(read)[changes], changes - 1)
    due = np.arange(1, 60) * 10 / 3
    np.testing.assert_array_equal(changes - 1, np.ceil(due - 1e-9))


def test_camera_rotation_adds_to_the_flow() -> None:
    """At 1 m, pitching up adds 0.8 of the rate to the forward flow; rolling right adds flow to the left."""
    true = replace(hovering(z_m=-1.0), rates_rad_s=np.array([[0.3], [0.5], [0.0]]))
    flow = Instruments(QUIET, (0,), true).read(true).flow_m_s[:, 0]
    np.testing.assert_allclose(flow, [0.4, -0.24])


def test_kalman_gains_solve_the_riccati_equation() -> None:
    """The altitude gains agree with scipy's solution; all gains are those of the stock model."""
    a, c = np.array([[1.0, STEP_S], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    q, r = estimators.ALTITUDE_NOISE
    p = scipy.linalg.solve_discrete_are(a.T, c.T, np.diag([0.0, q]), np.array([[r]]))
    np.testing.assert_allclose(estimators.altitude_gains(), p[:, 0] / (p[0, 0] + r), rtol=1e-6)
    assert estimators.altitude_gains() == pytest.approx((0.02624, 0.06978), abs=5e-6)
    assert estimators.velocity_gain() == pytest.approx(0.1254656, abs=5e-8)


def test_low_pass_filters_have_their_designs() -> None:
    """FIR: order 5, Hamming window, cut-off 0.1 of the Nyquist frequency; IIR: Butterworth, order 3, 0.01."""
    taps = np.hamming(6) * np.sinc(0.1 * (np.arange(6) - 2.5))
    np.testing.assert_allclose(estimators.ACCELEROMETER_TAPS, taps / taps.sum(), atol=1e-5)
    poles = np.tan(np.pi * 0.01 / 2.0) * np.exp(1j * np.pi * np.array([2, 3, 4]) / 3.0)
    a = np.poly((1.0 + poles) / (1.0 - poles)).real  # the bilinear transform
    b = a.sum() / 8.0 * np.array([1.0, 3.0, 3.0, 1.0])
    values = np.random.default_rng(1).normal(size=500)
    low_pass = estimators._LowPass(values[:1])
    found = [float(low_pass.update(np.array([value]))[0]) for value in values]
    given, expected = [values[0]] * 3 + values.tolist(), [values[0]] * 3
    for at in range(3, len(given)):
        expected.append(b @ given[at - 3 : at + 1][::-1] - a[1:] @ expected[at - 3 :][::-1])
    np.testing.assert_allclose(found, expected[3:], atol=1e-6)


def test_yaw_drifts_as_a_random_walk_and_position_with_it() -> None:
    """Yaw integrates the gyro noise; x integrates the velocity noise that the accelerometer causes.

    After some seconds the tilt, a random walk like the yaw, makes x drift faster.
    """
    flights, ticks = 400, 800
    true = hovering(flights)
    suite = Suite(Sensors(), tuple(range(flights)), true)
    yaw, x = np.empty((ticks, flights)), np.empty((ticks, flights))
    for tick in range(ticks):
        seen = suite.estimate(true)
        yaw[tick], x[tick] = seen.euler_rad[2], seen.position_m[0]
    for tick in (199, 399, 799):
        assert yaw[tick].var() == pytest.approx(0.002 * STEP_S * STEP_S * (tick + 1), rel=0.25)
    gain = estimators.velocity_gain()
    factor = (1.0 - gain) / gain * estimators.ACCELERATION_GAIN * STEP_S * STEP_S
    for tick in (99, 199):
        assert x[tick].var() == pytest.approx(0.3 * factor * factor * (tick + 1), rel=0.25)
    assert x[799].var() > 4.0 * x[199].var()
