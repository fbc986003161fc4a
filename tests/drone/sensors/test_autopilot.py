"""The errors of an autopilot's estimator against their closed forms."""

import numpy as np

from mambo_sil.drone.sensors.autopilot import EstimatorErrors
from mambo_sil.drone.vehicles.vehicle_sections import AutopilotSensors

STEP_S, COUNT = 0.01, 100_000
FIGURES = AutopilotSensors(velocity_error_m_s=0.2, velocity_error_s=0.5)


def test_the_errors_have_their_size_and_their_time() -> None:
    """S of the velocity, S T / sqrt 2 of the position, and 1/e of the correlation after T."""
    errors = EstimatorErrors(FIGURES, 3, STEP_S)
    found = np.empty((COUNT, 2, 3))
    for row in found:
        errors.advance()
        row[:] = errors.position_m, errors.velocity_m_s
    position_m, velocity_m_s = found[:, 0], found[:, 1]
    np.testing.assert_allclose(velocity_m_s.std(axis=0), 0.2, rtol=0.08)
    np.testing.assert_allclose(position_m.std(axis=0), 0.2 * 0.5 / np.sqrt(2.0), rtol=0.1)
    late = round(0.5 / STEP_S)
    after = np.mean(velocity_m_s[late:] * velocity_m_s[:-late]) / np.mean(velocity_m_s**2)
    assert abs(after - np.exp(-1.0)) < 0.06


def test_the_seed_decides() -> None:
    """And nothing else."""
    first, again, other = (EstimatorErrors(FIGURES, seed, STEP_S) for seed in (1, 1, 2))
    for each in (first, again, other):
        for _ in range(100):
            each.advance()
    np.testing.assert_array_equal(first.velocity_m_s, again.velocity_m_s)
    assert not np.array_equal(first.velocity_m_s, other.velocity_m_s)
