"""Controllers with the height as a third axis, and the hint that an altitude loop rests beside its target."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.controller_toml import to_toml
from mambo_nmpc import ArgumentError, Controller, DroneState, TargetState, Vehicle, fly
from mambo_nmpc.curves import curve
from mambo_sil.api.options import ControllerOptions
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.height_profiles import HOVER_HEIGHT_M
from mambo_sil.flight.names import AltitudeName, CurveName
from tests.support.height_settings import height_settings

RNG = np.random.default_rng(8)
REST = np.zeros((2, 3))
STATE, GOAL = DroneState([0, 0, -1], [0, 0, 0], [0, 0, 0]), TargetState([0, 0, -1], [0, 0, 0])


@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_a_step_has_the_bits_of_the_compiled_controller(scalar: str) -> None:
    """Through reset, report_command and report_thrust; z points down, the height of the C up."""
    settings = height_settings(scalar)
    ours, theirs = Controller(settings, 2), CompiledController(settings, 2)
    position, velocity, attitude, *aims = RNG.normal(0.0, 0.2, (7, 2, 3))
    for on_ground in (np.array([False, True]), np.zeros(2, np.bool_)):
        state = [position[:, :2], velocity[:, :2], attitude, -position[:, 2:], -velocity[:, 2:]]
        aimed = [*(aim[:, :2] for aim in aims[:3]), *(-aim[:, 2:] for aim in aims[:3])]
        target = [*aimed, aims[3][:, :2], -aims[3][:, 2:], np.full(2, 2.0)]
        for _ in range(3):
            expected = theirs.step(np.column_stack([*state, on_ground]), np.column_stack(target))
            found = ours.step(
                DroneState(position, velocity, attitude, on_ground),
                TargetState(*aims[:3], ahead_m_s2=aims[3]),
            )
            assert (found.command_rad == expected.command_rad).all()
            assert (found.thrust_m_s2 == expected.thrust_m_s2).all()
            assert (found.status == 0).all()
        assert (ours.report_thrust([10.0, np.nan]) == theirs.report_thrust([10.0, np.nan])).all()
        assert ours.__getstate__()["instances"] == theirs.instances.tobytes()
        for thrusts in ([10.0, expected.thrust_m_s2[1]], [10.5, 9.0]):  # reported, commanded, reported
            assert (ours.report_command((0.05, -0.1)) == 0).all()
            theirs.report_command(np.column_stack([[[0.05, -0.1]] * 2, thrusts]))
            assert ours.__getstate__()["instances"] == theirs.instances.tobytes()
            ours.report_thrust([10.5, 9.0])
            theirs.report_thrust([10.5, 9.0])
        assert (ours.report_command((0.1, 0.0), 11.0) == theirs.report_command([[0.1, 0.0, 11.0]] * 2)).all()
        assert ours.__getstate__()["instances"] == theirs.instances.tobytes()
        assert (ours.frame_jumped([0.1, 0.2, -0.3], [0.01, 0.0, 0.02], [0.1, np.nan]) == [0, 8]).all()
        theirs.frame_jumped([[0.1, 0.2, 0.3, 0.01, 0.0, -0.02, yaw_rad] for yaw_rad in (0.1, np.nan)])
        assert ours.__getstate__()["instances"] == theirs.instances.tobytes()
        assert (ours.reset((0.1, 0.0), thrust_m_s2=[9.0, 8.0]) == 0).all()
        theirs.reset([[0.1, 0.0, 9.0], [0.1, 0.0, 8.0]])
        assert ours.__getstate__()["instances"] == theirs.instances.tobytes()


def test_the_heading_that_is_held_turns_with_the_frame() -> None:
    """A drone that keeps the heading of its first step keeps it in the body, too, when the frame turns."""
    ours = Controller(height_settings())
    assert ours.step(STATE, GOAL).yaw_rad == 0.0
    assert ours.frame_jumped([0.0, 0.0, 0.0], heading_change_rad=0.5) == 0
    turned = DroneState([0, 0, -1], [0, 0, 0], [0, 0, 0.5])
    assert ours.step(turned, GOAL).yaw_rad == 0.5


@pytest.mark.long
def test_a_reset_hovers_unless_a_thrust_is_reported() -> None:
    """The first command after it is that of a new controller."""
    ours, new = Controller.from_vehicle("crazyflie"), Controller.from_vehicle("crazyflie")
    above = TargetState([0.0, 0.0, -1.01], np.zeros(3))
    first = thrust_of(new, above)
    assert thrust_of(ours, above) == first
    assert thrust_of(ours, above) != first
    ours.reset()
    assert thrust_of(ours, above) == first
    ours.reset(thrust_m_s2=12.0)
    assert thrust_of(ours, above) != first


def thrust_of(pilot: Controller, target: TargetState, state: DroneState | None = None) -> float:
    """Return the thrust of a step at 1 m, or in another state."""
    thrust = pilot.step(state or STATE, target).thrust_m_s2
    assert thrust is not None
    return float(thrust)


def test_limits_of_the_height_are_arguments(tmp_path: Path) -> None:
    """Floor, ceiling, climb and descent are those keys of the settings, from drone and file; 3 m become 2."""
    (tmp_path / "c.toml").write_text(to_toml(height_settings()), "utf-8")
    options: ControllerOptions = {"floor_m": 0.5, "ceiling_m": 2.0, "climb_m_s": 1.0, "descent_m_s": 0.5}
    pilot = Controller.from_file(tmp_path / "c.toml", **options)
    for made in (pilot, Controller.from_vehicle("crazyflie", **options)):
        fence, height = made.settings.limits.fence, made.settings.height
        assert (fence.floor_m, fence.ceiling_m, fence.x_max_m) == (0.5, 2.0, 0.0)
        assert height is not None
        assert (height.climb_m_s, height.descent_m_s) == (1.0, 0.5)
    below = DroneState([0.0, 0.0, -1.99], np.zeros(3), np.zeros(3))
    at, over = (TargetState([0.0, 0.0, -height_m], np.zeros(3)) for height_m in (2.0, 3.0))
    pilots = (pilot, Controller.from_file(tmp_path / "c.toml", **options))
    assert thrust_of(pilots[0], at, below) == thrust_of(pilots[1], over, below)


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda it: it.step(DroneState([0, 0], [0, 0], [0, 0, 0]), GOAL), "state: position_m has no z"),
        (lambda it: it.step(STATE, TargetState([0, 0, 0], [0, 0])), "target: velocity_m_s has no z"),
        (lambda it: it.step(STATE, GOAL, 9.81), r"thrust_acceleration_m_s2 = 9\.81 must be left out"),
        (lambda it: it.frame_jumped([0.1, 0.2]), r"position_change_m: has no z"),
        (
            lambda it: it.frame_jumped([0.1, 0.2, 0.3, 0.4]),
            r"position_change_m: has shape \(4,\); it must be",
        ),
        (lambda it: it.frame_jumped([0.1, 0.2, 0.3], 0.1), r"velocity_change_m_s: has shape \(\)"),
        (
            lambda it: it.frame_jumped([0, 0, 0], None, [0, 1]),
            r"heading_change_rad: has shape \(2,\); it must be",
        ),
        (lambda it: it.report_thrust([9.0, 9.0]), r"thrust_m_s2: has shape \(2,\); it must be"),
        (lambda _: DroneState([0, 0, 0], [0, 0, 0], [0, 0, 0], 1), "on_ground = 1 must be a truth value"),
        (lambda _: DroneState(REST, REST, REST, [True] * 3), r"on_ground = .* or such of shape \(2,\)"),
    ],
)
def test_wrong_arguments_are_refused(call: Any, message: str) -> None:
    """By name, with what to do."""
    with pytest.raises(ArgumentError, match=message):
        call(Controller.from_vehicle("crazyflie"))


@pytest.mark.long
def test_what_needs_a_height_says_so() -> None:
    """And a known acceleration has three components."""
    level = Controller.from_preset("crazyflie")
    with pytest.raises(ArgumentError, match=r"report_thrust needs settings with \[height\]"):
        level.report_thrust(9.81)
    with pytest.raises(
        ArgumentError, match=r"thrust_m_s2 = 9\.0 must be left out: the settings have no \[hei"
    ):
        level.reset(thrust_m_s2=9.0)
    observing = Controller.from_vehicle("crazyflie")
    with pytest.raises(ArgumentError, match="target: acceleration_m_s2 has no z"):
        observing.step(STATE, TargetState([0, 0, -1], [0, 0, 0], [0, 0]))


def test_a_wrong_mass_leaves_no_error_of_height() -> None:
    """On a point mass of 1.2 times the weight: the gain of the thrust is learnt."""
    pilot, z, climb = Controller.from_vehicle("crazyflie"), 1.0, 0.0
    for _ in range(500):
        state = DroneState.in_frame("NWU", [0.0, 0.0, z], [0.0, 0.0, climb], [0.0, 0.0, 0.0])
        climb += 0.01 * (thrust_of(pilot, GOAL, state) / 1.2 - GRAVITY_M_S2)
        z += 0.01 * climb
    assert abs(z - 1.0) < 0.001


def test_a_target_on_the_floor_gets_the_least_thrust_there() -> None:
    """While the drone touches it; in the air it does not."""
    pilot, at_rest = Controller.from_vehicle("crazyflie"), np.zeros(3)
    on_it, below = DroneState(at_rest, at_rest, at_rest, True), TargetState(at_rest, at_rest)
    assert pilot.settings.height is not None
    least = pilot.settings.height.thrust_min_m_s2
    np.testing.assert_allclose([thrust_of(pilot, below, on_it) for _ in range(3)], least, rtol=1e-6)
    assert thrust_of(pilot, GOAL, on_it) > least


def test_flights_in_space_follow_the_height() -> None:
    """By `fly`; a level curve at its height."""
    controller, vehicle = (
        Controller.from_vehicle("crazyflie", measurement_age_s=0.0),
        Vehicle.from_preset("crazyflie"),
    )
    names: tuple[CurveName, ...] = ("helix", "circle")
    for name in names:
        flown = fly(controller, vehicle, curve(name, 1.0, 1.0), duration_s=6.0)
        assert not flown.crashed.any()
        target = flown.trace.target[:, 0, 4] if name == "helix" else HOVER_HEIGHT_M
        assert np.abs(flown.trace.position_m[300:, 0, 2] + np.broadcast_to(target, 601)[300:]).max() < 0.01


ALOFT_M = np.array([[0.0, 0.0, -1.0]] * 2)


def hold(height: AltitudeName, off_m: float, steps: int = 220, **how: Any) -> None:
    """Let two drones rest, of which the second is lower than its target."""
    pilot = Controller.from_preset("crazyflie", 2, vehicle="crazyflie", height=height, measurement_age_s=0.0)
    low = ALOFT_M + np.array([[0.0, 0.0, 0.0], [0.0, 0.0, off_m]])
    climb = np.array([0.0, 0.0, how.get("climb_m_s", 0.0)])
    state = DroneState(low, np.zeros((2, 3)) - climb, np.zeros((2, 3)), how.get("on_ground", False))
    for _ in range(steps):
        pilot.step(state, TargetState(ALOFT_M, np.zeros((2, 3)) - climb))


@pytest.mark.parametrize(
    ("off_m", "words"),
    [(0.055, "55 mm below its target: it has 8 % less thrust"), (-0.1, "100 mm above .* 15 % more thrust")],
)
def test_a_drone_that_stays_low_is_named_once(off_m: float, words: str) -> None:
    """With the share of the thrust: the gain of 15 1/s^2 times the distance, over 9.81."""
    with pytest.warns(UserWarning, match=words) as said:
        hold("feedforward", off_m, steps=500)
    assert len(said) == 1
    assert "than vehicle crazyflie; write its mass_kg and [thrust]" in str(said[0].message)


@pytest.mark.parametrize(
    ("height", "off_m", "steps", "how"),
    [
        ("pid", 0.055, 500, {}),  # its integral takes it away
        ("feedforward", 0.02, 500, {}),
        ("feedforward", 1.0, 500, {}),  # motors that are not armed
        ("feedforward", 0.055, 190, {}),  # less than 2 s
        ("feedforward", 0.055, 500, {"climb_m_s": 0.2}),
        ("feedforward", 0.055, 500, {"on_ground": True}),
    ],
)
def test_nothing_is_said_elsewhere(
    height: AltitudeName, off_m: float, steps: int, how: dict[str, Any]
) -> None:
    """Of a small error, a short one, a climb, the floor, or a loop with an integral."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        hold(height, off_m, steps, **how)
