"""The hop of fly.py: it finds a wrong heading on the desk, and no right one, whatever wind and sensors."""

import itertools
import math
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.toolchain import host_toolchain
from mambo_extensions.crazyflie.desk import desk_library
from mambo_extensions.crazyflie.desk.desk_flight import Desk, DeskConditions, DeskSensors
from tests.extensions.crazyflie.support.scripts import (
    SETTINGS,
    DeskDrone,
    at_call,
    largest_m,
    ready_on_desk,
    run,
)

GOTO = ("goto", "--size", "0.5")
CONDITIONS: dict[str, dict[str, Any]] = {
    "still air": {},
    "wind": {"wind_m_s": (1.4, -1.4)},
    "noisy cameras": {"camera_noise_m": 0.005},
    "slow cameras": {"camera_period_ms": 33, "camera_delay_ms": 40},
    "biases": {
        "accelerometer_bias_g": (0.02, -0.02, 0.02),
        "gyroscope_bias_rad_s": (0.01, -0.01, 0.01),
    },
    "36 g": {"mass_kg": 0.036, "thrust_gain": 0.9},
}

QUIET = ("still air", "noisy cameras", "36 g")


@pytest.fixture(scope="module")
def app() -> Path:
    """Return the library of the app with preset crazyflie, whose scripts the tests run."""
    return desk_library.build(SETTINGS, host_toolchain())


@pytest.fixture(scope="module")
def flow_app() -> Path:
    """Return the library of that app with an observer for a flow deck."""
    return desk_library.build(with_option(SETTINGS, "observer.position_noise", 0.04), host_toolchain())


def fly(
    app: Path,
    scripts: dict[str, ModuleType],
    patch: pytest.MonkeyPatch,
    conditions: DeskConditions,
    *arguments: str,
) -> tuple[DeskDrone, int]:
    """Fly fly.py's goto on the desk; return drone and exit code."""
    desk = Desk(app, conditions)
    desk.run(1500)
    drone = ready_on_desk(scripts, patch, desk)
    return drone, run(scripts, *GOTO, *arguments)


@pytest.mark.first_is_quick
@pytest.mark.parametrize("case", list(itertools.product((30.0, -30.0), CONDITIONS)), ids=str)
def test_thirty_degrees_are_found_and_landed(
    case: tuple[float, str],
    app: Path,
    scripts: dict[str, ModuleType],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Before the figure; the sentence says the side, and roughly the angle.

    In still air with quick sensors, it stays within 0.1 m of the target until then, else within 0.2 m,
    of which wind and biases take 0.08 m with a right heading, too.
    """
    heading_deg, name = case
    conditions = DeskConditions(
        seed=4, camera_offset_ms=2, heading_rad=math.radians(heading_deg), **CONDITIONS[name]
    )
    drone, code = fly(app, scripts, monkeypatch, conditions)
    error = capsys.readouterr().err
    assert code == 1
    found = re.search(
        r"^The drone lands: its nose points about (\d+) degrees further to the (\w+) than", error
    )
    assert found is not None
    assert found[2] == ("left" if heading_deg > 0.0 else "right")
    assert float(found[1]) == pytest.approx(30.0, abs=15.0)
    assert "--start-heading" in error
    assert len(drone.of("go_to")) == 1
    assert max(drone.off_m[: drone.hopped]) < (0.1 if name in QUIET else 0.2)
    assert largest_m(drone) < 0.3
    assert drone.desk is not None
    assert drone.desk.state.position_m[2] < 0.02


@pytest.mark.first_is_quick
@pytest.mark.parametrize("heading_deg", [90.0, -60.0, 180.0])
def test_a_heading_that_is_far_off_ends_low_above_the_floor(
    heading_deg: float,
    app: Path,
    scripts: dict[str, ModuleType],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """By the hop, or since it strays, which stops the motors."""
    conditions = DeskConditions(seed=5, camera_offset_ms=7, heading_rad=math.radians(heading_deg))
    drone, code = fly(app, scripts, monkeypatch, conditions)
    assert code == 1
    assert re.match("The (drone lands: its nose|motors stop: it strays)", capsys.readouterr().err)
    assert len(drone.of("go_to")) <= 1
    assert largest_m(drone) < 1.5


@pytest.mark.first_is_quick
@pytest.mark.parametrize("name", CONDITIONS)
@pytest.mark.parametrize("heading_deg", [0.0, 10.0])
def test_a_heading_that_is_right_flies_on(
    heading_deg: float,
    name: str,
    app: Path,
    scripts: dict[str, ModuleType],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """To ten degrees, which no hover minds."""
    conditions = DeskConditions(
        seed=6, camera_offset_ms=5, heading_rad=math.radians(heading_deg), **CONDITIONS[name]
    )
    drone, code = fly(app, scripts, monkeypatch, conditions)
    assert code == 0
    assert len(drone.of("go_to")) == 4


def test_any_heading_flies_on_over_a_flow_deck(
    flow_app: Path, scripts: dict[str, ModuleType], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Which measures along the drone: a wrong heading turns the course, and does no other harm."""
    conditions = DeskConditions(
        seed=6, camera_offset_ms=5, heading_rad=math.radians(90.0), sensors=DeskSensors.FLOW_DECK
    )
    drone, code = fly(flow_app, scripts, monkeypatch, conditions)
    assert code == 0
    assert len(drone.of("go_to")) == 4


def test_a_start_heading_is_told_to_the_filter(
    app: Path, scripts: dict[str, ModuleType], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before it is reset; a drone that was set down at 90 degrees then flies as any other."""
    right_angle = 0.5 * math.pi
    conditions = DeskConditions(camera_offset_ms=3, heading_rad=right_angle, initial_yaw_rad=right_angle)
    drone, code = fly(app, scripts, monkeypatch, conditions, "--start-heading", "90")
    assert code == 0
    assert largest_m(drone) < 0.1
    told = [arguments[0] for _, arguments in drone.of("set_value")]
    assert told.index("kalman.initialYaw") < told.index("kalman.resetEstimation")
    assert drone.parameters["kalman.initialYaw"] == pytest.approx(right_angle)


def test_a_position_that_is_lost_in_flight_lands_softly(
    app: Path,
    scripts: dict[str, ModuleType],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The app descends by itself; the landing of the script does not stop its motors above the floor."""
    desk = Desk(app, DeskConditions(camera_offset_ms=3))
    desk.run(1500)
    drone = ready_on_desk(scripts, monkeypatch, desk)
    at_call(drone, "go_to", 4.0, lambda: desk.measure(on=False))
    assert run(scripts, *GOTO) == 1
    assert capsys.readouterr().err == "The drone lands: no position is measured.\n"
    assert desk.state.position_m[2] < 0.02
    assert desk.state.touch_m_s < 1.2


def test_too_few_logs_are_no_agreement(scripts: dict[str, ModuleType]) -> None:
    """Nor are those of another time."""
    names = scripts["heading"].POSE
    rows = {10 * k: dict.fromkeys(names, 0.0) for k in range(200)}
    assert scripts["heading"].heading_error(rows, 1.5) == 0.0
    assert math.isnan(scripts["heading"].heading_error(rows, 0.2))
    assert math.isnan(scripts["heading"].heading_error({}, 1.5))
    assert np.isnan(scripts["heading"].heading_error({0: {names[0]: 1.0}}, 1.5))
