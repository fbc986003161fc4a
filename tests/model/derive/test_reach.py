"""The largest horizontal acceleration that settings fly."""

import math

import pytest

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.numbers.reach import FLOWN_SHARE, flown_acceleration_m_s2, largest_acceleration_m_s2
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.scenario import Scenario, flight_of
from mambo_sil.model.derive.reach import reach_words
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


@pytest.mark.parametrize("axis", ["roll", "pitch"])
@pytest.mark.parametrize("trim_rad", [0.05, -0.05])
def test_the_weaker_axis_limits_it_and_a_trim_of_either_sign_takes_from_it(
    axis: str, trim_rad: float
) -> None:
    """The commanded tilt is the limit; its drone turns by a gain of it, less the trim."""
    given = settings_for(vehicle_toml.preset("crazyflie"), exact=True)
    even = {"roll_gain": 1.0, "pitch_gain": 1.0, "roll_trim_rad": 0.0, "pitch_trim_rad": 0.0}
    weak = even | {f"{axis}_gain": 0.8, f"{axis}_trim_rad": trim_rad, "acceleration_per_tilt": 1.1}
    settings = given.model_copy(update={"model": given.model.model_copy(update=weak)})
    reached_rad = 0.8 * settings.limits.tilt_rad - 0.05
    assert largest_acceleration_m_s2(settings) == pytest.approx(GRAVITY_M_S2 * 1.1 * math.tan(reached_rad))


def test_a_curve_may_ask_for_what_tilt_and_thrust_leave() -> None:
    """A Crazyflie's tilt limit is the less of the two; one that is heavy for its rotors has less thrust."""
    settings = settings_for(vehicle_toml.preset("crazyflie"), exact=True)
    assert settings.height is not None
    most_m_s2 = FLOWN_SHARE * largest_acceleration_m_s2(settings)
    assert flown_acceleration_m_s2(settings) == most_m_s2
    weak = settings.model_copy(
        update={"height": settings.height.model_copy(update={"thrust_max_m_s2": 11.0})}
    )
    assert 0.0 < flown_acceleration_m_s2(weak) < 0.5 * most_m_s2
    none = settings.model_copy(update={"height": settings.height.model_copy(update={"thrust_max_m_s2": 9.9})})
    assert flown_acceleration_m_s2(none) == 0.0
