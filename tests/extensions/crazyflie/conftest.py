"""The Crazyflie's app and its scripts, generated once."""

from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Final

import pytest

from tests.extensions.crazyflie.support.crazyflie import Built, Crazyflie, build
from tests.extensions.crazyflie.support.radio import Drone
from tests.extensions.crazyflie.support.scripts import SETTINGS, modules_of, ready
from tests.support.bundles import write_target

collect_ignore: Final = [] if find_spec("mambo_extensions.plan") else ["test_crazyflie_laps.py"]
"""The laps that the scripts upload are those of the extension `plan`."""


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    """Return the app for preset crazyflie, compiled."""
    return build(write_target("crazyflie", SETTINGS, tmp_path_factory.mktemp("crazyflie")))


@pytest.fixture
def app(built: Built) -> Crazyflie:
    """Return a drone with the app, whose set-points are positions."""
    found = built.app()
    found.modes("modeAbs")
    return found


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the target."""
    return write_target("crazyflie", SETTINGS, tmp_path_factory.mktemp("app"))


@pytest.fixture
def scripts(folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> dict[str, ModuleType]:
    """Return the modules of the folder, imported anew, in an empty working folder."""
    monkeypatch.chdir(tmp_path)
    return modules_of(folder, monkeypatch)


@pytest.fixture
def drone(scripts: dict[str, ModuleType], monkeypatch: pytest.MonkeyPatch) -> Drone:
    """Return a drone that is ready to fly, and put it and its clock under the scripts."""
    return ready(scripts, monkeypatch)
