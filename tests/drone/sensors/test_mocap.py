"""Motion capture: rate, delay, filter and noise as its figures say."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from mambo_sil.drone.plant.vehicle import Seen
from mambo_sil.drone.sensors.mocap import MocapSuite, MotionCapture
from mambo_sil.drone.vehicles.vehicle_sections import MocapSensors

FloatArray = NDArray[np.float64]

STEP_S = 0.002


def figures(**changed: Any) -> MocapSensors:
    """Return noise-free motion capture at 100 Hz without delay and filter, but for some figures."""
    values = {"position_noise_m": 0.0, "velocity_filter_s": 0.0, "attitude_noise_rad": 0.0} | changed
    return MocapSensors(kind="mocap", **values)


def truth_at(tick: float, flights: int = 1) -> Seen:
    """Return drones that fly along a curve, and turn."""
    time_s = STEP_S * tick
    position = np.array([time_s * time_s, 2.0 * time_s, -1.0])
    velocity = np.array([2.0 * time_s, 2.0, 0.0])
    columns = (position, velocity, [0.1, -0.2, time_s], [0.3, 0.2, 0.1])
    return Seen(*(np.repeat(np.array(column)[:, np.newaxis], flights, axis=1) for column in columns))


def observe(sensors: MocapSensors, ticks: int, flights: int = 1, scale: float = 1.0) -> list[Seen]:
    """Return what is seen of `truth_at` at each tick."""
    seeds = tuple(range(flights))
    suite = MocapSuite(MotionCapture(sensors, scale), seeds, truth_at(0, flights), STEP_S)
    return [suite.estimate(truth_at(tick, flights)) for tick in range(ticks)]


def test_a_position_is_held_until_the_next_one_arrives() -> None:
    """At 100 Hz for five ticks of 2 ms; attitude and rates are those of every tick."""
    for tick, seen in enumerate(observe(figures(), 40)):
        true = truth_at(tick)
        np.testing.assert_array_equal(seen.position_m, truth_at(5 * (tick // 5)).position_m)
        np.testing.assert_array_equal(seen.euler_rad, true.euler_rad)
        np.testing.assert_array_equal(seen.rates_rad_s, true.rates_rad_s)


def test_a_position_is_late() -> None:
    """By the nearest number of ticks; before the start the drone rested where it started."""
    for tick, seen in enumerate(observe(figures(position_delay_s=0.0138), 40)):
        np.testing.assert_array_equal(
            seen.position_m, truth_at(max(5 * (tick // 5) - 7, 0)).position_m, str(tick)
        )


LEVER_M = (0.04, -0.03, 0.05)


def test_a_measured_place_beside_the_centre_of_mass_is_moved_back() -> None:
    """Without a delay to where the centre of mass is, to rounding."""
    for tick, seen in enumerate(observe(figures(lever_m=LEVER_M), 40)):
        true = truth_at(5 * (tick // 5))
        np.testing.assert_allclose(seen.position_m, true.position_m, rtol=0, atol=1e-15)


def test_a_late_place_is_moved_back_by_the_attitude_of_now() -> None:
    """What the drone has turned since, of R of Euler's angles, remains."""
    for tick, seen in enumerate(observe(figures(lever_m=LEVER_M, position_delay_s=0.01), 40)[5::5]):
        now, then = truth_at(5 * tick + 5), truth_at(5 * tick)
        before, after = (
            Rotation.from_euler("xyz", one.euler_rad[:, 0]).apply(LEVER_M) for one in (then, now)
        )
        off_m = (seen.position_m - then.position_m)[:, 0]
        np.testing.assert_allclose(off_m, before - after, rtol=0, atol=1e-15)
        assert np.abs(off_m).max() > 1e-4


def test_without_a_filter_the_velocity_is_the_difference_quotient() -> None:
    """Of the last two positions; the first one has none, and the true velocity stays."""
    seen = observe(figures(), 40)
    np.testing.assert_array_equal(seen[4].velocity_m_s, truth_at(0).velocity_m_s)
    for tick in range(5, 40, 5):
        quotient = (truth_at(tick).position_m - truth_at(tick - 5).position_m) / 0.01
        np.testing.assert_allclose(seen[tick].velocity_m_s, quotient, rtol=1e-12, atol=1e-12)


def test_the_filter_is_a_first_order_low_pass() -> None:
    """On a ramp of the velocity it lags by its time constant and half the sampling period."""
    seen = observe(figures(velocity_filter_s=0.05), 1001)[-1]
    share = 1.0 - np.exp(-0.01 / 0.05)
    behind = 0.01 * (1.0 - share) / share + 0.005
    assert seen.velocity_m_s[0, 0] == pytest.approx(2.0 * (2.0 - behind), abs=1e-6)
    assert seen.velocity_m_s[1, 0] == pytest.approx(2.0, abs=1e-9)


@pytest.mark.parametrize("scale", [1.0, 0.5])
def test_noise_has_the_standard_deviation_of_its_figure(scale: float) -> None:
    """Of positions and angles, times the scale; every flight and every position has its own."""
    flights, ticks = 400, 100
    noisy = figures(position_noise_m=0.002, attitude_noise_rad=0.01)
    seen = observe(noisy, ticks, flights, scale)
    true = [truth_at(tick, flights) for tick in range(ticks)]
    position = np.array([one.position_m - true[5 * (k // 5)].position_m for k, one in enumerate(seen)])
    angles = np.array([one.euler_rad - true[k].euler_rad for k, one in enumerate(seen)])
    for axis in range(3):
        assert position[::5, axis].std() == pytest.approx(scale * 0.002, rel=0.03)
        assert angles[:, axis].std() == pytest.approx(scale * 0.01, rel=0.02)
    assert np.abs(np.corrcoef(angles.reshape(ticks * 3, flights)[:, :8].T) - np.eye(8)).max() < 0.3
