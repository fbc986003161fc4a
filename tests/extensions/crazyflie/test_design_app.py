"""`design` flies the app of a Crazyflie on the desk, and says how."""

from pathlib import Path

import pytest

from tests.support.command import run, unwrapped

DRONE = """\
[body]
mass_kg = 0.1
drag_1_s = 0.1

[attitude]
kind = "first_order"
acceleration_per_tilt_g = 0.95
roll = { gain = 0.4, lag_s = 0.1, dead_time_s = 0.05 }
pitch = { gain = 0.4, lag_s = 0.1, dead_time_s = 0.05 }
"""
CAMERAS = """
[sensors]
kind = "mocap"
position_noise_m = 0.001
position_delay_s = 0.03
velocity_filter_s = 0.03
attitude_noise_rad = 0.003
estimator = "crazyflie"
"""

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


@pytest.mark.long
def test_the_flight_of_the_app_is_the_verdict() -> None:
    """A Crazyflie whose tilt answers by a half of what its file says flies here, and shakes on the desk."""
    Path("mine.toml").write_text(DRONE + CAMERAS, "utf-8")
    _, said = run("design", "mine.toml", code=1)
    assert "flown for 10 s: stays at its target (through sensors mocap)\n" in said
    assert "flown on the desk, cameras 30 ms late: hover SHAKES, by commands of 0." in unwrapped(said)


@pytest.mark.long
def test_a_good_flight_of_the_app_is_told_too() -> None:
    """Behind the flights of the drone."""
    assert "flown on the desk" in unwrapped(run("design", "crazyflie-flown", "--firm")[1])


def test_without_a_compiler_the_app_is_not_flown_either(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And it says so."""
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    _, said = run("design", "crazyflie-flown")
    assert "neither flown here nor on the desk, nor margins: no C compiler found" in unwrapped(said)
