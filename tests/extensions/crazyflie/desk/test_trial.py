"""The flights of an app on the desk by which `design` judges its settings."""

import pytest

from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_codegen.toolchain import host_toolchain
from mambo_extensions.crazyflie.desk import desk_library
from mambo_extensions.crazyflie.desk.desk_events import fly_events, measure
from mambo_extensions.crazyflie.desk.desk_trial import FLIGHTS, fly_trial
from mambo_extensions.crazyflie.desk.events_file import EventsFile
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from tests.support.derived import settings_for
from tests.support.scenarios import changed

CRAZYFLIE = vehicle_toml.preset("crazyflie")


def late(delay_s: float) -> VehicleFile:
    """Return a Crazyflie whose cameras are late."""
    return changed(CRAZYFLIE, sensors={"position_delay_s": delay_s})


def aged(age_s: float) -> Settings:
    """Return the settings that `design crazyflie` writes, with another age of the state."""
    return with_option(settings_for(CRAZYFLIE), "observer.measurement_age_s", age_s, "age_s")


def test_the_settings_of_a_crazyflie_are_calm() -> None:
    """At the delay of its cameras, and at half of it."""
    found = fly_trial(settings_for(CRAZYFLIE), CRAZYFLIE)
    assert found.good
    words = "flown on the desk, cameras 10 and 5 ms late: hover and eight are calm, at most "
    assert found.words.startswith(words)


@pytest.mark.long
def test_an_age_that_margins_allow_and_that_shakes_the_drone_is_seen() -> None:
    """With 35 ms its loops tolerate 2.7 times the gain, in the simulation; the app shakes."""
    found = fly_trial(aged(0.035), late(0.035))
    assert not found.good
    assert found.words.startswith("flown on the desk, cameras 35 ms late: hover SHAKES, by commands of 0.")


@pytest.mark.long
def test_late_cameras_are_worth_their_age_up_to_20_ms() -> None:
    """An eight is flown 1.3 times closer than with the age of the default, and calmly."""
    drone = late(0.04)
    settings = settings_for(drone)
    assert settings.observer.measurement_age_s == 0.02
    assert fly_trial(settings, drone).good
    assert not fly_trial(settings, late(0.15)).good
    cameras = FLIGHTS["eight"].sensors.model_copy(update={"camera_delay_ms": 40})
    eight = FLIGHTS["eight"].model_copy(update={"sensors": cameras})
    late_m_s, default_m_s = (iae_m_s(one, eight) for one in (settings, settings_for(CRAZYFLIE)))
    assert 1.3 * late_m_s < default_m_s


@pytest.mark.long
def test_that_age_leaves_half_of_the_gain() -> None:
    """A drone whose tilt answers with 1.5 times the gain of the file is calm."""
    settings = settings_for(late(0.025))
    gains = {"roll_gain": settings.model.roll_gain / 1.5, "pitch_gain": settings.model.pitch_gain / 1.5}
    model = settings.model.model_copy(update=gains)
    limits = settings.limits.model_copy(update={"braking_m_s2": 1.5})
    strong = settings.model_copy(update={"model": model, "limits": limits})
    assert fly_trial(strong, late(0.025)).good
    older = strong.observer.model_copy(update={"measurement_age_s": 0.0225})
    assert not fly_trial(strong.model_copy(update={"observer": older}), late(0.025)).good


@pytest.mark.long
def test_a_flow_deck_is_judged_by_its_height() -> None:
    """It does not measure where the drone is."""
    drone = CRAZYFLIE.with_sensors("flow-deck")
    found = fly_trial(settings_for(drone), drone)
    assert found.good
    assert found.words.startswith("flown on the desk through a flow deck: hover and eight are calm, at most ")
    assert found.words.endswith(" mm in height")


def test_settings_without_an_app_are_not_refused() -> None:
    """The firmware calls every millisecond; a program may call with any period."""
    settings = with_option(settings_for(CRAZYFLIE), "horizon.update_period_s", 0.0125)
    found = fly_trial(settings, CRAZYFLIE)
    assert found.good
    assert found.words.startswith("not flown on the desk: ")
    assert "update_period_s" in found.words


def iae_m_s(settings: Settings, flight: EventsFile) -> float:
    """Return the IAE of an app's flight."""
    library = desk_library.build(settings, host_toolchain())
    return measure(fly_events(library, flight), flight)["iae_60_s_m_s"]
