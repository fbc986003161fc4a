"""The apps that fly on the desk."""

from pathlib import Path

import pytest

from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import parse
from mambo_codegen.toolchain import host_toolchain
from mambo_sil.board.desk import desk_library
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.model.derive.derived_settings import controller_text


@pytest.fixture(scope="session")
def app() -> Path:
    """Return the library of the app with the settings that `design crazyflie` writes."""
    text = controller_text(vehicle_toml.load("crazyflie"), "crazyflie")
    return desk_library.build(parse(text, "controller.toml"), host_toolchain())


@pytest.fixture(scope="session")
def preset_app() -> Path:
    """Return the library of the app with preset crazyflie, which leaves the height to the firmware."""
    return desk_library.build(presets.preset("crazyflie"), host_toolchain())
