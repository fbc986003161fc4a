"""The interface for programs: the C's bits, shapes that are checked, frames that agree with rotations."""

import copy
import subprocess
import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import mambo_nmpc
from mambo_codegen.errors import InvalidSettingsError, SourceNotFoundError
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import to_toml
from mambo_nmpc import (
    ArgumentError,
    Controller,
    DroneState,
    MamboNmpcError,
    TargetState,
    Vehicle,
    attitude_of_quaternion,
    command_in_frame,
    fly,
)
from mambo_sil.drone.plant.airframe import MAMBO
from mambo_sil.errors import FlightError
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.frames import FrameName, attitude_to_ned, vectors_to_ned
from mambo_sil.flight.trajectories import Circle
from tests.support.one_norm import ONE_NORM

DOCUMENT = Path(__file__).parents[2] / "docs" / "reference" / "python.md"
LEVEL = DroneState(np.zeros((2, 2)), np.zeros((2, 2)), np.zeros((2, 3)))
AHEAD = TargetState(np.array([[1.0, 0.0], [0.3, -0.2]]), np.zeros((2, 2)))
AXES: dict[FrameName, NDArray[np.float64]] = {
    "NED": np.eye(3),
    "ENU": np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
    "NWU": np.diag([1.0, -1.0, -1.0]),
}
"""North, east and down of the world's axes in each frame."""


@pytest.mark.long
def test_the_examples_of_the_document_run() -> None:
    """One after another, as a reader types them; their assertions hold."""
    blocks = [block.partition("```")[0] for block in DOCUMENT.read_text("utf-8").split("```python\n")[1:]]
    assert len(blocks) == 7
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
    """Through reset and report_command, for each of n drones."""
    ours, other = Controller.from_preset("crazyflie", 2), CompiledController(presets.load("crazyflie"), 2)
    state, target = np.zeros((2, 7)), np.zeros((2, 9))
    target[:, :2] = [1.0, 0.0], [0.3, -0.2]
    thrust = np.full(2, 9.81)
    for _ in range(3):
        assert (
            ours.step(LEVEL, AHEAD).command_rad.tobytes()
            == other.step(state, target, thrust).command_rad.tobytes()
        )
    assert (ours.report_command((0.1, -0.1)) == other.report_command([[0.1, -0.1]] * 2)).all()
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
    with pytest.raises(ValueError, match="report_command needs controller"):
        one_norm.report_command((0.0, 0.0))
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
    with pytest.raises(ValueError, match=r"velocity_m_s: has shape \(3, 2\); it must be \(2, 2\) or"):
        DroneState(np.zeros((2, 2)), np.zeros((3, 2)), np.zeros((2, 3)))
    with pytest.raises(ValueError, match=r"position_m: has shape \(4,\); it must be \(\.\.\., 2\) or"):
        TargetState(np.zeros(4), np.zeros(2))
    with pytest.raises(ValueError, match=r"yaw_rad: has shape \(3,\); it must be \(\) or \(2,\)"):
        TargetState(np.zeros((2, 2)), np.zeros((2, 2)), yaw_rad=np.zeros(3))
    with pytest.raises(ValueError, match="target: has 1 drones; the controller was made for 2"):
        Controller.from_preset("crazyflie", 2).step(LEVEL, TargetState(np.zeros(2), np.zeros(2)))
    with pytest.raises(ValueError, match="n = 0 must be a whole number in 1"):
        Controller.from_preset("crazyflie", 0)


class Moving:
    """A trajectory of a program's own, whose arrays have shapes by the number of times."""

    def __init__(
        self, target: Callable[[int], tuple[int, ...]], acceleration: Callable[[int], tuple[int, ...]]
    ) -> None:
        self._shapes = target, acceleration

    def target(self, time_s: Any) -> Any:
        """Return zeros."""
        return np.zeros(self._shapes[0](len(time_s)))

    def acceleration(self, time_s: Any) -> Any:
        """Return zeros."""
        return np.zeros(self._shapes[1](len(time_s)))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (
            {"sensors": "x"},
            'sensors = "x" must be "true" or "mocap" or "flow-deck" or "autopilot" or "mambo"',
        ),
        ({"sensors": None}, "sensors = None must be"),
        ({"sensors": "mocap"}, r'sensors = "mocap" needs its figures, \[sensors\], in the file'),
        ({"start": "landed"}, 'start = "landed" must be "hover" or "take-off"'),
        (
            {"trajectory": "eight"},
            'trajectory = "eight" must be "bernoulli", "gerono", "lissajous", "circle"',
        ),
        ({"trajectory": None}, "trajectory = None must be"),
        ({"trajectory": Circle}, "trajectory = .* or an object with the methods target and acceleration"),
        (
            {"trajectory": Moving(lambda k: (k, 4), lambda k: (2, k))},
            r"trajectory: acceleration\(\) has shape \(2, 800\) for 800 times",
        ),
        ({"trajectory": Moving(lambda k: (k, 2, 4), lambda k: (k, 2))}, "flights = 1 must be 2"),
        *(({"size_m": value}, r"size_m = .* must lie in -1000\.\.1000") for value in (np.nan, 1e300)),
        *(({"rate_rad_s": value}, r"rate_rad_s = .* must lie in -100\.\.100") for value in (np.nan, 1e300)),
        *(({"duration_s": value}, r"duration_s = .* in 0\.\.3600") for value in (np.nan, -1.0, 1e300)),
        ({"duration_s": 0.0}, "duration_s = 0 must be finite and at least"),
        ({"size_m": "2"}, 'size_m = "2" must be numbers'),
        ({"size_m": [1.0, 2.0]}, r"size_m: has shape \(2,\); it must be \(\)"),
        ({"yaw_rad": [0.0, 0.1]}, r"yaw_rad: has shape \(2,\); it must be \(1,\)"),
        ({"yaw_rad": np.nan}, "yaw_rad = nan must lie"),
        *(
            ({"seeds": value}, "seeds = .* must be whole numbers in 0")
            for value in (3, (), (-1,), (0.5,), "1")
        ),
        ({"push_m_s2": (0.5,)}, r"push_m_s2 = \(0\.5,\) must be a tuple of two"),
        ({"push_m_s2": (0.0, 1e300)}, r"push_m_s2 along y = 1e\+300 must lie in -100\.\.100"),
        ({"push_m_s2": (np.zeros(2), 0.0)}, r"push_m_s2 along x: has shape \(2,\); it must be \(1,\)"),
        ({"vehicle": replace(Vehicle(), motor_lag_s=np.zeros(3))}, r"motor_lag_s: has shape \(3,\)"),
        ({"vehicle": "mambo"}, 'vehicle = "mambo" must be a Vehicle'),
        ({"controller": "mambo"}, 'controller = "mambo" must be a Controller'),
    ],
)
def test_a_wrong_argument_of_fly_is_refused_by_name(wrong: dict[str, Any], message: str) -> None:
    """With its value and what is allowed; nothing else flies in its place."""
    given: dict[str, Any] = {
        "controller": Controller.from_preset("mambo"),
        "vehicle": Vehicle(),
        "duration_s": 1.0,
    }
    with pytest.raises(MamboNmpcError, match=message) as found:
        fly(**(given | wrong))
    assert isinstance(found.value, ArgumentError | FlightError)


@pytest.mark.parametrize(
    ("call", "arguments", "message"),
    [
        *((Vehicle, (MAMBO, lag), r"must lie in 0\.\.1") for lag in (-1.0, np.nan, 1e300)),
        (Vehicle, (MAMBO, 0.0, np.array([0.1, np.nan])), r"drag_1_s = .* must lie in 0\.\.100"),
        (Vehicle, ("mambo",), 'airframe = "mambo" must be an Airframe; Vehicle.from_preset'),
        (Vehicle.from_preset, (3,), "name = 3 must be one of cf2x-pybullet, cf2x-pyflyt"),
        (Vehicle.from_file, (None,), "path = None must be the path of a vehicle.toml"),
        (Vehicle.from_file, ("a\0b",), r"path = \"a.*b\" must be the path of a vehicle.toml"),
        (Vehicle.of, ("mambo",), 'drone = "mambo" must be a VehicleFile; from_preset'),
        (Controller.from_file, ("a\0b",), r"path = \"a.*b\" must be the path of a controller.toml"),
        (Controller, ("mambo",), 'settings = "mambo" must be Settings; from_preset'),
        (Controller, (ONE_NORM, 1.5), "n = 1.5 must be a whole number"),
        (Controller, (ONE_NORM, True), "n = True must be a whole number"),
        (Controller.from_preset, (None,), "name = None must be one of crazyflie"),
        (Controller.from_file, (5,), "path = 5 must be the path of a controller.toml"),
        (DroneState, (None, [0, 0], [0, 0, 0]), "position_m = None must be numbers"),
        (DroneState, ([[0, 0], [1]], [0, 0], [0, 0, 0]), "position_m = .* must be numbers"),
        (TargetState, ("ab", [0, 0]), 'position_m = "ab" must be numbers'),
        (TargetState, ([1j, 0], [0, 0]), "position_m = .* must be numbers"),
        (command_in_frame, ("ned", [0, 0]), 'frame = "ned" must be "NED" or "ENU" or "NWU"'),
        (command_in_frame, ([0, 0], "NED"), r"frame = \[0, 0\] must be"),
        (command_in_frame, ("ENU", 0.1), r"command_rad: has shape \(\); it must be \(\.\.\., 2\)"),
        (TargetState.in_frame, ("FLU", [0, 0], [0, 0]), 'frame = "FLU"'),
        (DroneState.in_frame, ("NWU", [0, 0, 0], [0], [0, 0, 0]), "velocity_m_s: has shape"),
        (DroneState.in_frame, ("NWU", [0, 0], [0, 0], [0, 0]), "attitude_rad: has shape"),
        *(
            (attitude_of_quaternion, ([0.0, 0.0, 0.0, length],), "quaternion = .* must have length 1")
            for length in (0.0, 0.9, 1.1, 2.0, 1e300)
        ),
    ],
)
def test_a_wrong_argument_is_refused_by_name(
    call: Callable[..., object], arguments: tuple[Any, ...], message: str
) -> None:
    """By an ArgumentError, which is also a ValueError."""
    with pytest.raises(ArgumentError, match=message) as found:
        call(*arguments)
    assert isinstance(found.value, MamboNmpcError)
    assert isinstance(found.value, ValueError)


def test_wrong_arguments_of_a_step_are_refused_by_name() -> None:
    """State and target swapped, and arrays that would be spread over drones or axes."""
    controller = Controller.from_preset("crazyflie", 2)
    with pytest.raises(ArgumentError, match=r"state = .* must be a DroneState"):
        controller.step(AHEAD, LEVEL)  # type: ignore[arg-type]
    with pytest.raises(
        ArgumentError, match=r"thrust_acceleration_m_s2: has shape \(3,\); it must be \(\) or"
    ):
        controller.step(LEVEL, AHEAD, [9.81, 9.81, 9.81])
    with pytest.raises(ArgumentError, match=r"command_rad: has shape \(1,\); it must be \(2,\) or \(2, 2\)"):
        controller.report_command([0.1])
    with pytest.raises(ArgumentError, match="command_rad = None must be numbers"):
        controller.reset(None)  # type: ignore[arg-type]


def test_a_target_may_tell_its_acceleration() -> None:
    """With a quadratic cost; the 1-norm ignores it."""
    settings = presets.load("crazyflie")
    observing, other = Controller(settings), CompiledController(settings)
    state = DroneState.in_frame("ENU", np.zeros(3), np.zeros(3), np.array([0.0, 0.0, np.pi / 2.0]))
    north = np.array([0.0, 1.0, 0.0])
    target = TargetState.in_frame("ENU", np.zeros(3), np.zeros(3), north)
    command_rad = observing.step(state, target).command_rad
    told = np.array([[0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]])
    assert command_rad[1] < 0.0
    assert (command_rad == other.step(np.zeros((1, 7)), told, np.array([9.81])).command_rad[0]).all()
    assert (Controller.from_preset("mambo-1norm").step(state, target).command_rad == 0.0).all()
    with pytest.raises(ValueError, match="acceleration_m_s2: has shape"):
        TargetState(np.zeros(2), np.zeros(2), np.zeros(4))


def test_bad_numbers_give_a_status_and_no_exception() -> None:
    """As on a board."""
    outcome = Controller.from_preset("crazyflie").step(
        DroneState(np.array([np.nan, 0.0]), np.zeros(2), np.zeros(3)), TargetState(np.zeros(2), np.zeros(2))
    )
    assert outcome.status != 0
    assert np.isfinite(outcome.command_rad).all()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        far = DroneState([1e300, 0.0], [0.0, 0.0], [0.0, 0.0, 0.0])
        assert Controller.from_preset("crazyflie").step(far, TargetState([0.0, 0.0], [0.0, 0.0])).status != 0


@pytest.mark.parametrize("frame", AXES)
def test_frames_agree_with_rotations(frame: FrameName) -> None:
    """Vectors and attitudes are those of rotation matrices between the axes of world and body."""
    world, body = AXES[frame], np.diag([1.0, -1.0, -1.0]) if frame != "NED" else np.eye(3)
    random = np.random.default_rng(3)
    vectors = random.normal(size=(20, 3))
    np.testing.assert_allclose(vectors_to_ned(frame, vectors), vectors @ world.T)
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
        return np.append(of, 0.0) @ world.T

    told = DroneState.in_frame(
        frame, vector(ned.position_m), vector(ned.velocity_m_s), attitude_to_ned(frame, ned.attitude_rad)
    )
    aim = TargetState.in_frame(frame, vector(goal.position_m), vector(goal.velocity_m_s))
    here = Controller.from_preset("crazyflie").step(ned, goal).command_rad
    there = Controller.from_preset("crazyflie").step(told, aim).command_rad
    np.testing.assert_allclose(there, here, atol=1e-6)


QUAD = (Path(__file__).parents[2] / "examples" / "quad.toml").read_text("utf-8")
LEVER_M = (0.03, -0.02, 0.05)


def levered(folder: Path) -> Path:
    """Write the file of a drone whose state is known beside its centre of mass."""
    path = folder / "levered.toml"
    path.write_text(QUAD.rstrip() + f"\nlever_m = {list(LEVER_M)}\n", "utf-8")
    return path


@pytest.mark.parametrize("frame", AXES)
def test_a_state_beside_the_centre_of_mass_gets_the_command_of_the_centre(
    frame: FrameName, tmp_path: Path
) -> None:
    """Whatever the frame: the place, turned, and its speed about the centre, are taken away."""
    (tmp_path / "plain.toml").write_text(QUAD, "utf-8")
    plain, other = (Controller.from_vehicle(path) for path in (tmp_path / "plain.toml", levered(tmp_path)))
    body = AXES["NED"] if frame == "NED" else AXES["NWU"]
    rng = np.random.default_rng(4)
    target = TargetState(np.zeros(3), np.zeros(3), yaw_rad=0.0)
    for _ in range(5):
        position, velocity, rates = rng.normal(0.0, 0.3, (3, 3))
        euler = rng.normal(0.0, 0.4, 3)
        turned = Rotation.from_euler("xyz", euler)
        there = position + turned.apply(LEVER_M), velocity + turned.apply(np.cross(rates, LEVER_M))
        place, speed = (vectors_to_ned(frame, one) for one in there)
        angles = attitude_to_ned(frame, euler)
        beside = DroneState.in_frame(frame, place, speed, angles, rates_rad_s=body @ rates)
        found = other.step(beside, target)
        expected = plain.step(DroneState(position, velocity, euler), target)
        np.testing.assert_allclose(found.command_rad, expected.command_rad, rtol=0, atol=1e-6)
        assert found.thrust_m_s2 == pytest.approx(expected.thrust_m_s2, abs=1e-4)


def test_a_state_beside_the_centre_of_mass_wants_rates(tmp_path: Path) -> None:
    """The message names the key, and what else may be meant; a copy of the controller wants them too."""
    controller = Controller.from_vehicle(levered(tmp_path))
    state = DroneState(np.zeros(3), np.zeros(3), np.zeros(3))
    for one in (controller, copy.deepcopy(controller)):
        with pytest.raises(ArgumentError, match=r"rates_rad_s is missing; sensors.lever_m = \[0.03, -0.02"):
            one.step(state, TargetState(np.zeros(3), np.zeros(3)))


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
    pushed = fly(controller, vehicle, duration_s=2.0, push_m_s2=(5.0, 0.0))
    calm = fly(controller, vehicle, duration_s=2.0)
    assert pushed.metrics.max_error_m[0] > calm.metrics.max_error_m[0]
    again = Controller.from_preset("crazyflie")
    again.step(DroneState(np.zeros(2), np.zeros(2), np.zeros(3)), TargetState(np.ones(2), np.zeros(2)))
    later = [
        each.step(DroneState(np.zeros(2), np.zeros(2), np.zeros(3)), TargetState(np.ones(2), np.zeros(2)))
        for each in (controller, again)
    ]
    assert (later[0].command_rad == later[1].command_rad).all()
    assert memory.status == 0
    with pytest.raises(FlightError, match='sensors = "mambo"'):
        fly(controller, vehicle, sensors="mambo")
