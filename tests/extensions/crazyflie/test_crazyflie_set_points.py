"""The Crazyflie's app and set-points: slow, late, wrong, on the ground; and a position that is lost."""

import math

import numpy as np
import pytest

from tests.extensions.crazyflie.support.crazyflie import TURNED, Built, Crazyflie, content, flown_since, send


def test_a_slow_set_point_is_carried_on_for_half_a_second(app: Crazyflie) -> None:
    """At its age by the clock, though half of the ticks are lost; then it rests."""
    send(app, 1.0, 0.5, 0.2)
    app.place(np.zeros(7))
    for age_ms in range(0, 700, 2):
        app.tick()
        app.time_ms += 1
        if age_ms % 10 == 0:
            age_s = 0.001 * min(age_ms, 500)
            assert app.logged("age") == age_ms
            assert app.logged("targetX") == pytest.approx(1.0 + 0.5 * age_s + 0.1 * age_s**2, abs=1e-6)
            speed = 0.5 + 0.2 * age_s if age_ms < 500 else 0.0
            assert app.logged("targetVx") == pytest.approx(speed, abs=1e-6)
    assert app.logged("step") % 2**16 > 0


def test_a_stream_of_set_points_that_ends_is_noticed(app: Crazyflie) -> None:
    """After 120 ms where they came every 10 ms: the set-point rests before the supervisor levels out."""
    for k in range(500):
        send(app, 0.005 * k, 0.5)
        app.update(np.zeros(7))
    for age_ms in range(10, 200, 10):
        app.update(np.zeros(7))
        assert app.logged("age") == age_ms
        assert app.logged("targetVx") == (pytest.approx(0.5, abs=0.01) if age_ms < 120 else 0.0)


def test_lost_ticks_cost_no_steps(app: Crazyflie) -> None:
    """A step every 10 ms of the clock, whatever the task missed."""
    send(app, 0.0)
    app.place(np.zeros(7))
    before = app.logged("step")
    for number in range(1000):
        app.tick()
        app.time_ms += number % 3
    assert app.logged("step") - before == pytest.approx(200, abs=2)


def test_an_acceleration_that_is_not_given_is_estimated(app: Crazyflie) -> None:
    """From the velocities of set-points that come ten times a second: near that of the circle, and smooth."""
    app.place(np.zeros(7))
    found = []
    for k in range(100):
        speed = 0.75 * math.cos(0.15 * k)
        if k % 10 == 0:
            send(app, 0.5 * math.sin(0.15 * k / 10), 0.75 * math.cos(0.15 * k / 10))
        flown_since(app, np.zeros(7), 1)
        found.append(app.logged("targetAx"))
        assert abs(speed) <= 0.75
    wanted = [-1.125 * math.sin(0.15 * k / 10) for k in range(100)]
    assert max(abs(a - b) for a, b in zip(found[30:], wanted[30:], strict=True)) < 0.35
    send(app, 0.0)
    flown_since(app, np.zeros(7), 1)
    assert app.logged("targetAx") == 0.0, "a set-point at rest has none"


@pytest.mark.parametrize(
    "number", ["position.x", "position.z", "velocity.y", "acceleration.z", "attitude.yaw"]
)
def test_a_number_that_is_not_finite_refuses_the_whole_set_point(number: str, app: Crazyflie) -> None:
    """The one before flies on, with its height and heading; the log counts it."""
    app.setpoint.mode.yaw = app.host.modeAbs
    app.setpoint.position.z, app.setpoint.attitude.yaw = 1.25, 30.0
    send(app, 0.5)
    flown_since(app, TURNED, 2)
    refused = app.logged("refused")
    part, member = number.split(".")
    for value in (math.nan, math.inf):
        send(app, 0.7)
        app.setpoint.position.z, app.setpoint.attitude.yaw = 1.5, 40.0
        setattr(getattr(app.setpoint, part), member, value)
        flown_since(app, np.zeros(7), 10)
        assert app.logged("status") == 3
        assert app.logged("targetX") == 0.5
        assert (app.flown.position.z, app.flown.attitude.yaw) == (1.25, pytest.approx(30.0))
        setattr(getattr(app.setpoint, part), member, 0.0)
    assert app.logged("refused") == refused + 20


def test_a_first_set_point_that_is_not_finite_stays_here(app: Crazyflie) -> None:
    """At the place and the heading of the drone."""
    app.setpoint.position.x = math.nan
    here = np.array([0.3, -0.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    app.update(here)
    assert (app.logged("targetX"), app.logged("targetY")) == pytest.approx((0.3, 0.2))
    assert app.flown.position.z == 1.0


def test_every_kind_of_set_point_flies_in_one_mode(app: Crazyflie) -> None:
    """The PID controller resets itself at a change of mode: the heading of a quaternion becomes an angle."""
    app.setpoint.mode.yaw = app.host.modeAbs
    app.setpoint.attitude.yaw = 30.0
    app.update(TURNED)
    first = content(app.flown)
    app.setpoint.mode.yaw, app.setpoint.mode.quat = app.host.modeDisable, app.host.modeAbs
    app.setpoint.attitude.yaw = 0.0
    app.setpoint.attitudeQuaternion.w = math.cos(math.radians(15.0))
    app.setpoint.attitudeQuaternion.z = math.sin(math.radians(15.0))
    app.update(np.zeros(7))
    assert content(app.flown) == first
    assert app.flown.mode.quat == app.host.modeDisable
    assert app.flown.attitude.yaw == pytest.approx(30.0, abs=1e-4)


def test_a_heading_is_carried_on_by_its_rate(app: Crazyflie) -> None:
    """A full-state set-point gives it."""
    app.setpoint.mode.yaw = app.host.modeAbs
    app.setpoint.attitude.yaw, app.setpoint.attitudeRate.yaw = 30.0, 100.0
    send(app, 0.0)
    app.place(TURNED)
    for _ in range(101):
        app.tick()
    assert app.flown.attitude.yaw == pytest.approx(40.0)


def test_the_heading_turns_slowly_and_the_short_way(app: Crazyflie) -> None:
    """By 4 rad/s at most from where the drone points, also across south."""
    app.setpoint.mode.yaw, app.setpoint.attitude.yaw = app.host.modeAbs, -170.0
    app.place(np.array([0, 0, 0, 0, 0, 0, math.radians(-160.0)]))
    headings = []
    for _ in range(200):
        send(app, 0.0)
        app.tick()
        headings.append(app.flown.attitude.yaw)
    turned = np.unwrap(headings, period=360.0) - 160.0
    assert np.diff(turned, prepend=0.0).max() == pytest.approx(math.degrees(0.004), rel=1e-3)
    assert turned[-1] == pytest.approx(30.0, abs=1e-3)


def test_on_the_ground_it_flies_level(app: Crazyflie) -> None:
    """While the supervisor sees no flight, and within 5 cm of the height of take-off."""
    send(app, 2.0)
    steps = app.logged("step")
    app.host.host_is_flying = False
    app.state.position.z = 0.4
    assert app.tick() == (0.0, 0.0)
    app.host.host_is_flying = True
    for height_m in (0.41, 0.44, 0.36):
        app.state.position.z = height_m
        assert app.tick() == (0.0, 0.0)
        assert app.flown.mode.x == app.host.modeDisable
    assert app.logged("step") == steps
    app.state.position.z = 0.46
    assert app.tick() != (0.0, 0.0)
    app.host.host_is_flying = False
    app.state.position.z = 0.0
    app.tick()


def measured_for(app: Crazyflie, milliseconds: int, measuring: bool) -> None:
    """Fly on with a camera at 100 Hz, or without: variances fall at a measurement and grow between."""
    for k in range(milliseconds):
        grown = [1.001 * value for value in app.host.host_variances]
        app.host.host_variances = [1e-5, 1e-4] if measuring and k % 10 == 0 else grown
        app.tick()


def test_a_lost_position_is_told_and_ends_on_the_floor(built: Built) -> None:
    """After 0.3 s without a measurement; it flies on, descends, stops the motors, and waits for the pilot."""
    app = built.app()
    app.output.thrust = 40000.0
    app.modes("modeAbs")
    send(app, 0.5)
    app.place(np.zeros(7))
    measured_for(app, 9000, measuring=True)
    assert (app.logged("lost"), app.logged("status")) == (0, 0)
    measured_for(app, 250, measuring=False)
    assert app.logged("lost") == 0
    measured_for(app, 100, measuring=False)
    assert app.logged("lost") == 1
    assert "position lost" in app.console
    measured_for(app, 1800, measuring=False)
    assert (app.logged("lost"), app.flown.mode.z) == (1, app.host.modeDisable)
    measured_for(app, 300, measuring=False)
    assert app.logged("lost") == 2
    assert (app.flown.attitude.roll, app.flown.attitude.pitch) == (0.0, 0.0)
    assert app.flown.mode.z == app.host.modeDisable
    assert app.flown.thrust == pytest.approx(40000.0 * (1.0 - 0.3 / 9.81), rel=1e-3)
    measured_for(app, 5000, measuring=False)
    assert app.logged("lost") == 3
    assert (app.flown.mode.z, app.flown.thrust) == (app.host.modeDisable, 0.0)
    measured_for(app, 1000, measuring=True)
    assert app.logged("lost") == 3, "a position that comes back starts no motor"
    app.modes("modeVelocity")
    measured_for(app, 20, measuring=True)
    app.modes("modeAbs")
    measured_for(app, 20, measuring=True)
    assert app.logged("lost") == 0
    assert app.flown.mode.z == app.host.modeAbs


def test_a_position_that_comes_back_is_flown_on(app: Crazyflie) -> None:
    """Before the descent has begun."""
    send(app, 0.5)
    app.place(np.zeros(7))
    measured_for(app, 200, measuring=True)
    measured_for(app, 800, measuring=False)
    assert app.logged("lost") == 1
    measured_for(app, 30, measuring=True)
    assert (app.logged("lost"), app.logged("status")) == (0, 0)


def test_without_a_position_no_flight_begins(app: Crazyflie) -> None:
    """The motors stay off."""
    send(app, 0.5)
    app.host.host_is_flying = False
    app.state.position.z = 0.0
    app.host.host_variances = [100.0, 0.01]
    measured_for(app, 400, measuring=False)
    assert app.logged("lost") == 1
    assert (app.flown.mode.z, app.flown.thrust) == (app.host.modeDisable, 0.0)
