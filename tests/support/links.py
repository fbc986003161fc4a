"""A drone with an autopilot, and controllers for it."""

from functools import lru_cache
from pathlib import Path

from mambo_sil.api.api_controller import Controller
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.model.derive.derived_settings import controller_text
from tests.support.derived import settings_for

DRONE = """
[body]
mass_kg = 1.0
drag_1_s = 0.5
[attitude]
kind = "first_order"
rate_hz = 100
roll = { gain = 1.0, lag_s = 0.12, dead_time_s = 0.04 }
pitch = { gain = 1.0, lag_s = 0.12, dead_time_s = 0.04 }
[thrust]
gain = 1.0
lag_s = 0.05
dead_time_s = 0.01
"""
"""A drone of 1 kg whose ticks are the periods of the controller, so that flights are quick."""


@lru_cache
def drone() -> VehicleFile:
    """Return the drone."""
    return vehicle_toml.parse(DRONE, "drone", "drone.toml")


def write_drone(folder: Path) -> None:
    """Write drone.toml, and the controller.toml that `design` derives from it."""
    (folder / "drone.toml").write_text(DRONE, "utf-8")
    (folder / "controller.toml").write_text(controller_text(drone(), "drone.toml"), "utf-8")


def controller(vehicle: VehicleFile | None = None) -> Controller:
    """Return a new controller with the settings that `design` derives for a drone, or that of these tests."""
    return Controller(settings_for(vehicle or drone()))
