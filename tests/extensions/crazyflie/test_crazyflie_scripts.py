"""The scripts of the Crazyflie's app: their calls to cflib, what they refuse, what they fly in simulation."""

import itertools
import math
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from mambo_codegen.settings.controller_toml import with_option
from tests.extensions.crazyflie.support.radio import ARMED, CAN_FLY, FLYING, Drone
from tests.extensions.crazyflie.support.scripts import (
    PLACE,
    SETTINGS,
    at_call,
    change_values,
    evaluate,
    interrupt,
    modules_of,
    run,
    uploaded,
    without,
)
from tests.support.bundles import write_target

PREPARED = ["set_value", "stop"]
LANDED = ["notify", "land", "stop", "close"]


@pytest.mark.parametrize("figure", ["hover", "eight", "circle"])
def test_a_figure_is_uploaded_and_flown_by_the_high_level_commander(
    figure: str, scripts: dict[str, ModuleType], drone: Drone
) -> None:
    """Nothing is sent in flight; it takes off at the heading it has, and lands when the figure has ended."""
    assert run(scripts, figure, "--height", "0.6") == 0
    flown = ["upload", "define_trajectory", "takeoff", "go_to", "start_trajectory"]
    assert drone.names() == [*PREPARED, *flown, *LANDED]
    assert drone.of("takeoff")[0][1] == (pytest.approx(0.4), 1.5, None)
    assert drone.of("go_to")[0][1] == pytest.approx((1.15, -0.5, 0.4, math.radians(30.0), 1.5))
    assert drone.of("go_to")[1][1] == pytest.approx((1.0, -0.5, 0.7, math.radians(30.0), 2.0))
    pieces = uploaded(drone)
    assert drone.of("define_trajectory")[0][1] == (1, 0, len(pieces))
    (begun, _), (landing, (floor, *_)) = drone.of("start_trajectory")[0], drone.of("land")[0]
    assert landing - begun == pytest.approx(pieces[:, 32].sum(), abs=0.1)
    assert floor == PLACE[2]
    assert (drone.parameters["stabilizer.controller"], drone.parameters["nmpc.on"]) == (0, 1)


@pytest.mark.parametrize("laps", [1, 4])
def test_the_uploaded_eight_is_an_eight(laps: int, scripts: dict[str, ModuleType], drone: Drone) -> None:
    """At full size within 0.2 mm; smooth up to the third derivative; it ends at rest on the floor."""
    assert (
        run(scripts, "eight", "--size", "0.9", "--rate", "0.7", "--laps", str(laps), "--heading", "-90") == 0
    )
    pieces, lap_s = uploaded(drone), 2.0 * math.pi / 0.7
    for time_s in np.linspace(lap_s, (1 + laps) * lap_s, 50):
        expected = (
            *(1.0 + 0.9 * math.sin(0.7 * time_s), -0.5 + 0.45 * math.sin(1.4 * time_s)),
            *(0.9, -0.5 * math.pi),
        )
        assert evaluate(pieces, time_s) == pytest.approx(expected, abs=2e-4)
    for end_s in np.cumsum(pieces[:-1, 32]):
        for order, tolerance in ((0, 1e-5), (1, 1e-4), (2, 1e-3), (3, 1e-2)):
            before, after = evaluate(pieces, end_s - 1e-6, order), evaluate(pieces, end_s + 1e-6, order)
            assert after == pytest.approx(before, abs=tolerance)
    end_s = float(pieces[:, 32].sum())
    assert evaluate(pieces, end_s)[:3] == pytest.approx(PLACE, abs=1e-5)
    assert np.abs(evaluate(pieces, end_s, 1)).max() < 1e-4


def test_goto_goes_along_x_and_back(scripts: dict[str, ModuleType], drone: Drone) -> None:
    """By two commands, each after the end of the one before; nothing is uploaded."""
    assert run(scripts, "goto", "--size", "0.5", "--rate", "1") == 0
    assert drone.names() == [*PREPARED, "takeoff", "go_to", *LANDED]
    moves = drone.of("go_to")
    assert [arguments[0] for _, arguments in moves] == [1.15, 1.0, 1.5, 1.0]
    assert all(
        after - before >= arguments[4] for (before, arguments), (after, _) in itertools.pairwise(moves)
    )


def test_a_stream_sends_full_states(scripts: dict[str, ModuleType], drone: Drone) -> None:
    """50 a second at least 20, with velocity and acceleration of the position; then the landing."""
    assert run(scripts, "circle", "--stream", "--heading", "90") == 0
    assert drone.names() == [*PREPARED, "takeoff", "go_to", "full_state", *LANDED]
    sent = drone.of("full_state")
    time_s = np.array([time_s for time_s, _ in sent])
    assert np.diff(time_s) == pytest.approx(0.02, abs=1e-6)
    position, velocity, acceleration = (np.array([arguments[k] for _, arguments in sent]) for k in range(3))
    assert np.gradient(position, 0.02, axis=0)[1:-1] == pytest.approx(velocity[1:-1], abs=2e-3)
    assert np.gradient(velocity, 0.02, axis=0)[1:-1] == pytest.approx(acceleration[1:-1], abs=5e-3)
    assert np.hypot(*(position[:, :2] - PLACE[:2]).T).max() == pytest.approx(1.0, abs=1e-3)
    assert sent[0][1][3] == pytest.approx([0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4)])


def test_a_drone_that_needs_arming_is_armed(scripts: dict[str, ModuleType], drone: Drone) -> None:
    """The flight begins when it can fly."""
    drone.logged["supervisor.info"] = 0
    assert run(scripts, "hover") == 0
    assert drone.names()[:3] == ["set_value", "arm", "stop"]


def logs(**values: float) -> Callable[[Drone], None]:
    """Return what changes logged values; __ stands for the dot."""
    return lambda drone: drone.logged.update(
        {name.replace("__", "."): value for name, value in values.items()}
    )


def sets(**values: float) -> Callable[[Drone], None]:
    """Return what changes parameters; __ stands for the dot."""
    return lambda drone: drone.parameters.update({k.replace("__", "."): value for k, value in values.items()})


def drift(drone: Drone) -> None:
    """Let the variances grow."""
    drone.clock.sleeping.append(
        lambda: drone.logged.update({f"kalman.varP{name}": 0.1 * drone.clock.time_s for name in "XYZ"})
    )


def refuse_to_arm(drone: Drone) -> None:
    """Let the supervisor refuse."""
    drone.logged["supervisor.info"], drone.arms = 0, False


REFUSALS: dict[str, tuple[Callable[[Drone], Any], str]] = {
    "estimator": (sets(stabilizer__estimator=1), "the estimator is not the Kalman filter"),
    "battery": (logs(pm__vbat=3.55), "the battery has 3.55 V, and 3.7 V are the least"),
    "low power": (logs(pm__state=3), "the battery has 4.00 V"),
    "charger": (logs(pm__state=1), "the drone is on its charger"),
    "locked": (logs(supervisor__info=64), "the supervisor has locked the drone: switch it off and on"),
    "crashed": (logs(supervisor__info=128), "the supervisor saw a crash"),
    "tumbled": (logs(supervisor__info=ARMED | 32), "the drone lies on its side"),
    "flying": (logs(supervisor__info=ARMED | CAN_FLY | FLYING), "the drone flies already"),
    "digest": (sets(nmpc__settings=0xABCD), "the firmware has settings 0000abcd, this folder "),
    "self-test": (sets(nmpc__selfTest=17), "the self-test failed in step 17"),
    "no self-test": (sets(nmpc__selfTest=-1), "the self-test did not run"),
    "drift": (drift, "the Kalman filter finds no position"),
    "lost": (logs(nmpc__lost=1), "the Kalman filter finds no position"),
    "not armed": (
        refuse_to_arm,
        "the supervisor does not let the drone fly (supervisor.info = 0)",
    ),
    "upload": (lambda drone: setattr(drone, "failing_uploads", True), "the figure could not be uploaded"),
    "no answer": (lambda drone: setattr(drone, "has_link", False), "no Crazyflie answers at radio://0/80/2M"),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_a_drone_that_is_not_ready_stays_on_the_ground(
    name: str, scripts: dict[str, ModuleType], drone: Drone, capsys: pytest.CaptureFixture[str]
) -> None:
    """One plain sentence says why; nothing that starts motors is sent, and the link is closed."""
    change, reason = REFUSALS[name]
    change(drone)
    assert run(scripts, "eight") == 1
    error = capsys.readouterr().err
    assert error.startswith(f"No flight: {reason}")
    assert error.endswith(".\n")
    assert error.count("\n") == 1
    assert not {"takeoff", "go_to", "start_trajectory", "full_state"} & {*drone.names()}
    assert not drone.is_open


def test_a_firmware_without_the_app_is_refused(
    scripts: dict[str, ModuleType], drone: Drone, capsys: pytest.CaptureFixture[str]
) -> None:
    """By its table of parameters."""
    del drone.parameters["nmpc.settings"]
    assert run(scripts, "hover") == 1
    assert "the firmware has no app with a parameter nmpc.settings" in capsys.readouterr().err


def test_a_firmware_with_an_older_app_is_refused(
    scripts: dict[str, ModuleType], drone: Drone, capsys: pytest.CaptureFixture[str]
) -> None:
    """By its table of log variables."""
    del drone.logged["nmpc.age"]
    assert run(scripts, "hover") == 1
    assert "the firmware has an older app, without nmpc.age: flash this folder" in capsys.readouterr().err


def test_a_link_that_carries_no_parameters_is_refused(
    scripts: dict[str, ModuleType], drone: Drone, capsys: pytest.CaptureFixture[str]
) -> None:
    """As cflib gives up after a minute, with an exception of no class of its own."""
    drone.sends_parameters = False
    assert run(scripts, "hover") == 1
    assert "nmpc.settings cannot be read (Connection timed out): go nearer" in capsys.readouterr().err


def test_all_reasons_are_told_at_once(
    scripts: dict[str, ModuleType], drone: Drone, capsys: pytest.CaptureFixture[str]
) -> None:
    """Estimator, battery and supervisor."""
    sets(stabilizer__estimator=1)(drone)
    logs(pm__vbat=3.0, supervisor__info=64)(drone)
    assert run(scripts, "hover") == 1
    error = capsys.readouterr().err
    assert ("Kalman" in error, "3.00 V" in error, "locked" in error) == (True, True, True)


def test_ctrl_c_lands(
    scripts: dict[str, ModuleType], drone: Drone, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where the drone is; the log is written."""
    at_call(drone, "start_trajectory", 5.0, interrupt)
    assert run(scripts, "eight", "--log", "eight.csv") == 1
    assert drone.names()[-5:] == ["start_trajectory", *LANDED]
    (begun, _), (landing, _), (stopped, _) = (
        drone.of(name)[-1] for name in ("start_trajectory", "land", "stop")
    )
    assert landing - begun == pytest.approx(5.0, abs=0.1)
    assert stopped - landing == pytest.approx(3.0, abs=0.1)
    assert "Stopped by Ctrl-C" in capsys.readouterr().err
    assert Path("eight.csv").read_text("utf-8").startswith("Timestamp,nmpc.step,nmpc.x,")


def test_a_second_ctrl_c_stops_the_motors(scripts: dict[str, ModuleType], drone: Drone) -> None:
    """At once."""
    at_call(drone, "start_trajectory", 5.0, interrupt, interrupt)
    assert run(scripts, "eight") == 1
    assert drone.names()[-4:] == LANDED
    assert drone.of("stop")[-1][0] - drone.of("land")[0][0] == pytest.approx(0.5, abs=0.1)


def test_ctrl_c_in_a_landing_lets_it_land(scripts: dict[str, ModuleType], drone: Drone) -> None:
    """It lands already."""
    at_call(drone, "land", 0.5, interrupt)
    assert run(scripts, "hover") == 0
    assert drone.of("stop")[-1][0] - drone.of("land")[0][0] > 3.0


@pytest.mark.parametrize("back_s", [4.0, 1e6])
def test_a_lost_link_is_opened_again_to_land(
    back_s: float, scripts: dict[str, ModuleType], drone: Drone, capsys: pytest.CaptureFixture[str]
) -> None:
    """The script says what the drone does meanwhile, tries ten times, and lands if it comes back."""
    at_call(drone, "start_trajectory", 5.0, lambda: drone.lose(drone.clock.time_s + back_s))
    assert run(scripts, "eight") == 1
    error = capsys.readouterr().err
    assert "The link is lost: the drone goes on; a figure that was uploaded ends on the floor" in error
    if back_s < 10.0:
        assert drone.names()[-4:] == LANDED
        assert error.endswith("The link came back, and the drone has landed.\n")
    else:
        assert drone.names()[-1] == "start_trajectory"
        assert error.endswith("wait until the drone is down, and switch it off.\n")


def test_a_link_lost_on_the_ground_ends_the_script(
    scripts: dict[str, ModuleType], drone: Drone, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nothing is landed."""
    drone.clock.events.append((0.4, drone.lose))
    assert run(scripts, "eight") == 1
    assert capsys.readouterr().err == "The link was lost on the ground.\n"
    assert "land" not in drone.names()


@pytest.mark.usefixtures("drone")
def test_the_log_has_all_variables(scripts: dict[str, ModuleType]) -> None:
    """Those that identify and replay read, by their names."""
    assert run(scripts, "hover", "--log", "hover.csv") == 0
    header, *rows = Path("hover.csv").read_text("utf-8").splitlines()
    assert {"nmpc.step", "nmpc.targetVx", "nmpc.outRoll", "nmpc.lost", "nmpc.vy"} <= {*header.split(",")}
    assert len(rows) > 100
    assert "" not in rows[50].split(",")


def test_the_clock_of_the_logs_may_begin_again(scripts: dict[str, ModuleType], drone: Drone) -> None:
    """After 24 bits of ms: the rows stay in order."""
    drone.first_tick = 2**24 - 5000
    assert run(scripts, "hover", "--log", "hover.csv") == 0
    _, *rows = Path("hover.csv").read_text("utf-8").splitlines()
    ticks = np.array([int(row.split(",")[0]) for row in rows])
    assert (np.diff(ticks) > 0).all()
    assert ticks[0] < 2**24 < ticks[-1] < 2**24 + 60_000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("loop",), "loop must be hover, goto, eight, circle, or a file"),
        (("eight", "--size", "9"), "9 must lie in 0.05..5"),
        (("eight", "--height", "nan"), "nan must lie in 0.2..5"),
        (("eight", "--rate", "quick"), "invalid number value: 'quick'"),
        ((), "the following arguments are required: figure"),
    ],
)
def test_wrong_arguments_are_named(
    arguments: tuple[str, ...],
    message: str,
    scripts: dict[str, ModuleType],
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Argument, value and what is allowed."""
    with pytest.raises(SystemExit, match="2"):
        run(scripts, *arguments)
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("circle", "--size", "0.3", "--rate", "4.5"),
            "the figure needs 7.0 m/s^2, and tilt and thrust give 5.1: --rate 3.83 would fly",
        ),
        (
            ("goto", "--size", "2", "--rate", "0.7"),
            "the figure needs 1.4 m/s, and the speed limit is 1.2: --rate 0.6 would fly",
        ),
        (("hover", "--log", "none/flight.csv"), "--log none/flight.csv: there is no such folder"),
    ],
)
def test_a_figure_that_is_too_fast_or_has_no_log_is_refused(
    arguments: tuple[str, ...],
    message: str,
    scripts: dict[str, ModuleType],
    drone: Drone,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Before anything is connected."""
    change_values(scripts, speed_m_s=1.2)
    assert run(scripts, *arguments) == 1
    assert message in capsys.readouterr().err
    assert not drone.calls


def test_without_cflib_it_says_what_to_install(
    scripts: dict[str, ModuleType], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In one sentence."""
    without(monkeypatch, "cflib")
    assert run(scripts, "hover") == 1
    assert capsys.readouterr().err.endswith("pip install cflib.\n")


def test_scripts_have_the_prefix_and_log_what_targets_know(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The group of logs and parameters is that of the app; the scripts are those of other settings."""
    settings = with_option(SETTINGS, "code.prefix", "left")
    other = write_target("crazyflie", settings, tmp_path)
    scripts = sorted(path.relative_to(other) for path in other.rglob("*.py"))
    assert len(scripts) == 14
    assert [(folder / path).read_bytes() for path in scripts] == [
        (other / path).read_bytes() for path in scripts
    ]
    radio = modules_of(other, monkeypatch)["radio"]
    assert radio.GROUP == "left"
    assert radio.LOGGED[0][:2] == ("left.step", "left.x")
    assert {"left.targetAy", "left.targetKnown"} <= {*radio.LOGGED[2]}
    assert settings.short_digest == radio.DIGEST
