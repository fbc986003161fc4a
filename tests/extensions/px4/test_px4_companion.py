"""Flight mode MPC on the desk, with the set-points of a companion: take-over, steps, low rates, bad ones."""

import importlib.util
import math
import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest

from mambo_codegen.settings.controller_toml import with_option
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.trajectories import Circle
from tests.extensions.px4.support import HOLD, MPC, px4_settings
from tests.extensions.px4.support.px4_desk import Px4Desk, build_px4
from tests.support.laps import write_lap

SEEDS = range(2)
CIRCLE = Circle(1.0, 1.5)

Places = Callable[[float], FloatArray]


@pytest.fixture(scope="module")
def module() -> Path:
    """Return the library of the module with the settings that `design crazyflie` writes."""
    return build_px4(px4_settings())


def at(x_m: float, y_m: float = 0.0) -> Places:
    """Return a place to stay at, 1 m high: position, velocity and acceleration (3, 3) by time in s."""
    motion = np.zeros((3, 3))
    motion[0] = x_m, y_m, 1.0
    return lambda _: motion


def around(x_m: float, y_m: float) -> Places:
    """Return a circle about a point, 1 m high."""

    def motion(time_s: float) -> FloatArray:
        place = [*CIRCLE.target(time_s), *CIRCLE.acceleration(time_s)]
        return np.column_stack([np.reshape(place, (3, 2)), np.zeros(3)]) + at(x_m, y_m)(time_s)

    return motion


def without_acceleration(places: Places) -> Places:
    """Return the same motion with an acceleration that is not a number."""

    def motion(time_s: float) -> FloatArray:
        found = places(time_s).copy()
        found[2] = math.nan
        return found

    return motion


def watch(desk: Px4Desk, milliseconds: int) -> float:
    """Let time pass; return the largest change of the attitude set-point from one to the next, in degrees."""
    largest_deg, last_deg = 0.0, desk.angles_deg
    for _ in range(milliseconds):
        desk.run(1)
        largest_deg = max(largest_deg, math.hypot(*(desk.angles_deg - last_deg)))
        last_deg = desk.angles_deg
    return largest_deg


def send(
    desk: Px4Desk, places: Places, duration_s: float, from_s: float = 0.0, period_ms: int = 10
) -> tuple[float, FloatArray]:
    """Send set-points; return the largest change of the attitude set-point, as `watch` does.

    And the distances to where the companion's target is then, (n,) in m.
    """
    desk.set("px4.trajectory", 1)
    largest_deg, distances = 0.0, []
    for k in range(round(1000.0 * duration_s / period_ms)):
        desk.full_state(places(from_s + 0.001 * period_ms * k))
        largest_deg = max(largest_deg, watch(desk, period_ms))
        there = places(from_s + 0.001 * period_ms * (k + 1))[0]
        distances.append(math.hypot(*(desk.state.position_m - there)[:2]))
    return largest_deg, np.array(distances)


class FakeNode:
    """The parts of a ROS 2 node that the companion of the manual uses; its clock is the desk's."""

    now_s = 0.0
    sent: ClassVar[list[Any]] = []

    def __init__(self, name: str) -> None:
        self.name = name

    def get_clock(self) -> Any:
        """Return the clock."""
        return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=round(1e9 * FakeNode.now_s)))

    def create_publisher(self, kind: type[Any], topic: str, qos: object) -> Any:
        """Return a publisher that keeps the messages."""
        assert (kind, topic, qos) == (SimpleNamespace, "/fmu/in/trajectory_setpoint", "sensor data")
        return SimpleNamespace(publish=FakeNode.sent.append)

    def create_timer(self, period_s: float, callback: Callable[[], None]) -> None:
        """Call it at once; the test calls it again."""
        assert period_s == 0.02
        callback()


@pytest.fixture
def companion(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Return the script of the manual, with stand-ins for ROS 2, which is in no package index."""
    stand_ins: dict[str, dict[str, object]] = {
        "rclpy": {},
        "rclpy.executors": {"ExternalShutdownException": RuntimeError},
        "rclpy.node": {"Node": FakeNode},
        "rclpy.qos": {"qos_profile_sensor_data": "sensor data"},
        "px4_msgs": {},
        "px4_msgs.msg": {"TrajectorySetpoint": SimpleNamespace},
    }
    for name, parts in stand_ins.items():
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
        vars(sys.modules[name]).update(parts)
    script = Path(__file__).parents[3] / "docs/how-to/fly_px4.py"
    spec = importlib.util.spec_from_file_location("fly_px4", script)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_plan_is_flown_by_the_companion_of_the_manual(
    module: Path, companion: ModuleType, tmp_path: Path
) -> None:
    """Its set-points lead the drone from elsewhere to the first point, then through all points of the lap."""
    lap = write_lap(tmp_path / "lap.csv")
    desk = Px4Desk(module, 0).select(MPC, 500)
    desk.set("px4.trajectory", 1)
    node = companion.Companion(lap)
    times_s, errors_m = [], []
    for k in range(round((companion.WAIT_S + lap.flown_s) / 0.02)):
        FakeNode.now_s = 0.02 * k
        node.send()
        message = FakeNode.sent.pop()
        sent = np.array([message.position, message.velocity, message.acceleration]) * (1.0, -1.0, -1.0)
        desk.full_state(sent)
        desk.run(20)
        since_s = 0.02 * (k + 1) - companion.WAIT_S
        if since_s >= 0.0:
            (x, y, *_), (z, *_) = lap.target(since_s), lap.vertical(since_s)
            times_s.append(since_s)
            errors_m.append(desk.state.position_m - np.array([x, -y, z]))
    passed = lap.passes(np.array(times_s), np.array(errors_m))
    assert [one.missed for one in passed] == [False, False]


@pytest.mark.parametrize("z_m", [0.0, 0.2])
def test_a_lap_on_the_floor_is_refused(
    z_m: float,
    companion: ModuleType,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Before anything is sent: a level plan has no height, and PX4's place of start is on the ground."""
    write_lap(tmp_path / "lap.csv", z_m)
    monkeypatch.setattr(sys, "argv", ["fly_px4.py", str(tmp_path / "lap.csv")])
    with pytest.raises(SystemExit):
        companion.main()
    assert f"comes down to {z_m:.2f} m" in capsys.readouterr().err


def test_a_take_over_in_hover_has_no_jump(module: Path) -> None:
    """The set-points are 6 cm from where the drone hovers, to which it glides."""
    for seed in SEEDS:
        desk = Px4Desk(module, seed).select(HOLD, 1000)
        send(desk, at(0.05, 0.03), 0.5)
        desk.set("px4.mode", MPC)
        jump_deg, distances = send(desk, at(0.05, 0.03), 4.0)
        assert jump_deg < 1.0
        assert distances[-100:].max() < 0.01


def test_a_take_over_by_a_target_that_moves_far_away_has_no_jump(module: Path) -> None:
    """It is 2 m off, on a circle at 1.5 m/s; the drone joins it."""
    for seed in SEEDS:
        desk = Px4Desk(module, seed).select(HOLD, 1000)
        center = np.array([2.0, 0.0]) - CIRCLE.target(1.0)[:2]
        send(desk, around(*center), 1.0)
        desk.set("px4.mode", MPC)
        jump_deg, distances = send(desk, around(*center), 10.0, from_s=1.0)
        assert distances[0] == pytest.approx(2.0, abs=0.1)
        assert jump_deg < 5.0
        assert distances[500:].max() < 0.04


def test_a_step_of_the_target_is_flown_as_a_glide(module: Path) -> None:
    """3 m: nine tenths within 2.6 s, and not beyond; the attitude moves by less than 5 degrees at once."""
    for seed in SEEDS:
        desk = Px4Desk(module, seed).select(MPC, 500)
        send(desk, at(0.0), 1.0)
        jump_deg, distances = send(desk, at(3.0), 8.0)
        assert jump_deg < 5.0
        assert distances[260] < 0.3
        assert desk.state.position_m[0] == pytest.approx(3.0, abs=0.02)
        assert distances[400:].max() < 0.05


@pytest.mark.parametrize(
    ("drag_1_s", "wind_m_s", "is_said"), [(0.244, 4.0, False), (1.0, 0.0, True), (1.0, 2.0, True)]
)
def test_a_drone_with_another_drag_is_said_once(
    drag_1_s: float, wind_m_s: float, is_said: bool, module: Path
) -> None:
    """With its drag, that of the settings and the cure; wind, which is steady, does not count."""
    desk = Px4Desk(module, drag_1_s=drag_1_s, wind_m_s=(wind_m_s, 0.0)).select(MPC, 500)
    send(desk, around(0.0, 0.0), 20.0)
    assert desk["s.drag"] == pytest.approx(drag_1_s, abs=0.1)
    assert desk["s.differences"] == is_said
    said = [line for line in desk.console.splitlines() if line]
    assert len(said) == is_said
    if is_said:
        assert re.match(r"GCS: MPC: drag (0\.9|1\.0)\d 1/s, settings 0\.24: identify this drone$", said[0])


@pytest.mark.parametrize(("share", "is_said"), [(0.7, True), (0.9, False)])
def test_a_thrust_of_hover_that_is_far_off_is_said_once(share: float, is_said: bool, module: Path) -> None:
    """PX4 believes in less thrust than carries the drone: the learnt gain says so."""
    desk = Px4Desk(module)
    desk.set("px4.hover", share * desk["throttle"])
    desk.run(600)
    desk.select(MPC, 12000)
    assert desk["s.thrust_gain"] == pytest.approx(share, abs=0.02)
    assert desk["s.differences"] == (2.0 if is_said else 0.0)
    words = "GCS: MPC: thrust 0.70 times as in the settings: identify this drone"
    assert desk.console.count(words) == is_said
    assert desk["mode"] == MPC


def test_a_learnt_gain_that_is_far_off_is_said_once() -> None:
    """A drone that rolls 1.43 times as far as the settings say."""
    learns = with_option(px4_settings(), "observer.tilt_gain", "learnt")
    desk = Px4Desk(build_px4(with_option(learns, "model.roll_gain", 0.7))).select(MPC, 500)
    send(desk, around(0.0, 0.0), 15.0)
    assert desk["s.roll_gain"] == pytest.approx(1.0 / 0.7, abs=0.03)
    assert desk["s.differences"] == 4.0
    assert desk.console.count("GCS: MPC: roll 1.4") == desk.console.count("GCS") == 1


TRIM = with_option(px4_settings(), "model.roll_trim_rad", math.radians(0.9))
TURNS = (0.0, 1.5, -1.5, 3.0)
"""Rates of the heading in rad/s, on a circle at 1.5 rad/s."""


def turning_cm(library: Path) -> dict[float, float]:
    """Return the RMS distance from the circle in cm by the rate of the heading, from 5 s on."""
    found = {}
    for rate_rad_s in TURNS:
        desk = Px4Desk(library).select(MPC, 500)
        desk.set("px4.trajectory", 1)
        distances = []
        for k in range(1200):
            motion = around(0.0, 0.0)(0.01 * k)
            distances.append(math.hypot(*(desk.state.position_m - motion[0])[:2]))
            desk.full_state(motion, math.remainder(0.01 * rate_rad_s * k, 2.0 * math.pi))
            desk.run(10)
        found[rate_rad_s] = 100.0 * math.sqrt(np.mean(np.square(distances[500:])))
    return found


def test_a_heading_that_turns_costs_little_unless_the_settings_have_a_trim_of_their_own() -> None:
    """A trim that the drone has not is learnt as wind is, but it turns with the drone."""
    right, wrong = turning_cm(build_px4(px4_settings())), turning_cm(build_px4(TRIM))
    assert max(right.values()) < 1.4
    assert wrong[0.0] == pytest.approx(right[0.0], abs=0.05)
    assert all(wrong[rate] > right[rate] + 0.2 for rate in TURNS[1:])


def test_an_acceleration_that_is_not_a_number_is_not_known() -> None:
    """The controller finds it from the velocities, and the drone flies the circle as closely."""
    desk = Px4Desk(build_px4(px4_settings())).select(MPC, 500)
    assert desk["s.target_known"] == 1.0, "a target that the sticks move"
    _, given = send(desk, around(0.0, 0.0), 8.0)
    assert desk["s.target_known"] == 1.0
    _, found = send(desk, without_acceleration(around(0.0, 0.0)), 8.0, from_s=8.0)
    assert desk["s.target_known"] == 0.0
    assert found[300:].max() < given[300:].max() + 0.01
    desk.set("px4.trajectory", 0)
    desk.run(1000)
    assert desk["s.target_known"] == 1.0


def test_a_take_over_in_wind_by_set_points_without_acceleration_has_no_jump() -> None:
    """The drone leans against the wind; the acceleration counts until the controller has learnt it."""
    for seed in SEEDS:
        desk = Px4Desk(build_px4(px4_settings()), seed, wind_m_s=(4.0, 0.0)).select(HOLD, 4000)
        here = without_acceleration(at(*desk.state.position_m[:2]))
        send(desk, here, 0.5)
        desk.set("px4.mode", MPC)
        first_deg, _ = send(desk, here, 0.1)
        assert desk["s.target_known"] == 2.0
        jump_deg, distances = send(desk, here, 15.0)
        assert desk["s.target_known"] == 0.0
        assert max(first_deg, jump_deg) < 1.0
        assert distances.max() < 0.1


LATE = {500: (10.0, 0.5), 200: (8.25, 0.165), 50: (1.65, 0.05)}
"""Largest change in degrees, largest distance in m, by the period of the set-points in ms."""


@pytest.mark.parametrize("period_ms", LATE)
def test_rare_set_points_are_carried_on(period_ms: int, module: Path) -> None:
    """By their velocity and acceleration; where the next one is elsewhere the target glides there."""
    most_deg, most_m = LATE[period_ms]
    desk = Px4Desk(module).select(MPC, 500)
    send(desk, around(0.0, 0.0), 4.0)
    jump_deg, distances = send(desk, around(0.0, 0.0), 12.0, from_s=4.0, period_ms=period_ms)
    assert jump_deg < most_deg
    assert distances.max() < most_m


def test_a_companion_that_falls_silent_leaves_a_target_that_brakes(module: Path) -> None:
    """From 1.5 m/s without a jump, and within 4 m."""
    desk = Px4Desk(module).select(MPC, 500)
    send(desk, around(0.0, 0.0), 4.0)
    desk.set("px4.trajectory", 0)
    before = desk.state.position_m
    assert watch(desk, 4000) < 3.2
    assert np.abs(desk.state.velocity_m_s).max() < 0.05
    assert math.hypot(*(desk.state.position_m - before)[:2]) < 4.0


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e30, -5000.0])
def test_a_set_point_that_the_controller_cannot_take_stands_for_none(value: float, module: Path) -> None:
    """The target brakes to a stop, and glides on when good ones come back."""
    desk = Px4Desk(module).select(MPC, 500)
    send(desk, at(0.5), 4.0)
    desk.set("px4.setpoint_x", value)
    jump_deg, distances = send(desk, at(0.5), 2.0)
    desk.set("px4.setpoint_x", 0.5)
    after_deg, _ = send(desk, at(0.5), 4.0)
    assert max(jump_deg, after_deg) < 5.0
    assert distances.max() < 0.02
    assert desk.state.position_m[0] == pytest.approx(1.0, abs=0.02)
    assert (desk["mode"], desk["s.take_overs"]) == (MPC, 1.0)


@pytest.mark.parametrize(("follows", "farthest_m"), [(True, 0.02), (False, 0.22)])
def test_a_companion_may_follow_the_estimator_s_jump_or_not(
    follows: bool, farthest_m: float, module: Path
) -> None:
    """One that moves its set-points with the frame moves nothing; to those of another the drone glides."""
    for seed in SEEDS:
        desk = Px4Desk(module, seed).select(MPC, 500)
        send(desk, at(0.0), 2.0)
        desk.set("px4.jump_x", 0.2)
        if not follows:
            desk.set("px4.setpoint_x", -0.2)
        jump_deg, distances = send(desk, at(0.0), 10.0)
        assert jump_deg < (1.0 if follows else 2.5)
        assert distances.max() < farthest_m
        assert desk.state.position_m[0] == pytest.approx(0.0 if follows else -0.2, abs=0.01)
