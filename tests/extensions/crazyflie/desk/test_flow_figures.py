"""The figures of a flow deck, with which it is simulated off the desk, are those of a hover on it."""

from pathlib import Path

import numpy as np
import pytest

from mambo_extensions.crazyflie.desk.desk_flight import Desk
from mambo_extensions.crazyflie.desk.events_file import EventsFile, SensorsSection
from mambo_sil.drone.vehicles.vehicle_sections import FlowDeckSensors

HOVER = EventsFile(trajectory="hover", sensors=SensorsSection(kind="flow-deck"))
SETTLING_MS, SAMPLE_MS, SAMPLES = 6000, 10, 1500


def test_the_errors_of_a_hover_are_the_figures(flow_app: Path) -> None:
    """At 1 m: of the velocity within 15 %, of the height within 1 mm, and the drift of ten seconds."""
    velocity_m_s, height_m, drift_m = [], [], []
    for seed in range(4):
        desk = Desk(flow_app, HOVER.conditions(seed, 3))
        desk.run(1500)
        desk.take_off(1.0, 2.0)
        desk.run(SETTLING_MS)
        errors = np.empty((SAMPLES, 6))
        for row in errors:
            desk.run(SAMPLE_MS)
            true = (*desk.state.position_m, *desk.state.velocity_m_s)
            seen = [desk.log(f"stateEstimate.{name}") for name in ("x", "y", "z", "vx", "vy", "vz")]
            row[:] = np.array(seen) - true
        velocity_m_s.append(errors[:, 3:5].std(axis=0))
        height_m.append(errors[:, 2].std())
        drift_m.append(errors[1000:, :2] - errors[:-1000, :2])
    figures = FlowDeckSensors()
    assert np.mean(velocity_m_s) == pytest.approx(figures.velocity_error_m_s, rel=0.15)
    assert np.mean(height_m) == pytest.approx(figures.height_error_m, abs=1e-3)
    expected_m = figures.velocity_error_m_s * np.sqrt(2.0 * figures.velocity_error_s * 10.0)
    assert np.sqrt(np.mean(np.square(drift_m))) == pytest.approx(expected_m, rel=0.35)
