"""The gates of the stock estimators, exactly at their edges: sonar, its low-passed heights, optical flow."""

import math

import numpy as np
import pytest

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import STEP_S
from mambo_sil.drone.sensors.estimators import Altitude, Velocity, velocity_gain
from mambo_sil.drone.sensors.instruments import PA_PER_M, Readings

STILL = np.zeros(1)
FAR_M = 9.0
"""Height of a low-passed pressure that supports no sonar reading."""


def heights(sonar_m: float, pressure_m: float) -> Readings:
    """Return readings of one level drone at rest, with the heights that sonar and barometer show."""
    imu = np.array([[0.0], [0.0], [-GRAVITY_M_S2], [0.0], [0.0], [0.0]])
    return Readings(imu, np.array([sonar_m]), np.array([-PA_PER_M * pressure_m]), np.zeros((2, 1)))


def is_accepted(altitude: Altitude, sonar_m: float, pressure_m: float) -> bool:
    """Return whether a sonar reading changes the estimate of a filter without vertical velocity."""
    before = altitude.z_m
    altitude.update(heights(sonar_m, pressure_m), STILL)
    return bool(altitude.z_m[0] != before[0])


def displace(altitude: Altitude, distance_m: float, pressure_m: float) -> None:
    """Move the estimate along z in three ticks by acceleration alone: the sonar is out of its range."""
    push = np.array([distance_m / (STEP_S * STEP_S)])
    for acceleration_m_s2 in (push, -push, STILL):
        altitude.update(heights(0.44, pressure_m), acceleration_m_s2)


@pytest.mark.parametrize(("sonar_m", "accepted"), [(0.44, False), (math.nextafter(0.44, 1.0), True)])
def test_sonar_at_the_end_of_its_range_is_rejected(sonar_m: float, accepted: bool) -> None:
    """A saturated sonar reads exactly 0.44 m and says nothing about the height; any larger reading does."""
    assert is_accepted(Altitude(np.array([-0.5]), STILL), sonar_m, 0.5) == accepted


@pytest.mark.parametrize(("low_m", "high_m"), [(0.75 - 0.3, 0.75)])
def test_sonar_is_accepted_within_three_tenths_of_a_metre_inclusive(low_m: float, high_m: float) -> None:
    """A reading exactly 0.3 m from the estimate, above or below, is accepted; the next number is not."""
    assert high_m - low_m == 0.3
    assert is_accepted(Altitude(np.array([-high_m]), STILL), low_m, high_m)
    assert is_accepted(Altitude(np.array([-low_m]), STILL), high_m, low_m)
    assert not is_accepted(Altitude(np.array([-high_m]), STILL), math.nextafter(low_m, 0.0), high_m)
    assert not is_accepted(Altitude(np.array([-low_m]), STILL), math.nextafter(high_m, 1.0), low_m)


def test_sonar_is_compared_with_the_last_estimate_not_with_the_prediction() -> None:
    """Climbing at 20 m/s the prediction is 0.1 m higher: 0.35 m above the estimate is out, below it in."""
    for sonar_m, accepted in ((1.45, False), (0.85, True)):
        altitude = Altitude(np.array([-1.1]), np.array([-20.0]))
        altitude.update(heights(1.1, 1.1), STILL)
        altitude.update(heights(sonar_m, 1.1), STILL)
        assert (altitude.z_m[0] != -1.1 - 20.0 * STEP_S) == accepted


@pytest.mark.parametrize(
    ("distance_m", "pressure_m", "accepted"),
    [
        *((sign * 0.39, FAR_M, True) for sign in (1.0, -1.0)),
        *((sign * 0.41, FAR_M, False) for sign in (1.0, -1.0)),
        *((sign * 0.79, 2.0, True) for sign in (1.0, -1.0)),
        *((sign * 0.81, 2.0, False) for sign in (1.0, -1.0)),
    ],
)
def test_sonar_needs_a_low_passed_height_near_the_estimate(
    distance_m: float, pressure_m: float, accepted: bool
) -> None:
    """The low-passed sonar may be 0.4 m off the estimate, the low-passed pressure 0.8 m; one is enough.

    Both low-passed heights settle, the pressure far away or at 2 m. The estimate moves; the sonar follows it.
    """
    altitude = Altitude(np.array([-2.0]), STILL)
    for _ in range(1000):
        altitude.update(heights(2.0, pressure_m), STILL)
    displace(altitude, distance_m, pressure_m)
    assert altitude.z_m[0] == pytest.approx(-2.0 + distance_m, abs=1e-12)
    assert is_accepted(altitude, 2.0 - distance_m + 0.05, pressure_m) == accepted


def flow_gain(
    flow_m_s: FloatArray, tilt_rad: FloatArray, rates_rad_s: FloatArray, z_m: float = -1.1
) -> FloatArray:
    """Return the share of the flow (2,) that a filter at rest adopts."""
    imu = np.array([0.0, 0.0, -GRAVITY_M_S2, *rates_rad_s, 0.0])[:, np.newaxis]
    readings = Readings(imu, np.array([-z_m]), STILL, flow_m_s[:, np.newaxis])
    velocity = Velocity(np.zeros((2, 1)), derotated=False)
    velocity.update(readings, tilt_rad[:, np.newaxis], np.array([z_m]), np.zeros((2, 1)))
    return np.asarray(velocity.velocity_m_s[:, 0] / flow_m_s)


AXES = [sign * np.eye(2)[axis] for axis in range(2) for sign in (1.0, -1.0)]
"""Both directions of both axes."""
SLOW = np.array([0.1, -0.2])
"""A flow that no gate rejects."""


@pytest.mark.parametrize("axis", AXES, ids=str)
def test_flow_gates_hold_on_both_axes_and_include_their_edges(axis: FloatArray) -> None:
    """Tilt 0.6 rad and rate 7 rad/s, or rate 0.5 rad/s at any tilt; jump 5 m/s. The next number is out."""
    none = np.zeros(2)
    edges = [
        (SLOW, 0.6 * axis, 7.0 * axis),
        (SLOW, math.pi * axis, 0.5 * axis),
        (5.0 * axis + 0.1 * np.abs(axis[::-1]), none, none),
    ]
    for inputs in edges:
        np.testing.assert_allclose(flow_gain(*inputs), velocity_gain(), rtol=1e-12)
    beyond = [
        (SLOW, math.nextafter(0.6, 1.0) * axis, 7.0 * axis),
        (SLOW, 0.6 * axis, math.nextafter(7.0, 8.0) * axis),
        (SLOW, math.pi * axis, math.nextafter(0.5, 1.0) * axis),
        (math.nextafter(5.0, 6.0) * axis + 0.1 * np.abs(axis[::-1]), none, none),
    ]
    for inputs in beyond:
        np.testing.assert_array_equal(flow_gain(*inputs), 0.0)


@pytest.mark.parametrize(("z_m", "accepted"), [(-0.4, True), (math.nextafter(-0.4, 0.0), False)])
def test_flow_is_accepted_from_four_tenths_of_a_metre_up(z_m: float, accepted: bool) -> None:
    """At exactly 0.4 m the flow counts, below it does not."""
    expected = velocity_gain() if accepted else 0.0
    np.testing.assert_allclose(flow_gain(SLOW, np.zeros(2), np.zeros(2), z_m), expected, rtol=1e-12)


@pytest.mark.parametrize(("flow_m_s", "accepted"), [(8.5, False), (-1.5, True), (-2.5, False)])
def test_flow_is_compared_with_the_last_estimate_not_with_the_prediction(
    flow_m_s: float, accepted: bool
) -> None:
    """The estimate is 3 m/s, the prediction 4 m/s: a flow of 8.5 m/s is out, -1.5 m/s in, -2.5 m/s out."""
    velocity = Velocity(np.full((2, 1), 3.0), derotated=False)
    level, z_m = np.zeros((2, 1)), np.array([-1.1])
    imu = heights(1.1, 1.1).imu
    velocity.update(
        Readings(imu, -z_m, STILL, np.full((2, 1), 3.0)), level, z_m, np.full((2, 1), 1.0 / (0.2 * STEP_S))
    )
    np.testing.assert_array_equal(velocity.velocity_m_s, 3.0)
    velocity.update(Readings(imu, -z_m, STILL, np.full((2, 1), flow_m_s)), level, z_m, np.zeros((2, 1)))
    corrected = 4.0 + velocity_gain() * (flow_m_s - 4.0)
    np.testing.assert_allclose(velocity.velocity_m_s, corrected if accepted else 4.0, rtol=1e-12)


def test_yaw_rate_does_not_gate_the_flow() -> None:
    """Turning about the vertical at 9 rad/s the flow is accepted."""
    imu = np.array([[0.0], [0.0], [-GRAVITY_M_S2], [0.0], [0.0], [9.0]])
    velocity = Velocity(np.zeros((2, 1)), derotated=False)
    velocity.update(
        Readings(imu, np.ones(1), STILL, SLOW[:, np.newaxis]), np.zeros((2, 1)), -np.ones(1), np.zeros((2, 1))
    )
    np.testing.assert_allclose(velocity.velocity_m_s[:, 0], velocity_gain() * SLOW, rtol=1e-12)


@pytest.mark.parametrize("outlier", ["tilt", "rate", "jump", "height"])
def test_flow_is_gated_flight_by_flight(outlier: str) -> None:
    """One flight of three is beyond a gate; the others accept their flow."""
    imu, tilt_rad, flow_m_s, z_m = np.zeros((6, 3)), np.zeros((2, 3)), np.full((2, 3), 0.1), np.full(3, -1.1)
    imu[3] = 0.6  # above the slow rate, at which any tilt is accepted
    match outlier:
        case "tilt":
            tilt_rad[0, 1] = 1.0
        case "rate":
            imu[4, 1] = 8.0
        case "jump":
            flow_m_s[1, 1] = 6.0
        case _:
            z_m[1] = -0.3
    velocity = Velocity(np.zeros((2, 3)), derotated=False)
    velocity.update(Readings(imu, -z_m, np.zeros(3), flow_m_s), tilt_rad, z_m, np.zeros((2, 3)))
    expected = velocity_gain() * 0.1 * np.array([1.0, 0.0, 1.0])
    np.testing.assert_allclose(velocity.velocity_m_s, [expected, expected], rtol=1e-12)


def test_an_accepted_sonar_reading_corrects_height_and_velocity() -> None:
    """A reading 0.1 m higher moves z by 0.02624 and its rate by 0.06978 1/s of that, in its flight only."""
    altitude = Altitude(np.full(2, -1.1), np.zeros(2))
    altitude.update(
        Readings(np.zeros((6, 2)), np.array([1.2, 1.1]), -PA_PER_M * np.full(2, 1.1), np.zeros((2, 2))),
        np.zeros(2),
    )
    np.testing.assert_allclose(altitude.z_m, [-1.1 - 0.1 * 0.02624, -1.1], atol=1e-6)
    np.testing.assert_allclose(altitude.velocity_m_s, [-0.1 * 0.06978, 0.0], atol=1e-6)
