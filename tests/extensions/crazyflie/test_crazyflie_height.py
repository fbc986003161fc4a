"""The Crazyflie's app with a height: what it reads and flies, on the ground, in the air, at a take-over."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mambo_codegen.methods import method_of
from tests.extensions.crazyflie.support.crazyflie import Built, Crazyflie, build
from tests.support.bundles import write_target
from tests.support.height_settings import height_settings

MOST_N = 0.48
"""Of the four motors, in the stubs."""
SETTINGS = height_settings()
AXES = (("x", 1.0), ("y", -1.0), ("z", 1.0))


@pytest.fixture(scope="module")
def lifting(tmp_path_factory: pytest.TempPathFactory) -> Built:
    """Return the app for preset crazyflie with a height, compiled."""
    return build(write_target("crazyflie", SETTINGS, tmp_path_factory.mktemp("lifting")))


def hovering(lifting: Built, height_m: float = 1.0) -> Crazyflie:
    """Return a drone in the air with a set-point at its place."""
    app = lifting.app()
    app.modes("modeAbs")
    app.place(np.zeros(7))
    app.set_parameter("mass", 0.029)
    app.state.position.z = app.setpoint.position.z = height_m
    app.setpoint.timestamp = app.time_ms
    return app


def ticks(app: Crazyflie, n: int) -> None:
    """Run n milliseconds in a state that stays, with a set-point each 10 ms."""
    for _ in range(n):
        if app.time_ms % 10 == 0:
            app.setpoint.timestamp = app.time_ms
        app.tick()


@pytest.mark.long
def test_the_thrust_that_flies_is_the_commanded_one_times_the_mass(lifting: Built) -> None:
    """In the firmware's scale of a motor, with the height's mode off; parameter `mass` counts."""
    app = hovering(lifting)
    ticks(app, 11)
    assert app.flown.mode.z == app.host.modeDisable
    for mass_kg in (0.036, 0.029):
        app.set_parameter("mass", mass_kg)
        ticks(app, 1500)  # in the air a change takes effect slowly
        wanted = 65535.0 * mass_kg * app.logged("outThrust") / MOST_N
        assert app.flown.thrust == pytest.approx(wanted, rel=1e-6)


def test_a_step_has_the_bits_of_the_reference(lifting: Built) -> None:
    """What the app logs as read, through the reference, gives what it logs as commanded, in three axes."""
    app, rng = hovering(lifting), np.random.default_rng(1)
    reference = method_of(SETTINGS).reference_controller()
    for k in range(50):
        for part, scale in (("position", 0.3), ("velocity", 0.5)):
            for axis, _ in AXES:
                lift = 1.0 if (part, axis) == ("position", "z") else 0.0
                setattr(getattr(app.state, part), axis, lift + scale * rng.uniform(-1, 1))
                setattr(getattr(app.setpoint, part), axis, lift + scale * rng.uniform(-1, 1))
        app.setpoint.acceleration.x, app.setpoint.acceleration.z = rng.uniform(-1, 1, 2)
        app.state.attitude.roll, app.state.attitude.yaw = rng.uniform(-10, 10), rng.uniform(-180, 180)
        app.setpoint.timestamp = app.time_ms
        for _ in range(10):
            app.tick()
        read = {name: app.logged(name) for name in ("inRoll", "inPitch", "inYaw", "grounded", "startThrust")}
        if k == 0:
            reference.reset([[read["inRoll"], read["inPitch"], read["startThrust"]]])
        own = [sign * app.logged(name) for name, sign in (("x", 1), ("y", -1), ("vx", 1), ("vy", -1))]
        state = [*own, read["inRoll"], read["inPitch"], -read["inYaw"]]
        state += [app.logged("z"), app.logged("vz"), read["grounded"]]
        aimed = [
            *(s * app.logged(n) for n, s in (("targetX", 1), ("targetY", -1))),
            *(s * app.logged(n) for n, s in (("targetVx", 1), ("targetVy", -1))),
            *(s * app.logged(n) for n, s in (("targetAx", 1), ("targetAy", -1))),
            *(app.logged(n) for n in ("targetZ", "targetVz", "targetAz")),
            *(0.0, 0.0, 0.0, app.logged("targetKnown")),  # no acceleration ahead
        ]
        assert app.logged("targetKnown") == 1
        step: Any = reference.step([state], [aimed])
        assert step.status[0] == app.logged("status") == 0
        assert step.command_rad[0].tolist() == [app.logged("outRoll"), app.logged("outPitch")]
        assert step.thrust_m_s2[0] == app.logged("outThrust")


def test_a_set_point_is_carried_on_in_height_too(lifting: Built) -> None:
    """By velocity and acceleration, as x and y are."""
    app = hovering(lifting)
    app.setpoint.velocity.z, app.setpoint.acceleration.z = 0.4, 1.0
    for _ in range(41):
        app.tick()
    assert app.logged("age") == 40
    assert app.logged("targetZ") == pytest.approx(1.0 + 0.4 * 0.04 + 0.5 * 0.04**2)
    assert app.logged("targetVz") == pytest.approx(0.44)


def test_on_the_ground_it_is_level_with_least_thrust_until_the_set_point_climbs(lifting: Built) -> None:
    """Then it aims 12.5 cm up at least, so that the motors gain speed before the plan leaves the ground."""
    app = hovering(lifting, 0.4)
    app.host.host_is_flying = False
    take_overs = app.logged("takeOvers") + 1
    app.setpoint.position.x = 1.0
    ticks(app, 300)
    least = SETTINGS.height.thrust_min_m_s2 if SETTINGS.height else math.nan
    assert app.logged("outThrust") == pytest.approx(least)
    assert (app.flown.attitude.roll, app.flown.attitude.pitch) == (0.0, 0.0)
    assert (app.logged("grounded"), app.logged("level")) == (1, 1)
    app.host.host_is_flying = True
    app.setpoint.velocity.z = 0.01
    ticks(app, 100)
    assert app.logged("targetZ") == pytest.approx(0.525)
    assert app.logged("outThrust") > 9.81
    app.state.position.z = 0.46
    ticks(app, 20)
    assert (app.logged("grounded"), app.logged("level")) == (0, 0)
    assert app.flown.attitude.pitch != 0.0
    assert app.logged("takeOvers") == take_overs, "the controller has run since the ground"


def test_a_take_over_in_the_air_begins_with_the_thrust_of_the_other_controller(lifting: Built) -> None:
    """In the firmware's scale; of one that commands newtons, that of hover."""
    app = hovering(lifting)
    app.output.thrust, app.output.controlMode = 40000.0, app.host.controlModeLegacy
    ticks(app, 1)
    assert app.logged("startThrust") == pytest.approx(40000.0 / 65535.0 * MOST_N / 0.029)
    app.modes("modeVelocity")
    ticks(app, 10)
    app.modes("modeAbs")
    app.output.controlMode = app.host.controlModeForceTorque
    ticks(app, 1)
    assert app.logged("startThrust") == pytest.approx(9.81)


def test_a_set_point_without_a_height_is_the_firmwares(lifting: Built) -> None:
    """The PID controller gets it unchanged."""
    app = hovering(lifting)
    app.setpoint.mode.z = app.host.modeVelocity
    app.setpoint.velocity.z = -0.2
    ticks(app, 20)
    assert (app.flown.mode.x, app.flown.mode.z) == (app.host.modeAbs, app.host.modeVelocity)
    assert app.flown.velocity.z == pytest.approx(-0.2)


def test_a_lost_drone_descends_by_the_thrust_that_carried_it(lifting: Built) -> None:
    """It flies on by its own thrust; then it descends by 3 % less than the PID controller gave."""
    app = hovering(lifting)
    app.output.thrust = 40000.0
    for k in range(80):
        app.host.host_variances = [1e-4 * (1 + k % 2)] * 2
        ticks(app, 100)
    for _ in range(600):
        app.host.host_variances = [value * 1.001 for value in app.host.host_variances]
        ticks(app, 1)
    assert app.logged("lost") == 1
    assert app.flown.mode.z == app.host.modeDisable
    while app.logged("lost") == 1:
        app.host.host_variances = [value * 1.001 for value in app.host.host_variances]
        ticks(app, 1)
    ticks(app, 2)
    assert app.logged("lost") == 2
    assert app.flown.mode.z == app.host.modeDisable
    assert app.flown.thrust == pytest.approx(40000.0 * (1.0 - 0.3 / 9.81), rel=0.01)
    assert (app.flown.attitude.roll, app.flown.attitude.pitch) == (0.0, 0.0)


def test_a_take_over_does_not_count_the_thrust_that_flew_before(lifting: Built) -> None:
    """A drone that loses its height in the next millisecond sinks by 3 % less than what should carry it."""
    app = hovering(lifting)
    ticks(app, 1)
    carrying = 9.81 * app.flown.thrust / app.logged("outThrust")
    app.state.position.z = math.nan
    ticks(app, 1)
    assert app.flown.mode.z == app.host.modeDisable
    assert app.flown.thrust == pytest.approx(carrying * (1.0 - 0.3 / 9.81), rel=0.002)


def test_a_mass_in_grams_is_refused(lifting: Built) -> None:
    """So are others that are absurd; a good one flies slowly in the air."""
    app = hovering(lifting)
    ticks(app, 100)
    before = app.flown.thrust / app.logged("outThrust")
    for mass_kg in (30.0, 0.3, 0.0, math.nan, -0.03, 0.003):
        app.set_parameter("mass", mass_kg)
        ticks(app, 10)
        assert app.logged("badLimits") == 0x8000
        assert app.flown.thrust / app.logged("outThrust") == pytest.approx(before)
    assert app.console.count("mass refused") == 1
    app.set_parameter("mass", 0.036)
    ticks(app, 10)
    assert app.logged("badLimits") == 0
    assert app.flown.thrust / app.logged("outThrust") == pytest.approx(before, rel=0.005)
    ticks(app, 2000)
    assert app.flown.thrust / app.logged("outThrust") == pytest.approx(before * 0.036 / 0.029, rel=0.001)


def test_floor_ceiling_and_speeds_are_parameters(tmp_path: Path) -> None:
    """None looser than in the settings."""
    values = SETTINGS.model_dump(exclude_none=True)
    values["limits"] |= {"speed_m_s": 3.0, "fence": {"floor_m": -0.5, "ceiling_m": 2.0}}
    app = hovering(build(write_target("crazyflie", type(SETTINGS).model_validate(values), tmp_path)))
    ticks(app, 11)
    for name, value in (("zMin", -3.0), ("zMax", 1.2), ("climb", 0.5)):
        app.set_parameter(name, value)
        ticks(app, 10)
        assert app.logged("badLimits") == 0
    app.setpoint.position.z = 1.9
    ticks(app, 20)
    assert app.logged("limits") & 16
