"""The interface for programs: the C's bits, shapes that are checked, frames that agree with rotations."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import mambo_nmpc
from mambo_codegen.errors import InvalidSettingsError, SourceNotFoundError
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import to_toml, with_option
from mambo_nmpc import (
    Controller,
    DroneState,
    TargetState,
    Vehicle,
    attitude_of_quaternion,
    command_in_frame,
    fly,
)
from mambo_sil.errors import FlightError
from mambo_sil.flight.api.frames import FrameName, attitude_to_ned, horizontal_to_ned
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.trajectories import Circle
from tests.support.one_norm import ONE_NORM

DOCUMENT = Path(__file__).parents[3] / "docs" / "reference" / "python.md"
LEVEL = DroneState(np.zeros((2, 2)), np.zeros((2, 2)), np.zeros((2, 3)))
AHEAD = TargetState(np.array([[1.0, 0.0], [0.3, -0.2]]), np.zeros((2, 2)))
AXES: dict[FrameName, NDArray[np.float64]] = {
    "NED": np.eye(3),
    "ENU": np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
    "NWU": np.diag([1.0, -1.0, -1.0]),
}
"""North, east and down of the world's axes in each frame."""


def test_the_examples_of_the_document_run() -> None:
    """One after another, as a reader types them; their assertions hold."""
    blocks = [block.partition("```")[0] for block in DOCUMENT.read_text("utf-8").split("```python\n")[1:]]
    assert len(blocks) == 4
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, str(DOCUMENT), "exec"), names)


def test_importing_the_package_imports_nothing_else() -> None:
    """The command line imports it before its first word."""
    script = "import sys, mambo_nmpc; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert not {"numpy", "pydantic", "mambo_sil"} & set(done.stdout.split())


def test_every_name_is_there() -> None:
    """Also for completion; others are refused as those of any module."""
    for name in mambo_nmpc.__all__:
        assert getattr(mambo_nmpc, name).__doc__
        assert name in dir(mambo_nmpc)
    with pytest.raises(AttributeError, match="no attribute 'Drone'"):
        mambo_nmpc.Drone  # type: ignore[attr-defined] # noqa: B018 - that it is not there is the test


def test_a_step_has_the_bits_of_the_compiled_controller() -> None:
    """Through reset and set_command, for each of n drones."""
    ours, other = Controller.from_preset("crazyflie", 2), CompiledController(presets.load("crazyflie"), 2)
    state, target = np.zeros((2, 7)), np.array([[1.0, 0.0, 0.0, 0.0], [0.3, -0.2, 0.0, 0.0]])
    thrust = np.full(2, 9.81)
    for _ in range(3):
        assert (
            ours.step(LEVEL, AHEAD).command_rad.tobytes()
            == other.step(state, target, thrust).command_rad.tobytes()
        )
    assert (ours.set_command((0.1, -0.1)) == other.set_command([[0.1, -0.1]] * 2)).all()
    assert (
        ours.step(LEVEL, AHEAD, 9.0).command_rad == other.step(state, target, thrust - 0.81).command_rad
    ).all()
    first = Controller.from_preset("crazyflie", 2).step(LEVEL, AHEAD)
    assert (ours.reset() == 0).all()
    assert (ours.step(LEVEL, AHEAD).command_rad == first.command_rad).all()


def test_settings_come_from_a_file_or_a_preset(tmp_path: Path) -> None:
    """Errors are those of the command line."""
    (tmp_path / "mine.toml").write_text(to_toml(ONE_NORM), "utf-8")
    one_norm = Controller.from_file(tmp_path / "mine.toml")
    assert one_norm.settings == ONE_NORM
    with pytest.raises(ValueError, match="set_command needs cost"):
        one_norm.set_command((0.0, 0.0))
    with pytest.raises(SourceNotFoundError, match="did you mean crazyflie"):
        Controller.from_preset("crazyfly")
    (tmp_path / "mine.toml").write_text("[horizon]\ncontrol = 11\n", "utf-8")
    with pytest.raises(InvalidSettingsError, match=r"horizon\.control = 11 must lie in 1\.\.10"):
        Controller.from_file(tmp_path / "mine.toml")
    with pytest.raises(SourceNotFoundError):
        Vehicle.from_preset("crazyfly")
    (tmp_path / "drone.toml").write_text("[body]\nmass_kg = -1.0\n", "utf-8")
    with pytest.raises(InvalidSettingsError, match=r"body\.mass_kg"):
        Vehicle.from_file(tmp_path / "drone.toml")


def test_wrong_shapes_are_refused_by_name() -> None:
    """And records of another number of drones."""
    with pytest.raises(ValueError, match=r"velocity_m_s: has shape \(3, 2\); it must be \(2, 2\)"):
        DroneState(np.zeros((2, 2)), np.zeros((3, 2)), np.zeros((2, 3)))
    with pytest.raises(ValueError, match=r"position_m: has shape \(3,\); it must be \(1, 2\)"):
        TargetState(np.zeros(3), np.zeros(2))
    with pytest.raises(ValueError, match="target: has 1 drones; the controller was made for 2"):
        Controller.from_preset("crazyflie", 2).step(LEVEL, TargetState(np.zeros(2), np.zeros(2)))
    with pytest.raises(ValueError, match="n = 0 must be 1 or more"):
        Controller.from_preset("crazyflie", 0)


def test_a_target_may_tell_its_acceleration() -> None:
    """Where the settings ask for it; without it they are refused, and others ignore it."""
    settings = with_option(presets.load("crazyflie"), "target.acceleration", "given")
    given, other = Controller(settings), CompiledController(settings)
    state = DroneState.in_frame("ENU", np.zeros(3), np.zeros(3), np.array([0.0, 0.0, np.pi / 2.0]))
    north = np.array([0.0, 1.0, 0.0])
    target = TargetState.in_frame("ENU", np.zeros(3), np.zeros(3), north)
    command_rad = given.step(state, target).command_rad
    told = np.array([[0.0, 0.0, 0.0, 0.0, 1.0, 0.0]])
    assert command_rad[0, 1] < 0.0
    assert (command_rad == other.step(np.zeros((1, 7)), told, np.array([9.81])).command_rad).all()
    with pytest.raises(ValueError, match="target: acceleration_m_s2 is missing"):
        given.step(state, TargetState(np.zeros(2), np.zeros(2)))
    assert (Controller.from_preset("crazyflie").step(state, target).command_rad == 0.0).all()
    with pytest.raises(ValueError, match="acceleration_m_s2: has shape"):
        TargetState(np.zeros(2), np.zeros(2), np.zeros(3))


def test_bad_numbers_give_a_status_and_no_exception() -> None:
    """As on a board."""
    outcome = Controller.from_preset("crazyflie").step(
        DroneState(np.array([np.nan, 0.0]), np.zeros(2), np.zeros(3)), TargetState(np.zeros(2), np.zeros(2))
    )
    assert outcome.status[0] != 0
    assert np.isfinite(outcome.command_rad).all()


@pytest.mark.parametrize("frame", AXES)
def test_frames_agree_with_rotations(frame: FrameName) -> None:
    """Vectors and attitudes are those of rotation matrices between the axes of world and body."""
    world, body = AXES[frame], np.diag([1.0, -1.0, -1.0]) if frame != "NED" else np.eye(3)
    random = np.random.default_rng(3)
    vectors = random.normal(size=(20, 3))
    np.testing.assert_allclose(horizontal_to_ned(frame, vectors), (vectors @ world.T)[:, :2])
    rotations = Rotation.from_euler("ZYX", random.uniform(-1.5, 1.5, (20, 3)))
    angles = attitude_of_quaternion(rotations.as_quat())
    np.testing.assert_allclose(angles[:, ::-1], rotations.as_euler("ZYX"), atol=1e-12)
    theirs = Rotation.from_matrix(world @ rotations.as_matrix() @ body.T)
    ours = Rotation.from_euler("ZYX", attitude_to_ned(frame, angles)[:, ::-1])
    np.testing.assert_allclose((ours.inv() * theirs).magnitude(), 0.0, atol=1e-7)
    np.testing.assert_array_equal(
        command_in_frame(frame, angles[:, :2]), attitude_to_ned(frame, angles)[:, :2]
    )


@pytest.mark.parametrize("frame", AXES)
def test_a_drone_in_any_frame_gets_the_same_command(frame: FrameName) -> None:
    """State and target told in another frame, and the command turned back to it."""
    world = AXES[frame].T
    ned = DroneState(np.array([0.2, -0.1]), np.array([0.3, 0.4]), np.array([0.05, -0.1, 0.7]))
    goal = TargetState(np.array([0.4, 0.3]), np.array([0.1, 0.0]))

    def vector(of: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.append(of[0], 0.0) @ world.T

    told = DroneState.in_frame(
        frame, vector(ned.position_m), vector(ned.velocity_m_s), attitude_to_ned(frame, ned.attitude_rad[0])
    )
    aim = TargetState.in_frame(frame, vector(goal.position_m), vector(goal.velocity_m_s))
    here = Controller.from_preset("crazyflie").step(ned, goal).command_rad
    there = Controller.from_preset("crazyflie").step(told, aim).command_rad
    np.testing.assert_allclose(there, here, atol=1e-6)


def test_a_flight_is_that_of_the_command_and_leaves_the_controller_alone() -> None:
    """By name or as an object, one for each seed, on a drone that may differ from its file."""
    controller, vehicle = Controller.from_preset("crazyflie"), Vehicle.from_preset("crazyflie")
    memory = controller.step(
        DroneState(np.zeros(2), np.zeros(2), np.zeros(3)), TargetState(np.ones(2), np.zeros(2))
    )
    named = fly(
        controller,
        vehicle,
        "circle",
        size_m=1.0,
        rate_rad_s=1.5,
        duration_s=2.0,
        sensors="mocap",
        seeds=(1, 2),
    )
    given = fly(controller, vehicle, Circle(1.0, 1.5), duration_s=2.0, sensors="mocap", seeds=(1, 2))
    alone = fly(controller, vehicle, Circle(1.0, 1.5), duration_s=2.0, sensors="mocap", seeds=(2,))
    assert named.trace.same_bits(given.trace)
    assert named.trace.digest(1) == alone.trace.digest()
    assert named.metrics.iae_m_s.shape == named.crashed.shape == (2,)
    windy = fly(controller, replace(vehicle, wind_m_s2=(5.0, 0.0)), duration_s=2.0)
    calm = fly(controller, vehicle, duration_s=2.0)
    assert windy.metrics.max_error_m[0] > calm.metrics.max_error_m[0]
    again = Controller.from_preset("crazyflie")
    again.step(DroneState(np.zeros(2), np.zeros(2), np.zeros(3)), TargetState(np.ones(2), np.zeros(2)))
    later = [
        each.step(DroneState(np.zeros(2), np.zeros(2), np.zeros(3)), TargetState(np.ones(2), np.zeros(2)))
        for each in (controller, again)
    ]
    assert (later[0].command_rad == later[1].command_rad).all()
    assert memory.status[0] == 0
    with pytest.raises(FlightError, match='sensors = "mambo"'):
        fly(controller, vehicle, sensors="mambo")
