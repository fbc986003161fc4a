"""The app for the Crazyflie: built as its firmware builds it, flown through stubs of the firmware."""

import itertools
import math
import re
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.metrics import measure
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import Circle
from tests.extensions.crazyflie.support.crazyflie import (
    TURNED,
    Built,
    Crazyflie,
    Fleet,
    build,
    content,
    flown_since,
    send,
)
from tests.support.bundles import write_target
from tests.support.knowing import Knowing

SETTINGS = presets.preset("crazyflie")

# Each wrong line, in the place of what it is in the app.
FRAME_MUTANTS = {
    "x": ("= state->position.x + (shift_s *", "= -state->position.x + (shift_s *"),
    "y": ("= -(state->position.y +", "= (state->position.y +"),
    "vx": ("= state->velocity.x", "= -state->velocity.x"),
    "vy": ("= -state->velocity.y", "= state->velocity.y"),
    "roll": ("measured->roll_rad = RAD_PER_DEG", "measured->roll_rad = -RAD_PER_DEG"),
    "pitch": ("measured->pitch_rad = RAD_PER_DEG", "measured->pitch_rad = -RAD_PER_DEG"),
    "yaw": ("yaw_rad = -RAD_PER_DEG * state", "yaw_rad = RAD_PER_DEG * state"),
    "target x": ("position_m[0] = to->position", "position_m[0] = -to->position"),
    "target y": ("position_m[1] = -to->position", "position_m[1] = to->position"),
    "target vx": ("velocity_m_s[0] = to->velocity", "velocity_m_s[0] = -to->velocity"),
    "target vy": ("velocity_m_s[1] = -to->velocity", "velocity_m_s[1] = to->velocity"),
    "command roll": (": (DEG_PER_RAD * (float)command.roll", ": (-DEG_PER_RAD * (float)command.roll"),
    "command pitch": (": (DEG_PER_RAD * (float)command.pitch", ": (-DEG_PER_RAD * (float)command.pitch"),
}
# What carries a set-point on until the next one, 100 ms later.
AGE_MUTANTS = {
    "no age": ("0.001f * (float)((age_ms", "0.0f * (float)((age_ms"),
    "acceleration": ("from_m_s[k] + (0.5f * age_s *", "from_m_s[k] - (0.5f * age_s *"),
    "velocity": ("(age_s * (from_m_s[k] +", "(2.0f * age_s * (from_m_s[k] +"),
}
# The acceleration of a target that knows it.
KNOWN_MUTANTS = {
    "known x": ("acceleration_m_s2[0] = to->acc", "acceleration_m_s2[0] = -to->acc"),
    "known y": ("acceleration_m_s2[1] = -to->acc", "acceleration_m_s2[1] = to->acc"),
}


def flight_of(apps: int) -> Flight:
    """Return flights of a circle, at a heading at which every sign counts."""
    drone = Vehicle.of(vehicle_toml.load("crazyflie"))
    return Flight(Circle(1.0, 1.2), duration_s=4.0, flights=apps, yaw_rad=0.8, vehicle=drone)


def flown_by(apps: list[Crazyflie], updates_per_setpoint: int = 1) -> Trace:
    """Fly the circle with each app."""
    flight = flight_of(len(apps))
    return fly(flight, Fleet(apps, updates_per_setpoint))


@pytest.fixture(scope="module")
def alone() -> Trace:
    """Fly the circle with the controller alone, which knows what the app tells it."""
    return fly(flight_of(1), Knowing(SETTINGS, 1))


@pytest.mark.long
def test_every_sign_of_the_frames_counts(built: Built, alone: Trace) -> None:
    """Through the app the drone flies as with the controller alone; a wrong sign takes it away from there."""
    trace = flown_by([built.app(), *(built.mutant(name, *mutant) for name, mutant in FRAME_MUTANTS.items())])
    distances = np.abs(trace.position_m - alone.position_m).max(axis=2)
    right, *wrong = distances.max(axis=0)
    assert right < 0.005  # the first jump of the acceleration fades: set-points may be 500 ms apart
    assert distances[300:, 0].max() < 0.002  # set-points are rounded to a millimetre
    assert not {name for name, value in zip(FRAME_MUTANTS, wrong, strict=True) if value < 0.04}


@pytest.mark.long
def test_set_points_by_radio_are_carried_on_by_their_acceleration(built: Built) -> None:
    """With 10 set-points a second it flies as well as with 100; without age or acceleration it does not."""
    apps = [built.app(), *(built.mutant(name, *mutant) for name, mutant in AGE_MUTANTS.items())]
    right, *wrong = measure(flown_by(apps, updates_per_setpoint=10)).iae_m_s
    assert right < 1.05 * measure(flown_by([built.app()])).iae_m_s[0]
    assert not {name for name, value in zip(AGE_MUTANTS, wrong, strict=True) if value < 1.2 * right}


def test_a_set_point_that_no_other_follows_does_not_run_away(app: Crazyflie) -> None:
    """It is carried on for 500 ms, then it rests; after two seconds at 0.5 m/s^2 it would be a metre away."""
    app.aim(np.array([0.0, 0.0, 0.0, 0.0, 0.5, 0.0]))
    flown_since(app, np.zeros(7), 200)
    assert app.logged("saturated") == 0


@pytest.mark.long
def test_a_known_acceleration_is_that_of_the_set_point(tmp_path: Path) -> None:
    """With an observer of the target the flight is that of the controller alone; a wrong sign counts."""
    settings = SETTINGS
    observed = build(write_target("crazyflie", settings, tmp_path))
    apps = [observed.app(), *(observed.mutant(name, *mutant) for name, mutant in KNOWN_MUTANTS.items())]
    alone = fly(flight_of(1), Knowing(settings, 1))
    distances = np.abs(flown_by(apps).position_m - alone.position_m).max(axis=2)
    right, *wrong = distances.max(axis=0)
    assert right < 0.005  # the first jump of the acceleration fades: set-points may be 500 ms apart
    assert distances[300:, 0].max() < 0.001, "it has found that they are 10 ms apart"
    assert not {name for name, value in zip(KNOWN_MUTANTS, wrong, strict=True) if value < 0.04}


@pytest.mark.parametrize("mode", ["modeVelocity", "modeDisable"])
def test_other_set_points_go_to_the_firmware_unchanged(mode: str, built: Built) -> None:
    """Velocity, attitude, level-out and stop, in x, in y or in both, whether it flew before or not."""
    for flew_before, axes in itertools.product((False, True), ("x", "y", "xy")):
        app = built.app()
        app.modes("modeAbs")
        app.aim(np.array([2.0, 1.0, 0.0, 0.0, 0.0, 0.0]))
        if flew_before:
            app.update(np.zeros(7))
            assert app.flown.mode.x == app.host.modeDisable
        for axis in axes:
            setattr(app.setpoint.mode, axis, getattr(app.host, mode))
        app.setpoint.attitude.roll, app.setpoint.attitude.pitch = 1.5, -2.5
        assert app.tick() == (1.5, -2.5)
        assert content(app.flown) == content(app.setpoint)


def test_height_and_yaw_stay_with_the_firmware(app: Crazyflie) -> None:
    """Of a set-point of ours only x, y, roll and pitch change."""
    app.setpoint.position.z, app.setpoint.attitude.yaw, app.setpoint.mode.yaw = (
        1.25,
        30.0,
        app.host.modeAbs,
    )
    app.update(TURNED)
    assert (app.flown.position.z, app.flown.attitude.yaw) == (1.25, pytest.approx(30.0))
    assert (app.flown.mode.z, app.flown.mode.yaw) == (app.host.modeAbs, app.host.modeAbs)
    assert (app.flown.mode.roll, app.flown.mode.pitch) == (app.host.modeAbs, app.host.modeAbs)


def test_a_take_over_begins_anew_at_the_present_attitude(built: Built) -> None:
    """After other set-points, or a gap in which another controller was chosen, nothing is remembered."""
    here = np.array([0.3, -0.2, 0.4, 0.1, 0.1, -0.05, 0.3])
    app = built.app()
    app.modes("modeAbs")
    app.aim(np.zeros(6))
    fresh = flown_since(app, here, 5)
    for interruption in ("mode", "gap", "init"):
        flown_since(app, -here, 20)
        match interruption:
            case "mode":
                app.modes("modeVelocity")
                app.update(here)
                app.modes("modeAbs")
            case "gap":
                app.ticks += 10
            case "init":
                app.host.controllerOutOfTreeInit()
        app.aim(np.zeros(6))
        assert flown_since(app, here, 5) == fresh, interruption
    assert flown_since(app, here, 5) != fresh


def test_a_take_over_tells_the_controller_the_present_attitude(built: Built) -> None:
    """Its first command is that of a controller which was reset to it; level, if the attitude is lost."""
    here = np.array([0.3, -0.2, 0.4, 0.1, 0.1, -0.05, 0.3])
    app, controller = built.app(), CompiledController(SETTINGS)
    app.modes("modeAbs")
    app.aim(np.zeros(6))
    controller.reset([here[4:6]])
    expected = controller.step([here], np.zeros((1, 9)), [9.81]).command_rad[0]
    assert np.radians(app.update(here)) == pytest.approx(expected, abs=1e-6)
    app.ticks += 10
    assert app.update(np.full(7, np.nan)) == (0.0, 0.0)


def test_the_first_step_is_in_the_first_tick(app: Crazyflie) -> None:
    """Whenever the first set-point of ours comes."""
    app.time_ms = 1004
    app.aim(np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    app.place(np.zeros(7))
    assert app.tick() != (0.0, 0.0)
    assert app.flown.mode.x == app.host.modeDisable


def test_the_parameter_on_leaves_all_to_the_firmware(app: Crazyflie) -> None:
    """It switches in flight, without another controller number."""
    app.update(np.zeros(7))
    assert app.flown.mode.x == app.host.modeDisable
    for on, expected in ((0, app.host.modeAbs), (1, app.host.modeDisable)):
        app.set_parameter("on", on)
        flown_since(app, np.zeros(7), 1)
        assert app.flown.mode.x == expected


def test_lost_positions_are_counted_and_end_level(app: Crazyflie) -> None:
    """The controller flies on by its estimate, then level; the next good state is flown as ever."""
    app.aim(np.array([0.5, 0.5, 0.0, 0.0, 0.0, 0.0]))
    flown_since(app, np.zeros(7), 3)
    before = app.logged("refused")
    outage = flown_since(app, np.full(7, np.nan), 200)
    assert app.logged("status") == 2
    assert app.logged("refused") == before + 200
    assert 0.0 not in outage[0]
    assert outage[-1] == (0.0, 0.0)
    assert flown_since(app, np.zeros(7), 1)[0] != (0.0, 0.0)
    assert app.logged("status") == 0


def test_the_log_shows_commands_saturation_and_disturbance(app: Crazyflie) -> None:
    """In degrees, and in the firmware's frame: a disturbance to the left is positive along y."""
    app.aim(np.array([9.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    roll, pitch = flown_since(app, np.zeros(7), 60)[-1]
    assert (app.logged("roll"), app.logged("pitch")) == (roll, pitch)
    assert app.logged("saturated") == 1
    app.host.controllerOutOfTreeInit()
    app.aim(np.zeros(6))
    for step in range(20):
        app.update(np.array([0.0, -0.01 * step, 0.0, -0.1 * step, 0.0, 0.0, 0.0]))
    assert app.logged("disturbanceY") > 0.1
    assert abs(app.logged("disturbanceX")) < 0.01
    app.setpoint.position.x = 5000.0
    moving = [app.update(np.array([0.0, -0.2 - 0.02 * k, 0.0, -2.0, 0.0, 0.0, 0.0])) for k in range(60)]
    assert moving[-1] == (0.0, 0.0)
    assert app.logged("status") == 3
    assert app.logged("disturbanceY") > 0.1, "it keeps its estimate while it flies level"


def test_a_jump_of_the_estimate_comes_little_by_little(app: Crazyflie) -> None:
    """At once the whole would tilt it to the limit; what stays is all there in a second."""
    app.aim(np.zeros(6))
    flown_since(app, np.zeros(7), 200)
    jumped = 0.1 * np.eye(7)[0]
    assert 1.0 < np.max(np.abs(flown_since(app, jumped, 3))) < 5.0
    assert app.logged("x") < 0.02
    flown_since(app, jumped, 97)
    assert app.logged("x") == pytest.approx(0.1, abs=0.002)


@pytest.mark.parametrize("wild", [np.inf, np.nan, 1e30, 50.0])
@pytest.mark.parametrize("place", [0, 3])
def test_a_wild_estimate_leaves_nothing(wild: float, place: int, app: Crazyflie) -> None:
    """What is no number would stay for good, and what is far for long."""
    app.aim(np.zeros(6))
    flown_since(app, np.zeros(7), 200)
    state = 0.1 * np.eye(7)[1]
    state[place] = wild
    flown_since(app, state, 1)
    flown_since(app, np.zeros(7), 40)
    assert app.logged("status") == 0
    assert app.logged("x") == pytest.approx(0.0, abs=0.02)
    assert app.logged("vx") == pytest.approx(0.0, abs=0.02)


def test_a_build_with_other_bits_fails_its_self_test_by_name(built: Built, tmp_path: Path) -> None:
    """The console names the step and the flag; the firmware then refuses to fly."""
    app = built.app()
    assert app.host.controllerOutOfTreeTest()
    folder = write_target("crazyflie", SETTINGS, tmp_path)
    header = folder / "src" / "nmpc.h"
    text = header.read_text("utf-8")
    wrong = text.replace("define NMPC_UPDATE_STEP_S 0.01f", "define NMPC_UPDATE_STEP_S 0.0101f")
    assert wrong != text
    header.write_text(wrong, "utf-8")
    broken = build(folder).app()
    assert broken.parameter("selfTest") == -1, "it did not run yet"
    assert not broken.host.controllerOutOfTreeTest()
    assert broken.parameter("selfTest") > 0
    assert re.search(r"NMPC: self-test: step \d+ differs; .*-ffp-contract=off", broken.console)


def test_weights_of_a_1_norm_are_parameters(tmp_path: Path) -> None:
    """They act at the next update; a weight out of range changes nothing; the cost is logged."""
    settings = presets.preset("mambo-1norm")
    weighted = build(write_target("crazyflie", settings, tmp_path))
    here, costs = np.array([0.3, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0]), []
    for tracking in (settings.cost.tracking_weight, 2 * settings.cost.tracking_weight, np.nan):
        app = weighted.app()
        app.modes("modeAbs")
        app.aim(np.zeros(6))
        app.set_parameter("tracking", tracking)
        app.update(here)
        costs.append(app.logged("cost"))
    assert costs[1] == pytest.approx(2 * costs[0], rel=0.2)
    assert costs[2] == costs[0]


def test_limits_are_parameters(tmp_path: Path) -> None:
    """A fence in the firmware's frame, y to the left, acts at the next update; a bad one changes nothing."""
    limited = build(write_target("crazyflie", with_option(SETTINGS, "limits.speed_m_s", 2.0), tmp_path))
    app = limited.app()
    for name in ("speed", "tilt"):
        app.set_parameter(name, 100.0)
    app.modes("modeAbs")
    app.aim(np.array([0.0, -1.5, 0.0, 0.0, 0.0, 0.0]))
    here = np.zeros(7)
    app.update(here)
    assert (app.parameter("speed"), app.parameter("tilt")) == (100.0, 100.0), "what the pilot wrote stays"
    assert app.logged("badLimits") == 0
    app.set_parameter("tilt", 0.1)
    assert max(np.abs(flown_since(app, here, 30)[-1])) <= math.degrees(0.1) + 1e-4
    app.set_parameter("tilt", math.nan)
    app.update(here)
    assert app.logged("limits") & 4 == 0
    for name, value in (("xMin", -1.0), ("xMax", 1.0), ("yMin", -3.0), ("yMax", 1.0)):
        app.set_parameter(name, value)
    app.update(here)
    assert app.logged("limits") & 4 == 4, "the target is 0.5 m left of the fence"
    app.set_parameter("yMax", 2.0)
    app.update(here)
    assert app.logged("limits") & 4 == 0
    app.set_parameter("yMax", -4.0)
    app.update(here)
    assert app.logged("limits") & 4 == 0, "less than yMin: refused"
    assert app.logged("badLimits") == 1 << 6
    assert "limits refused" in app.console
    app.set_parameter("speed", 0.0)
    app.set_parameter("yMax", 1.0)
    app.update(here)
    assert app.logged("badLimits") == 1, "each limit by itself"
    assert app.logged("limits") & 4 == 4


def test_missing_variances_are_said_once(built: Built) -> None:
    """In the worker's task, when the app starts: a lost position goes unnoticed then."""
    quiet = built.host()
    quiet.host_has_variances = False
    app = Crazyflie(quiet)
    scheduled = app.host.host_scheduled
    assert app.console.count("NMPC: no kalman.varX, varPX, varZ, varD0, varD1 or varD2: ") == 1
    assert scheduled == app.console.count("\n") == 2, "with the version"
    app.host.controllerOutOfTreeInit()
    assert app.host.host_scheduled == scheduled
    app.modes("modeAbs")
    send(app, 0.5)
    flown_since(app, np.zeros(7), 100)
    assert app.logged("lost") == 0


def test_variances_that_are_there_are_not_spoken_of(built: Built) -> None:
    """The console has the version, and nothing of missing log variables."""
    app = built.app()
    assert "settings" in app.console
    assert "unnoticed" not in app.console


def test_parameters_tell_a_script_what_it_flies(built: Built) -> None:
    """The settings' digest, its first eight digits, and 0 if the self-test passed."""
    app = built.app()
    assert app.parameter("settings") == int(SETTINGS.short_digest[:8], 16)
    assert app.host.controllerOutOfTreeTest()
    assert app.parameter("selfTest") == 0
