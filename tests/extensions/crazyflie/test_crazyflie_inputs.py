"""Inputs of the Crazyflie app's steps: where the drone is now, where the target is, and what the log says."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.settings import presets
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.controllers.thrust_controller import Applied
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.trajectories import Circle
from mambo_sil.model.replay.log_replay import replay_log
from tests.extensions.crazyflie.support.crazyflie import Built, Crazyflie, Fleet, build, send
from tests.support.bundles import write_target

SETTINGS = presets.preset("crazyflie")
LOGGED = (
    *("takeOvers", "x", "y", "vx", "vy", "inRoll", "inPitch", "inYaw", "targetX", "targetY", "targetVx"),
    *("targetVy", "targetAx", "targetAy", "outRoll", "outPitch", "targetKnown"),
)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    """Return the app with an observer of the target, compiled."""
    return build(write_target("crazyflie", SETTINGS, tmp_path_factory.mktemp("observed")))


def filtered(app: Crazyflie, time_ms: int, delay_ms: int) -> None:
    """Tick with the estimate of a drone at 1 m/s: predicted every 10 ms, and measured `delay_ms` later."""
    variance = 1.001 * app.host.host_variances[0]
    app.state.velocity.x = 1.0
    if time_ms % 10 == 0:
        app.state.position.x = 0.001 * (time_ms + delay_ms) - 0.001
    if time_ms % 10 == delay_ms:
        app.state.position.x = 0.001 * (time_ms - time_ms % 10 + delay_ms)
        variance = 1e-4
    app.host.host_variances = [variance, variance]
    app.tick()


@pytest.mark.parametrize("delay_ms", [0, 3, 7])
def test_the_position_is_that_of_now_whenever_the_filter_predicts_and_measures(
    delay_ms: int, app: Crazyflie
) -> None:
    """Between predictions the filter holds it, and a measurement 7 ms after one makes it 7 ms too new."""
    app.aim(np.zeros(6))
    for offset_ms in range(10):
        app.ticks += 10  # another controller flew: the next tick takes over
        app.state.position.x = 0.0
        for time_ms in range(offset_ms, 1000):
            filtered(app, time_ms, delay_ms)
            app.setpoint.timestamp = app.time_ms
        step_ms = max(time_ms for time_ms in range(990, 1000) if (time_ms - offset_ms) % 10 == 0)
        assert app.logged("x") == pytest.approx(0.001 * step_ms, abs=0.0016)


def swept(app: Crazyflie, time_ms: int) -> None:
    """Tick with the estimate of a drone at 1 m/s which four small measurements a prediction correct."""
    variance = 1.001 * app.host.host_variances[0] if time_ms % 10 == 0 else app.host.host_variances[0]
    app.state.velocity.x = 1.0
    app.state.position.x += 0.01 if time_ms % 10 == 0 else 0.0
    if time_ms % 10 in (2, 4, 6, 8):
        app.state.position.x += 0.05 * (0.001 * time_ms - app.state.position.x)
        variance *= 1.001**-0.25
    app.host.host_variances = [variance, variance]
    app.tick()


def test_several_measurements_a_prediction_are_dated_by_their_mean(app: Crazyflie) -> None:
    """As those of base stations: each lowers the variance by less than one of a camera; none is lost."""
    app.aim(np.zeros(6))
    app.host.host_variances, app.state.position.x = [1e-4, 1e-4], 0.0
    for time_ms in range(100):
        swept(app, time_ms)
    for offset_ms in range(10):
        app.ticks += 10  # another controller flew: the next tick takes over
        app.state.position.x = 0.001 * offset_ms
        for time_ms in range(offset_ms, 2000 + offset_ms):
            app.setpoint.timestamp = app.time_ms
            swept(app, time_ms)
            assert app.logged("lost") == 0
        assert app.logged("x") == pytest.approx(0.001 * (1990 + offset_ms), abs=0.0025)


def test_a_filter_that_starts_anew_measures_no_flow(app: Crazyflie) -> None:
    """Its variance falls from its start to the largest that it keeps, where it stays until the next frame."""
    for variance in (1e-4, 1e-5, 10000.0, 100.0, 1e-4):
        for k in range(30):
            app.host.host_variances = [variance * (1.0 + 1e-4 * k), 1e-4]
            app.aim(np.zeros(6))
            app.tick()
            if variance != 1e-4:
                assert (app.logged("lost"), app.logged("source")) == (0, 1)
    assert "settings are for" not in app.console


def test_an_estimate_without_variances_is_taken_as_it_is(app: Crazyflie) -> None:
    """That of another estimator, whatever its position does."""
    app.aim(np.zeros(6))
    app.state.velocity.x = 1.0
    for time_ms in range(200):
        app.state.position.x = 0.01 * (time_ms // 10)
        app.tick()
    assert app.logged("x") == pytest.approx(0.19)


def test_a_slow_stream_of_set_points_is_carried_on_by_its_jerk(built: Built) -> None:
    """Five set-points a second on a circle: the target stays within 1 cm, without jerk it does not."""
    app = built.app()
    without = built.mutant("no jerk", "acceleration[k] + (age_s * jerk[k])", "acceleration[k]")
    circle, worst = Circle(1.0, 1.8), []
    for one in (app, without):
        one.modes("modeAbs")
        errors = []
        for update in range(300):
            time_s = 0.01 * update
            if update % 20 == 0:
                one.aim(np.concatenate([circle.target(time_s), circle.acceleration(time_s)]))
            one.update(np.zeros(7))
            errors.append(abs(one.logged("targetX") - circle.target(time_s)[0]))
        worst.append(max(errors[100:]))
    assert worst[0] < 0.01
    assert worst[1] > 1.3 * worst[0]


def test_a_set_point_with_its_jerk_is_carried_on_by_it(built: Built) -> None:
    """The plans of the high-level commander have it; 100 ms later the place is that of the cubic."""
    for jerk in (0.0, 6.0):
        app = built.app()
        app.modes("modeAbs")
        app.place(np.zeros(7))
        app.setpoint.jerk.x = jerk
        send(app, 0.0, 0.5, 1.0)
        for _ in range(101):
            app.tick()
        assert app.logged("targetX") == pytest.approx(0.05 + 0.005 + jerk / 6000.0, abs=2e-4)
        assert app.logged("targetAx") == pytest.approx(1.0 + 0.1 * jerk, abs=0.01)


def test_a_place_that_changes_without_a_new_time_stamp_counts(app: Crazyflie) -> None:
    """The firmware's collision avoidance moves set-points so."""
    app.place(np.zeros(7))
    send(app, 0.2)
    for _ in range(20):
        app.tick()
    app.setpoint.position.x = 0.1
    for _ in range(10):
        app.tick()
    assert app.logged("targetX") == pytest.approx(0.1)
    app.setpoint.velocity.x = 0.3
    for _ in range(10):
        app.tick()
    assert app.logged("targetVx") == pytest.approx(0.3)


def test_a_jump_of_the_acceleration_is_no_jerk(app: Crazyflie) -> None:
    """A millisecond after the high-level commander's set-point at rest one comes that accelerates."""
    app.aim(np.zeros(6))
    app.place(np.zeros(7))
    app.tick()
    app.aim(np.array([0.0, 0.0, 0.0, 0.0, 2.0, 0.0]))
    for _ in range(200):
        app.tick()
    assert app.logged("targetAx") == pytest.approx(2.0, abs=0.05)


class Logging:
    """A fleet of one app that keeps what it logs of every step; later its set-points have no acceleration."""

    def __init__(self, app: Crazyflie) -> None:
        self.fleet, self.app = Fleet([app], 3), app
        self.rows: list[list[float]] = []

    def step(self, state: FloatArray, target: FloatArray, thrust_m_s2: FloatArray) -> Applied:
        """Make a step, and log it."""
        aimed = target[:, :6] * [1.0, 1.0, 1.0, 1.0, *([float(len(self.rows) < 200)] * 2)]
        if len(self.rows) == 150:
            self.app.ticks += 10  # another controller flew
        answer = self.fleet.step(state, aimed, thrust_m_s2)
        self.rows.append([self.app.logged(name) for name in LOGGED])
        return answer


def test_a_replay_of_the_app_s_log_is_equal_in_every_bit(built: Built, tmp_path: Path) -> None:
    """Through a second take-over, with set-points that are carried on, at last without acceleration."""
    logging = Logging(built.app())
    drone = Vehicle.of(vehicle_toml.load("crazyflie"))
    fly(Flight(Circle(1.0, 1.2), duration_s=3.0, flights=1, yaw_rad=0.8, vehicle=drone), logging)
    path = tmp_path / "flight.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["Timestamp", *(f"nmpc.{name}" for name in LOGGED)])
        writer.writerows([[10 * k, *map(repr, row)] for k, row in enumerate(logging.rows)])
    replay = replay_log(path, {}, SETTINGS)
    assert {row[-1] for row in logging.rows} == {0, 1}
    assert len(replay.time_s) == len(logging.rows) >= 300
    assert np.array_equal(replay.replayed_rad, replay.logged_rad)
    assert math.isfinite(replay.logged_rad.sum())
    assert np.ptp(replay.logged_rad, axis=0).min() > 0.1


def test_the_acceleration_is_known_where_it_is_given_or_the_set_point_rests(built: Built) -> None:
    """Else the controller observes it: the app's own estimate counts for nothing."""
    app = built.app()
    app.modes("modeAbs")
    known = []
    for speed, acceleration, updates in ((0.5, 0.2, 1), (0.5, 0.0, 49), (0.5, 0.0, 60), (0.0, 0.0, 1)):
        app.aim(np.array([0.0, 0.0, speed, 0.0, acceleration, 0.0]))
        for _ in range(updates):
            app.update(np.zeros(7))
        known.append((app.logged("targetKnown"), app.logged("targetVx") == 0.0))
    assert known == [(1, False), (0, False), (1, True), (1, True)]


def test_a_given_acceleration_does_not_jump_at_a_set_point(built: Built) -> None:
    """At ten set-points a second it changes by little more than the circle's does."""
    app, circle = built.app(), Circle(1.0, 1.5)
    jumping = built.mutant("kink", "(a + (left * kink[k]))", "a")
    largest = []
    for one in (app, jumping):
        one.modes("modeAbs")
        found = []
        for update in range(400):
            if update % 10 == 0:
                one.aim(np.concatenate([circle.target(0.01 * update), circle.acceleration(0.01 * update)]))
            one.update(np.zeros(7))
            found.append(one.logged("targetAx"))
        largest.append(np.abs(np.diff(found[100:])).max())
    assert largest[0] < 2.0 * 0.01 * 1.5**3
    assert largest[1] > 2.0 * largest[0]


@pytest.mark.parametrize("given", [True, False])
def test_the_velocity_of_the_target_does_not_jump_at_a_set_point(given: bool, built: Built) -> None:
    """At five set-points a second, with and without acceleration, it changes by no more than it must."""
    app, circle = built.app(), Circle(1.0, 1.5)
    app.modes("modeAbs")
    speeds = []
    for update in range(400):
        time_s = 0.01 * update
        if update % 20 == 0:
            acceleration = circle.acceleration(time_s) if given else np.zeros(2)
            app.aim(np.concatenate([circle.target(time_s), acceleration]))
        app.update(np.zeros(7))
        speeds.append(app.logged("targetVx"))
    assert np.abs(np.diff(speeds[100:])).max() < 2.0 * 0.01 * 1.5**2
