"""The apps that fly on the desk."""

from pathlib import Path

import pytest

from mambo_codegen.settings import presets
from mambo_codegen.toolchain import host_toolchain
from mambo_extensions.crazyflie.desk import desk_library
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import FlowDeckSensors
from tests.support.derived import settings_for


@pytest.fixture(scope="session")
def app() -> Path:
    """Return the library of the app with the settings that `design crazyflie` writes."""
    return built(vehicle_toml.load("crazyflie"))


@pytest.fixture(scope="session")
def flow_app() -> Path:
    """Return the library of the app with the settings that `design crazyflie --sensors flow-deck` writes."""
    return built(vehicle_toml.load("crazyflie").model_copy(update={"sensors": FlowDeckSensors()}))


def built(drone: VehicleFile) -> Path:
    """Return the library of the app with derived settings."""
    return desk_library.build(settings_for(drone, exact=True), host_toolchain())


@pytest.fixture(scope="session")
def preset_app() -> Path:
    """Return the library of the app with preset crazyflie, which leaves the height to the firmware."""
    return desk_library.build(presets.preset("crazyflie"), host_toolchain())
