"""The largest horizontal acceleration that settings fly."""

import math

import pytest

from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.scenario import Scenario, flight_of
from mambo_sil.model.derive.reach import largest_acceleration_m_s2, reach_words
from tests.support.derived import settings_for
from tests.support.scenarios import changed

TRIMMED = {
    "roll": {"gain": 0.7},
    "pitch": {"gain": 0.9},
    "acceleration_per_tilt_g": 0.8,
    "roll_trim_rad": 0.05,
}


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("name", "attitude", "exact"),
    [
        ("generic", TRIMMED, False),
        ("crazyflie", {}, False),
        ("crazyflie", {}, True),
    ],
)
def test_a_far_target_is_flown_to_with_it(name: str, attitude: dict[str, object], exact: bool) -> None:
    """By the weaker of roll and pitch, forward, back, left and right; without drag, below the speed limit."""
    drone = changed(vehicle_toml.preset(name), attitude=attitude, body={"drag_1_s": 0.0})
    settings = settings_for(drone, exact=exact)
    scenarios = [
        Scenario(
            vehicle=drone,
            trajectory="step",
            size_m=9.0,
            rate_rad_s=0.0,
            duration_s=2.0,
            yaw_rad=quarter * math.pi / 2.0,
        )
        for quarter in range(4)
    ]
    trace = fly(flight_of(scenarios, settings.horizon.update_period_s), CompiledController(settings, 4))
    speed_m_s = trace.velocity_m_s[..., 0]
    gained_m_s = (speed_m_s[20:] - speed_m_s[:-20]).max(axis=0)
    found_m_s2 = gained_m_s.min() / (trace.time_s[20] - trace.time_s[0])
    assert largest_acceleration_m_s2(settings) == pytest.approx(found_m_s2, rel=0.08)
    assert settings.observer.disturbance_limit_m_s2 == pytest.approx(found_m_s2, rel=0.08)
    assert reach_words(settings).endswith(f"by limits.tilt_rad = {settings.limits.tilt_rad:g}")
