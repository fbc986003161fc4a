"""fly.py --simulate: the calls of the Crazyflie's script to a simulated drone."""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from tests.support.bundles import write_target
from tests.support.scripts import SETTINGS, modules_of, run, without


@pytest.mark.parametrize(
    "arguments", [("eight",), ("circle", "--stream"), ("goto", "--heading", "120"), ("hover",)]
)
def test_a_simulated_flight_makes_the_same_calls(
    arguments: tuple[str, ...], scripts: dict[str, ModuleType], capsys: pytest.CaptureFixture[str]
) -> None:
    """It follows what they ask for, with a hop before, lands, and leaves a log, in metres and radians."""
    assert run(scripts, *arguments, "--simulate", "--laps", "1") == 0
    printed = capsys.readouterr().out
    assert "simulated on crazyflie through motion capture" in printed
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
