"""Estimates that drift: errors in closed form, and as a flow deck's on the desk."""

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_sil.drone.plant.vehicle import Seen
from mambo_sil.drone.sensors.drift import DriftingEstimate, DriftSuite
from mambo_sil.drone.vehicles.vehicle_sections import AutopilotSensors, FlowDeckSensors

FloatArray = NDArray[np.float64]

TICK_S, COUNT = 0.01, 20_000
AUTOPILOT = AutopilotSensors(velocity_error_m_s=0.2, velocity_error_s=0.5)
FLOW_DECK = FlowDeckSensors(velocity_error_m_s=0.05, velocity_error_s=0.4, height_error_m=0.01)


def still(flights: int) -> Seen:
    """Return drones that stand at the origin."""
    return Seen(*(np.zeros((3, flights)) for _ in range(4)))


def errors(drift: DriftingEstimate, ticks: int, seeds: tuple[int, ...]) -> FloatArray:
    """Return the errors of position and velocity at each tick (ticks, 2, 3, n)."""
    suite, true = DriftSuite(drift, seeds, TICK_S), still(len(seeds))
    seen = [suite.estimate(true) for _ in range(ticks)]
    return np.array([[one.position_m, one.velocity_m_s] for one in seen])


def test_errors_of_an_autopilot_have_their_size_and_their_time() -> None:
    """S of the velocity, S T / sqrt 2 of the position, and 1/e of the correlation after T."""
    found = errors(DriftingEstimate(AUTOPILOT), COUNT, (3, 4, 5, 6, 7))
    position_m, velocity_m_s = found[:, 0], found[:, 1]
    np.testing.assert_allclose(velocity_m_s.std(axis=(0, 2)), 0.2, rtol=0.08)
    np.testing.assert_allclose(position_m.std(axis=(0, 2)), 0.2 * 0.5 / np.sqrt(2.0), rtol=0.1)
    late = round(0.5 / TICK_S)
    after = np.mean(velocity_m_s[late:] * velocity_m_s[:-late]) / np.mean(velocity_m_s**2)
    assert abs(after - np.exp(-1.0)) < 0.06


def test_over_a_flow_deck_the_place_drifts_away_and_the_height_does_not() -> None:
    """By S sqrt(2 T t) along x and y after a time t; the height errs by its figure."""
    flights, ticks = 400, 2000
    found = errors(DriftingEstimate(FLOW_DECK), ticks, tuple(range(flights)))
    level_m = found[-1, 0, :2].std(axis=1)
    np.testing.assert_allclose(level_m, 0.05 * np.sqrt(2.0 * 0.4 * TICK_S * ticks), rtol=0.15)
    np.testing.assert_allclose(found[500:, 1, :2].std(axis=(0, 2)), 0.05, rtol=0.05)
    np.testing.assert_allclose(found[500:, 0, 2].std(), 0.01, rtol=0.05)


def test_the_noise_scale_is_a_factor_on_all_errors() -> None:
    """One for each flight; 0 is the true state."""
    once = errors(DriftingEstimate(FLOW_DECK), 50, (1, 1, 1))
    scaled = errors(DriftingEstimate(FLOW_DECK, np.array([0.0, 1.0, 4.0])), 50, (1, 1, 1))
    assert (scaled[..., 0] == 0.0).all()
    np.testing.assert_array_equal(scaled[..., 1], once[..., 1])
    np.testing.assert_array_equal(scaled[..., 2], 4.0 * once[..., 2])


def test_the_seed_decides() -> None:
    """And nothing else; a flight has the same errors alone."""
    together = errors(DriftingEstimate(AUTOPILOT), 100, (1, 2, 1))
    np.testing.assert_array_equal(together[..., 0], together[..., 2])
    np.testing.assert_array_equal(together[..., 0], errors(DriftingEstimate(AUTOPILOT), 100, (1,))[..., 0])
    assert not np.array_equal(together[..., 0], together[..., 1])


def test_a_drone_that_is_placed_has_no_errors_and_the_others_keep_theirs() -> None:
    """As one that begins."""
    suite, true = DriftSuite(DriftingEstimate(FLOW_DECK), (1, 2), TICK_S), still(2)
    before = [suite.estimate(true) for _ in range(100)][-1]
    suite.place(true, np.array([True, False]))
    after = suite.estimate(true)
    assert np.abs(after.position_m[:, 0]).max() == 0.0
    assert after.position_m[0, 1] == pytest.approx(before.position_m[0, 1], abs=2e-3)
    assert before.position_m[0, 1] != 0.0
