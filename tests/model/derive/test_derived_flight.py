"""The flight that `design` judges: calm settings, and a drone that falls, is far off or oscillates."""

import re

import pytest

from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles import VEHICLES, vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.model.derive.derived_flight import fly_derived
from mambo_sil.model.derive.derived_settings import controller_text


def settings_for(drone: VehicleFile) -> Settings:
    """Return the settings in the file that is written for a drone."""
    return controller_toml.parse(controller_text(drone, drone.name), drone.name)


def delivering(gain: float) -> VehicleFile:
    """Return a drone whose thrust is `gain` times the demanded one; it can demand ten times its weight."""
    text = VEHICLES.text("crazyflie-flown").replace("thrust_max_n = 0.575", "thrust_max_n = 3.0")
    return vehicle_toml.parse(f"{text}\n[thrust]\ngain = {gain}\nlag_s = 0.1\n", "mine", "mine.toml")


@pytest.mark.parametrize(
    ("learnt", "words"),
    [
        ("gain", "stays at its target"),
        ("none", "FAR OFF, "),
    ],
)
def test_a_drone_that_delivers_too_little_is_seen(learnt: str, words: str) -> None:
    """0.8 of the expected thrust: settings that learn it hold their place, others fly lower."""
    settings = with_option(settings_for(delivering(1.0)), "height.learn", learnt)
    found = fly_derived(settings, delivering(0.8))
    assert found.good is (learnt == "gain")
    assert found.words.startswith(f"flown for 10 s: {words}")
    assert found.words.endswith("(through sensors mocap)")


def test_a_drone_that_falls_is_seen() -> None:
    """A fifth of the expected thrust is less than can be learnt."""
    found = fly_derived(settings_for(delivering(1.0)), delivering(0.2))
    assert not found.good
    assert re.match(r"flown for 10 s: CRASHES after \d\.\d+ s, on the ground", found.words)
    assert fly_derived(settings_for(delivering(0.2)), delivering(0.2)).good


def test_a_drone_that_oscillates_is_seen() -> None:
    """A Mambo with motors of 0.06 s, through its sensors."""
    text = re.sub(r"(?m)^lag_s = .*", "lag_s = 0.06", VEHICLES.text("mambo"))
    drone = vehicle_toml.parse(text, "slow", "slow.toml")
    found = fly_derived(settings_for(drone), drone)
    assert not found.good
    assert found.words.startswith("flown for 10 s: OSCILLATES, by 0.")
