"""What fly.py watches in flight, the logs that it keeps, what the radio carries; and --simulate."""

import math
import re
import shutil
import tempfile
from functools import partial
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from mambo_codegen.settings.model import Settings
from mambo_sil.model.replay.log_replay import replay_log
from tests.extensions.crazyflie.support.radio import LOG_BYTES, Drone
from tests.extensions.crazyflie.support.scripts import SETTINGS, at_call, modules_of, run, without
from tests.support.bundles import write_target
from tests.support.height_settings import height_settings
from tests.support.one_norm import ONE_NORM
from tests.support.tools import require

LANDED, STOPPED = ["notify", "land", "stop", "close"], ["stop_setpoint", "notify", "stop", "close"]
BYTES = {"LOG_UINT8": 1, "LOG_UINT16": 2, "LOG_UINT32": 4, "LOG_FLOAT": 4}
TROUBLES: dict[str, tuple[dict[str, float], str, list[str]]] = {
    "position": ({"nmpc.lost": 1}, "The drone lands: no position is measured.\n", LANDED),
    "status": (
        {"nmpc.status": 3},
        "The drone lands: the controller refuses its inputs, nmpc.status = 3.\n",
        LANDED,
    ),
    "battery": ({"pm.state": 3, "pm.vbat": 3.1}, "The drone lands: the battery is low, 3.10 V.\n", LANDED),
    "tumbled": ({"supervisor.info": 32}, "The motors stop: the drone has tumbled or crashed.\n", STOPPED),
}


@pytest.mark.parametrize("name", TROUBLES)
@pytest.mark.parametrize("figure", [("eight",), ("circle", "--stream"), ("goto",)])
def test_trouble_in_flight_ends_it(
    figure: tuple[str, ...],
    name: str,
    scripts: dict[str, ModuleType],
    drone: Drone,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """At once, with a sentence, and the log is kept."""
    values, message, ending = TROUBLES[name]
    at_call(drone, "takeoff", 8.0, lambda: drone.logged.update(values))
    assert run(scripts, *figure) == 1
    assert capsys.readouterr().err == message
    assert drone.names()[-4:] == ending
    ended = drone.of("land" if ending == LANDED else "stop_setpoint")[0][0]
    assert ended - drone.of("takeoff")[0][0] == pytest.approx(8.3, abs=0.4)
    assert Path("flight.csv").is_file()


def test_one_refused_update_flies_on(scripts: dict[str, ModuleType], drone: Drone) -> None:
    """It takes 0.3 s of them."""
    bad, good = (
        (lambda: drone.logged.update({"nmpc.status": 2})),
        (lambda: drone.logged.update({"nmpc.status": 0})),
    )
    at_call(drone, "takeoff", 8.0, bad)
    at_call(drone, "takeoff", 8.1, good)
    assert run(scripts, "hover") == 0


def test_each_flight_has_a_log_of_its_own(
    scripts: dict[str, ModuleType], drone: Drone, capsys: pytest.CaptureFixture[str]
) -> None:
    """No file is written over."""
    Path("flight.csv").write_text("kept", "utf-8")
    for _ in range(2):
        assert run(scripts, "hover") == 0
        drone.blocks.clear()
    assert Path("flight.csv").read_text("utf-8") == "kept"
    assert Path("flight-2.csv").stat().st_size == pytest.approx(Path("flight-3.csv").stat().st_size, rel=0.05)
    assert "flight-3.csv: " in capsys.readouterr().out


def test_a_log_whose_folder_is_gone_goes_elsewhere(
    scripts: dict[str, ModuleType],
    drone: Drone,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The script says where; if there is no place at all, the log comes on the terminal."""
    spare, stick = tmp_path / "spare", tmp_path / "stick"
    spare.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(spare))
    monkeypatch.setenv("HOME", str(tmp_path / "nowhere"))
    for folder in (stick, spare):
        stick.mkdir()
        drone.calls.clear()
        drone.blocks.clear()
        at_call(
            drone,
            "takeoff",
            3.0,
            partial(shutil.rmtree, stick),
            partial(shutil.rmtree, folder, ignore_errors=True),
        )
        assert run(scripts, "hover", "--log", str(stick / "flight.csv")) == 0
        printed = capsys.readouterr()
        assert f"The log cannot be written to {stick / 'flight.csv'}: No such file" in printed.err
        if folder == stick:
            assert f"{spare / 'flight.csv'}: " in printed.out
        else:
            assert printed.out.startswith("Timestamp,nmpc.step,")


def test_a_figure_longer_than_a_battery_is_refused(
    scripts: dict[str, ModuleType], drone: Drone, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before anything is connected."""
    assert run(scripts, "circle", "--rate", "0.05", "--laps", "4") == 1
    assert "the flight takes 7" in capsys.readouterr().err
    assert not drone.calls


@pytest.mark.parametrize("settings", [height_settings(), ONE_NORM], ids=["height", "1-norm"])
def test_log_blocks_fit_the_radio(
    settings: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each a packet; at 2 and 1 Mbit/s every update is logged, at 250 kbit/s every second one."""
    folder = write_target("crazyflie", settings, tmp_path)
    radio = modules_of(folder, monkeypatch)["radio"]
    text = (folder / "src" / "nmpc_app_log.c").read_text("utf-8")
    kinds = {"stateEstimate.z": "LOG_FLOAT"}
    kinds |= {f"nmpc.{name}": kind for kind, name in re.findall(r"^LOG_ADD\((\w+), (\w+), ", text, re.M)}
    for names in radio.LOGGED:
        assert sum(BYTES[kinds[name]] for name in names) <= LOG_BYTES
    assert ("nmpc.targetKnown" in kinds) == (settings.controller.method == "quadratic")
    assert kinds.keys() >= {name for names in radio.LOGGED for name in names}
    count = len(radio.LOGGED)
    for rate, period_s in {"2M": 0.01, "1M": 0.01, "250K": 0.02}.items():
        uri = f"radio://0/80/{rate}/E7E7E7E7E7"
        found = radio.log_period_s(count, uri)
        assert math.isclose(found, period_s)
        assert count / found + 20.0 <= radio.packets_s(uri)


@pytest.mark.parametrize(
    "arguments", [("eight",), ("circle", "--stream"), ("goto", "--heading", "120"), ("hover",)]
)
def test_a_simulated_flight_makes_the_same_calls(
    arguments: tuple[str, ...], scripts: dict[str, ModuleType], capsys: pytest.CaptureFixture[str]
) -> None:
    """It follows what they ask for, with a hop before, lands, and leaves a log, in metres and radians."""
    assert run(scripts, *arguments, "--simulate", "--laps", "1") == 0
    printed = capsys.readouterr().out
    assert "simulated on crazyflie, sensors mocap: " in printed
    assert "it landed" in printed
    rows = np.genfromtxt("flight.csv", delimiter=",", names=True)
    for axis in "xy":
        error = rows[f"nmpctarget{axis.upper()}"] - rows[f"nmpc{axis}"]
        assert np.abs(error).max() < 0.02
    extent = {"eight": (0.99, 0.49), "circle": (0.99, 0.99), "goto": (0.99, 0.0), "hover": (0.15, 0.0)}[
        arguments[0]
    ]
    for axis, most in zip("xy", extent, strict=True):
        assert rows[f"nmpctarget{axis.upper()}"].max() == pytest.approx(most, abs=0.02)
    assert rows["stateEstimatez"].max() == pytest.approx(0.8, abs=0.05)
    assert rows["stateEstimatez"][-1] == pytest.approx(0.0, abs=0.02)
    if "--heading" in arguments:
        assert np.degrees(np.median(rows["nmpcinYaw"])) == pytest.approx(120.0, abs=1.0)


@pytest.mark.parametrize("name", ["flow-deck", "true"])
def test_a_simulated_flight_is_measured_by_the_sensors_that_are_named(
    name: str, scripts: dict[str, ModuleType], capsys: pytest.CaptureFixture[str]
) -> None:
    """Over a flow deck it drifts while the log says that it stands; an unknown name is one sentence."""
    assert run(scripts, "hover", "--simulate", "--sensors", name) == 0
    printed = capsys.readouterr().out
    off_cm = float(printed.split(" in the mean, ")[1].split(" cm")[0])
    assert f"simulated on crazyflie, sensors {name}: " in printed
    assert (off_cm > 3.0) == (name == "flow-deck")
    assert run(scripts, "hover", "--simulate", "--sensors", "gps") == 1
    assert 'No flight: sensors = "gps" must be "true" or "mocap"' in capsys.readouterr().err


def test_a_landing_that_comes_to_rest_is_no_other_flight(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the true state a drone on the floor has velocities of 0; `replay` goes by the count."""
    require("gcc", "gcc")
    settings = height_settings()
    monkeypatch.chdir(tmp_path)
    scripts = modules_of(write_target("crazyflie", settings, tmp_path), monkeypatch)
    assert run(scripts, "hover", "--simulate", "--sensors", "true", "--log", "log.csv") == 0
    replay = replay_log(Path("log.csv"), {}, settings)
    assert np.array_equal(replay.replayed_rad, replay.logged_rad)


def test_the_simulated_planner_moves_as_the_firmware_s(scripts: dict[str, ModuleType], folder: Path) -> None:
    """From rest to rest, a go_to in motion without a jump, and a set-point that is carried on."""
    flown = scripts["simulated_drone"].SimulatedDrone(folder, "crazyflie")
    flown.takeoff(1.0, 2.0, yaw=None)
    flown.wait(3.0)
    flown.go_to(2.0, -1.0, 1.0, 0.0, 4.0)
    flown.wait(2.0)
    flown.go_to(0.0, 0.0, 1.5, 0.0, 3.0)
    flown.wait(5.0)
    flown.send_full_state_setpoint(
        [1.0, 2.0, 1.5], [0.5, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], 0, 0, 0
    )
    flown.wait(0.1)
    flown = flown.planned
    assert flown.vertical([0.0, 1.0, 2.0])[1] == pytest.approx([0.5, 1.09375, 0.0])
    (before,), (after,) = flown.target([5.0 - 1e-6]), flown.target([5.0 + 1e-6])
    assert before == pytest.approx([1.0, 0.5, 1.09375, 0.546875], abs=1e-4)
    assert after == pytest.approx(before, abs=1e-4)
    assert flown.acceleration([5.0 + 1e-6])[0] == pytest.approx(flown.acceleration([5.0 - 1e-6])[0], abs=1e-3)
    assert flown.target([9.0])[0] == pytest.approx([0.0, 0.0, 0.0, 0.0], abs=1e-9)
    assert flown.target([10.1])[0] == pytest.approx([1.051, -2.0, 0.52, 0.0])


def test_without_mambo_nmpc_the_simulation_says_what_to_install(
    scripts: dict[str, ModuleType], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In one sentence; the other arguments need no mambo_nmpc."""
    without(monkeypatch, "mambo_nmpc")
    assert run(scripts, "hover", "--simulate") == 1
    assert capsys.readouterr().err.startswith("No flight: --simulate needs mambo-nmpc")


def test_a_simulation_of_other_settings_or_vehicles_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A controller.toml that was changed after generate; a vehicle that is not known."""
    folder = write_target("crazyflie", SETTINGS, tmp_path / "app")
    scripts = modules_of(folder, monkeypatch)
    assert run(scripts, "hover", "--simulate", "crazyfly") == 1
    assert "crazyfly" in capsys.readouterr().err
    settings = folder / "controller.toml"
    settings.write_text(settings.read_text("utf-8").replace("tilt_rad = 0.5", "tilt_rad = 0.4"), "utf-8")
    assert run(scripts, "hover", "--simulate") == 1
    assert "run mambo-nmpc generate again" in capsys.readouterr().err
