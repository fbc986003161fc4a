"""The script that flies a Crazyflie from the desk: its calls to cflib, and its flights through a radio."""

import math
import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from mambo_codegen.settings.controller_toml import parse
from mambo_codegen.settings.model import Settings
from mambo_nmpc import Controller
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.model.derive.derived_settings import controller_text
from tests.extensions.crazyflie.support.offboard import Flown, Radio, fly_offboard
from tests.extensions.crazyflie.support.radio import ARMED, CAN_FLY, Clock, Drone, install
from tests.extensions.crazyflie.support.scripts import SETTINGS, interrupt, modules_of, without
from tests.support.bundles import write_target
from tests.support.height_settings import height_settings

PREPARED, STOPPED = ["set_value"], ["stop_setpoint", "notify", "close"]
PAGE = Path(__file__).parents[3] / "docs" / "how-to" / "offboard.md"
STATE = {"x": 1.0, "y": -0.5, "z": 0.1, "vx": 0.0, "vy": 0.0, "roll": 0.0, "pitch": 0.0, "yaw": 0.0}


@pytest.fixture
def drone() -> Drone:
    """Return a drone at rest."""
    logged = {f"stateEstimate.{name}": value for name, value in STATE.items()}
    logged |= dict.fromkeys(("kalman.varPX", "kalman.varPY", "kalman.varPZ", "kalman.varX"), 1e-4)
    logged |= {"supervisor.info": ARMED | CAN_FLY, "pm.vbat": 4.0, "pm.state": 0}
    parameters = {"stabilizer.estimator": 2, "kalman.resetEstimation": 0, "kalman.initialYaw": 0.0}
    return Drone(Clock(), logged, parameters)


@pytest.fixture
def script(folder: Path, drone: Drone, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Return the script, with the drone behind cflib and its clock."""
    return imported(folder, drone, monkeypatch)


def imported(folder: Path, drone: Drone, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Import the script of a folder."""
    install(drone, monkeypatch)
    scripts = modules_of(folder, monkeypatch)
    for name in ("offboard", "radio"):
        monkeypatch.setattr(scripts[name], "time", drone.clock)
    monkeypatch.setattr(sys, "argv", ["offboard.py", "radio://0/80/2M/E7E7E7E7E7"])
    return scripts["offboard"]


def test_it_sends_angles_and_height_a_hundred_times_a_second(
    script: ModuleType, drone: Drone, capsys: pytest.CaptureFixture[str]
) -> None:
    """From the floor up, along the circle, and down; then the motors stop."""
    script.main()
    assert capsys.readouterr().out == "landed\n"
    assert drone.names() == [*PREPARED, "zdistance", *STOPPED]
    sent = drone.of("zdistance")
    times_s = [time_s for time_s, _ in sent]
    assert np.diff(times_s) == pytest.approx(0.01, abs=1e-6)
    heights = np.array([arguments[3] for _, arguments in sent])
    assert (heights[0], heights.max(), heights[-1]) == pytest.approx((0.1, 0.9, 0.1))
    assert np.abs(np.diff(heights)).max() < 0.005
    tilts = np.array([arguments[:2] for _, arguments in sent])
    assert 1.0 < np.abs(tilts).max() <= math.degrees(SETTINGS.limits.tilt_rad) + 1e-4
    assert {arguments[2] for _, arguments in sent} == {0.0}


def derived() -> Settings:
    """Return settings as by `design`, with the exact tilt."""
    return parse(controller_text(vehicle_toml.preset("crazyflie"), "x", exact_share=0.7), "controller.toml")


@pytest.mark.parametrize("settings", [height_settings, derived])
def test_with_a_height_in_the_settings_the_stock_firmware_flies_it(
    settings: Callable[[], Settings],
    drone: Drone,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The script sends the same kind of set-points."""
    own = settings()
    imported(write_target("crazyflie", own, tmp_path), drone, monkeypatch).main()
    assert capsys.readouterr().out == "landed\n"
    assert drone.names() == [*PREPARED, "zdistance", *STOPPED]
    tilts = np.array([arguments[:2] for _, arguments in drone.of("zdistance")])
    limit_rad = 0.35 if own.model.tilt == "exact" else own.limits.tilt_rad
    assert 1.0 < np.abs(tilts).max() <= math.degrees(limit_rad) + 1e-4


def test_ctrl_c_descends_where_it_is(script: ModuleType, drone: Drone) -> None:
    """Within the time of a climb."""
    drone.clock.events.append((9.0, interrupt))
    script.main()
    sent = drone.of("zdistance")
    assert sent[-1][0] == pytest.approx(9.0 + script.CLIMB_S + 0.5, abs=0.1)
    assert sent[-1][1][3] == pytest.approx(0.1)


def test_a_second_ctrl_c_stops_the_motors(script: ModuleType, drone: Drone) -> None:
    """At once."""
    drone.clock.events.extend([(9.0, interrupt), (9.4, interrupt)])
    script.main()
    assert drone.names() == [*PREPARED, "zdistance", *STOPPED]
    assert drone.of("stop_setpoint")[0][0] == pytest.approx(9.4, abs=0.02)


TROUBLES: dict[str, tuple[str, float, str, list[str]]] = {
    "battery": ("pm.state", 3, "The drone lands: the battery is low, 4.00 V.", ["notify", "land", "stop"]),
    "tumbled": ("supervisor.info", 32, "The motors stop: the drone has tumbled", []),
}


@pytest.mark.parametrize("name", TROUBLES)
def test_it_watches_battery_and_supervisor_in_flight(
    name: str, script: ModuleType, drone: Drone, capsys: pytest.CaptureFixture[str]
) -> None:
    """It says why, and hands over to the firmware's landing, or stops the motors."""
    variable, value, message, ending = TROUBLES[name]
    drone.clock.events.append((9.0, lambda: drone.logged.update({variable: value})))
    with pytest.raises(SystemExit, match="1"):
        script.main()
    assert capsys.readouterr().err.startswith(message)
    names = drone.names()
    ends = names[names.index("zdistance") + 1 :]
    assert ends[: len(ending)] == ending
    assert ("land" in ends) == bool(ending)
    assert ends[-3:] == STOPPED


def test_an_error_in_flight_lands(script: ModuleType, drone: Drone, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the firmware, in the time of a climb, and only then the motors stop."""

    def fail(*_: object) -> None:
        raise ZeroDivisionError

    drone.clock.events.append((9.0, lambda: monkeypatch.setattr(script, "position", fail)))
    with pytest.raises(ZeroDivisionError):
        script.main()
    ((landing, arguments),) = drone.of("land")
    assert arguments == (0.1, script.CLIMB_S, None)
    assert drone.of("stop_setpoint")[0][0] - landing == pytest.approx(script.CLIMB_S + 1.0, abs=0.1)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"pm.vbat": 3.5}, "the battery has 3.50 V"),
        ({"supervisor.info": 64}, "the supervisor has locked the drone"),
        ({"stateEstimate.x": math.nan, "kalman.varPX": math.nan}, "the Kalman filter finds no position"),
    ],
)
def test_a_drone_that_is_not_ready_stays_on_the_ground(
    changed: dict[str, float], message: str, script: ModuleType, drone: Drone
) -> None:
    """Battery, supervisor and filter are checked as fly.py does."""
    drone.logged.update(changed)
    with pytest.raises(SystemExit, match=rf"^No flight: {message}"):
        script.main()
    assert not drone.of("zdistance")


def test_a_drone_that_sends_nothing_does_not_fly(script: ModuleType, drone: Drone) -> None:
    """It says so."""
    drone.clock.sleeping.clear()
    with pytest.raises(SystemExit, match="No flight: the drone sends no logs"):
        script.main()
    assert not drone.of("zdistance")


@pytest.mark.parametrize(("package", "end"), [("cflib", "cflib"), ("mambo_nmpc", r"\.")])
def test_without_a_package_it_says_what_to_install(
    package: str, end: str, script: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In one sentence."""
    without(monkeypatch, package)
    with pytest.raises(SystemExit, match=rf"^No flight: .*pip install {end}\.$"):
        script.main()


def test_the_state_of_the_radio_s_log_is_read_in_the_order_of_its_names(
    script: ModuleType, drone: Drone
) -> None:
    """With the time at which it came; one block of no more bytes than a packet takes."""
    drone.logged.update({f"stateEstimate.{name}": float(k) for k, name in enumerate(script.NAMES)})
    drone.is_open = True
    newest = script.state_of_radio(sys.modules["cflib.crazyflie"].Crazyflie(rw_cache="./cache"))
    drone.clock.sleep(3.0)
    assert newest() == ([float(k) for k in range(8)], 3.0)


RADIOS = {
    ("10 ms", "0"): Radio(0.01, 0.01),
    ("10 ms", "50 %"): Radio(0.01, 0.01, 0.5),
    ("80 ms", "0"): Radio(0.08, 0.08),
}
"""Three of the radios of the page's table, by its first two columns."""


def flown(script: ModuleType, radio: Radio, source: Callable[..., Any] | None = None) -> Flown:
    """Fly the script on our plant."""
    return fly_offboard(script, Controller(SETTINGS), radio, source)


@pytest.mark.long
def test_it_flies_the_circle_through_a_radio_with_losses(script: ModuleType) -> None:
    """A short flight: within 2 cm at a delay of 10 ms each way, every tenth packet lost."""
    vars(script).update({"FLIGHT_S": 3.0, "CLIMB_S": 1.0})
    found = flown(script, Radio(0.01, 0.01, 0.1))
    assert found.end == "landed"
    assert found.error_m[found.time_s < 4.0].max() < 0.02


@pytest.mark.long
@pytest.mark.parametrize("row", RADIOS)
def test_delays_and_losses_cost_what_the_page_says(row: tuple[str, str], script: ModuleType) -> None:
    """The loop stands a delay of 142 ms; beyond it swings up."""
    cells = re.search(rf"\| {row[0]} \| {row[1]} \| (\S+) \| (\S+) \|", PAGE.read_text("utf-8"))
    assert cells is not None
    vars(script)["FLIGHT_S"] = 15.0
    found = flown(script, RADIOS[row])
    circle_cm = 100.0 * found.error_m[(found.time_s > 7.0) & (found.time_s < 17.0)]
    assert found.end == "landed"
    told_cm = (float(cells[1]), float(cells[2]))
    assert (circle_cm.mean(), circle_cm.max()) == pytest.approx(told_cm, rel=0.06, abs=0.05)


@pytest.mark.long
def test_nothing_is_sent_while_the_state_is_old(script: ModuleType) -> None:
    """From 0.1 s on; the drone levels out meanwhile, and flies on when the state comes back."""
    vars(script).update({"FLIGHT_S": 4.0, "CLIMB_S": 1.0})
    found = flown(script, Radio(0.01, 0.01, silent_s=(4.0, 5.0)))
    assert found.end == "landed"
    times_s = np.array([time_s for time_s, _ in found.sent])
    (gap,) = np.flatnonzero(np.diff(times_s) > 0.05)
    assert times_s[gap : gap + 2] == pytest.approx([4.1, 5.0], abs=0.03)
    assert found.error_m[found.time_s < 5.0].max() < 0.12


@pytest.mark.long
def test_it_ends_when_the_state_stays_away(script: ModuleType) -> None:
    """After 2 s, when the firmware has stopped the motors."""
    vars(script).update({"FLIGHT_S": 3.0, "CLIMB_S": 1.0})
    found = flown(script, Radio(silent_s=(2.5, math.inf)))
    assert found.end == "no state for 2 s: the firmware has stopped the motors"
    assert found.sent[-1][0] == pytest.approx(2.6, abs=0.03)


@pytest.mark.long
def test_the_page_s_motion_capture_flies_as_well(script: ModuleType) -> None:
    """Its function makes velocities of positions."""
    block = re.search(r'```python title="mocap.py"\n(.*?)```', PAGE.read_text("utf-8"), re.DOTALL)
    assert block is not None
    names: dict[str, Any] = {}
    exec(block[1], names)
    vars(script).update({"FLIGHT_S": 3.0, "CLIMB_S": 1.0})
    found = flown(script, Radio(0.0, 0.01), names["state_of_mocap"])
    assert found.end == "landed"
    assert found.error_m[found.time_s < 4.0].max() < 0.02
