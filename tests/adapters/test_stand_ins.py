"""What adapters give to simulators that CI does not install, and what is said where one is missing.

crazyflow (JAX is large), gym-pybullet-drones (not on PyPI) and PyFlyt (wants NumPy 1) have stand-ins with the
names and signatures of crazyflow 0.4.0, of gym-pybullet-drones' DSLPIDControl and of PyFlyt's QuadX. Checked
are what the adapter reads, the shapes, frames and units of what it returns, and that it refuses what does not
fit; the simulators themselves are flown in `benchmarks/simulators`.
"""

import importlib
import subprocess
import sys
from collections.abc import Callable
from types import ModuleType, SimpleNamespace
from typing import Any, Final

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mambo_nmpc import ArgumentError, Controller, MamboNmpcError
from mambo_nmpc.adapters.crazyflow import CrazyflowPilot, attach
from mambo_nmpc.adapters.gym_pybullet_drones import pybullet_control
from mambo_nmpc.adapters.pyflyt import pyflyt_controller
from mambo_nmpc.curves import curve

MASS_KG: Final = 0.0328
KF: Final = 3.16e-10
LEVEL: Final = np.array([0.0, 0.0, 0.0, 1.0])


@pytest.mark.long
def test_adapters_import_no_simulator() -> None:
    """But that for Gymnasium, whose class of environments is one of its own."""
    script = (
        "import sys, mambo_nmpc.adapters.crazyflow, mambo_nmpc.adapters.rotorpy, "
        "mambo_nmpc.adapters.gym_pybullet_drones, mambo_nmpc.adapters.pyflyt; print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    simulators = {"jax", "crazyflow", "rotorpy", "gymnasium", "gym_pybullet_drones", "PyFlyt"}
    found = simulators & set(done.stdout.split())
    assert not found


def test_a_missing_package_is_named_with_its_command(monkeypatch: pytest.MonkeyPatch) -> None:
    """By an error that is an ImportError, and one of ours."""
    for name in ("gymnasium", "gym_pybullet_drones"):
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.delitem(sys.modules, "mambo_nmpc.adapters.gymnasium", raising=False)
    controller = Controller.from_vehicle("crazyflie")
    for call, command in (
        (lambda: pybullet_control("cf2x", controller), r"pip install git\+https://github.com/utiasDSL/gym"),
        (lambda: importlib.import_module("mambo_nmpc.adapters.gymnasium"), "pip install gymnasium"),
    ):
        with pytest.raises(ImportError, match=command) as found:
            call()
        assert isinstance(found.value, MamboNmpcError)


def simulation(worlds: int, drones: int, freq: int = 500) -> Any:
    """Return what the adapter reads of a `crazyflow.sim.Sim`."""
    data = SimpleNamespace(params=SimpleNamespace(mass=np.array([MASS_KG])))
    return SimpleNamespace(n_worlds=worlds, n_drones=drones, freq=freq, data=data)


def states(worlds: int, drones: int) -> dict[str, Any]:
    """Return drones at rest, 10 cm below the target and 30 cm right of it, in crazyflow's types."""
    position = np.broadcast_to(np.array([0.0, -0.3, 0.9], np.float32), (worlds, drones, 3))
    quaternion = np.broadcast_to(LEVEL.astype(np.float32), (worlds, drones, 4))
    return {"position": position, "quaternion": quaternion, "velocity": np.zeros_like(position)}


@pytest.mark.parametrize(
    "controller",
    [
        pytest.param(
            lambda: Controller.from_vehicle("crazyflie-flown", 6, height="pid", measurement_age_s=0.0),
            id="loop",
        ),
        pytest.param(lambda: Controller.from_vehicle("crazyflie", 6, measurement_age_s=0.0), id="axis"),
    ],
)
def test_a_crazyflow_simulation_gets_its_attitude_commands(controller: Callable[[], Controller]) -> None:
    """Roll, pitch, yaw in rad and thrust in N (worlds, drones, 4); a world that is reset starts afresh."""
    pilot = CrazyflowPilot(simulation(3, 2), controller(), curve("hover"), height_m=1.0, yaw_rad=0.2)
    assert pilot.ticks == 5
    first = pilot.command(np.zeros((3, 1), np.int32), **states(3, 2))
    assert first.shape == (3, 2, 4)
    assert first.dtype == np.float32
    assert (first[..., 0] < 0.0).all()  # rolls to the left
    assert (first[..., 3] > MASS_KG * 9.81).all()
    np.testing.assert_allclose(first[..., 2], 0.04, rtol=1e-6)  # 4 rad/s for 10 ms
    then = pilot.command(np.array([[5], [0], [5]]), **states(3, 2))
    np.testing.assert_array_equal(then[1], first[1])
    assert (then[[0, 2], :, 2] > first[[0, 2], :, 2]).all()


def test_drones_on_the_floor_of_crazyflow_idle_until_they_shall_climb() -> None:
    """At -1 mm, where crazyflow holds them, and at rest; one that sinks there still flies."""
    made = Controller.from_vehicle("crazyflie", 3, measurement_age_s=0.0)
    at_rest = states(3, 1)
    at_rest["position"] = np.array([[[0.0, 0.0, -0.001]], [[0.0, 0.0, 0.001]], [[0.0, 0.0, 0.02]]])
    at_rest["velocity"] = np.array([[[0.0, 0.0, 0.0]], [[0.0, 0.0, -0.3]], [[0.0, 0.0, 0.0]]])
    for height_m, idle in ((0.0, [True, False, False]), (1.0, [False] * 3)):
        pilot = CrazyflowPilot(simulation(3, 1), made, curve("hover"), height_m=height_m, yaw_rad=0.0)
        thrust_m_s2 = pilot.command(np.zeros((3, 1)), **at_rest)[:, 0, 3] / MASS_KG
        assert (thrust_m_s2 < 3.0).tolist() == idle


@pytest.mark.long
def test_a_crazyflow_simulation_that_does_not_fit_is_refused() -> None:
    """By number of drones, or by frequency."""
    controller = Controller.from_vehicle("crazyflie", 2)
    with pytest.raises(ArgumentError, match="controller: was made for 2 drones"):
        CrazyflowPilot(simulation(2, 2), controller, curve("hover"), height_m=1.0, yaw_rad=0.0)
    with pytest.raises(ArgumentError, match=r"sim\.freq = 250 must be a multiple of 100 Hz"):
        CrazyflowPilot(simulation(1, 2, 250), controller, curve("hover"), height_m=1.0, yaw_rad=0.0)


class Simulation:
    """The parts of a `crazyflow.sim.Sim` that `attach` uses: each step counts, and records the command."""

    n_worlds, n_drones, freq = 2, 1, 500

    def __init__(self) -> None:
        params = SimpleNamespace(mass=np.array([MASS_KG]))
        names = {"position": "pos", "quaternion": "quat", "velocity": "vel"}
        seen = SimpleNamespace(**{names[name]: part for name, part in states(2, 1).items()})
        core = SimpleNamespace(steps=np.zeros((2, 1), np.int32))
        self.data = SimpleNamespace(params=params, states=seen, core=core)
        self.log: list[Any] = []

    def attitude_control(self, command: Any) -> None:
        """Record a command."""
        self.log.append(command)

    def step(self, n_steps: int = 1) -> None:
        """Count steps."""
        self.log.append(n_steps)
        self.data.core.steps = self.data.core.steps + n_steps


def test_attached_drones_are_commanded_when_it_is_due() -> None:
    """Every five steps of 500 Hz, however the simulation is stepped, by what `measure` returns."""
    sim, asked = Simulation(), []

    def measure(position: Any, quaternion: Any, velocity: Any) -> tuple[Any, Any, Any]:
        asked.append(position)
        left_of_it = position + np.array([0.0, 0.6, 0.0], np.float32)
        return left_of_it, quaternion, velocity

    attach(sim, Controller.from_vehicle("crazyflie", 2, sensors="true"), curve("hover"), measure=measure)
    sim.step(7)
    sim.step(3)
    sim.step()
    assert [each for each in sim.log if isinstance(each, int)] == [5, 2, 3, 1]
    commands = [each for each in sim.log if not isinstance(each, int)]
    assert len(commands) == len(asked) == 3
    assert (commands[0][..., 0] > 0.0).all()  # rolls to the right


def test_drones_have_headings_masses_and_curves_of_their_own() -> None:
    """The heading and the mass may change in flight; a world's second drone has its own curve."""
    controller = Controller.from_vehicle("crazyflie", 4, sensors="true")
    curves = [curve("hover"), curve("step", -3.0)]
    headings = np.array([[0.2, 0.0], [0.0, -0.2]])
    pilot = CrazyflowPilot(simulation(2, 2), controller, curves, yaw_rad=headings)
    steps = np.full((2, 1), 3000)
    first = pilot.command(steps, **states(2, 2))
    np.testing.assert_allclose(first[..., 2], [[0.04, 0.0], [0.0, -0.04]], atol=1e-6)
    assert (first[:, 1, 1] < -0.1).all()  # nose up, towards a target behind
    assert (np.abs(first[:, 0, 1]) < 0.01).all()
    pilot.mass_kg = np.array([[MASS_KG, 2.0 * MASS_KG], [MASS_KG, MASS_KG]])
    pilot.yaw_rad = 0.1
    controller.reset()
    then = pilot.command(steps, **states(2, 2))
    np.testing.assert_allclose(then[..., 3] / first[..., 3], [[1.0, 2.0], [1.0, 1.0]], rtol=1e-6)
    np.testing.assert_allclose(then[..., 2], 0.04, rtol=1e-6)
    with pytest.raises(ArgumentError, match="trajectory: has 3 curves; a world has 2 drones"):
        CrazyflowPilot(simulation(2, 2), controller, [curve("hover")] * 3)


class DSLPIDControl:
    """The parts of gym-pybullet-drones' controller that the adapter uses, with its signatures."""

    def __init__(self, drone_model: str) -> None:
        self.DRONE_MODEL = drone_model
        self.KF, self.PWM2RPM_SCALE, self.PWM2RPM_CONST = KF, 0.2685, 4070.3
        self.reset()

    def reset(self) -> None:
        """Set the counter to 0."""
        self.control_counter = 0

    def _getURDFParameter(self, parameter_name: str) -> float:  # noqa: N802 - its name
        return {"m": MASS_KG, "length": 0.025, "collision_z_offset": 0.0}[parameter_name]

    def computeControl(  # noqa: N802 - its name
        self, control_timestep: float, cur_pos: Any, cur_quat: Any, cur_vel: Any, target_pos: Any, **more: Any
    ) -> Any:
        """Return what the position controller returns, which the attitude controller gets."""
        target = more.get("target_rpy", np.zeros(3)), more.get("target_vel", np.zeros(3))
        position_control = self._dslPIDPositionControl  # type: ignore[attr-defined] # of the subclass
        return position_control(control_timestep, cur_pos, cur_quat, cur_vel, target_pos, *target)


@pytest.fixture
def _pybullet(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("gym_pybullet_drones", "gym_pybullet_drones.control"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    module: Any = ModuleType("gym_pybullet_drones.control.DSLPIDControl")
    module.DSLPIDControl = DSLPIDControl
    monkeypatch.setitem(sys.modules, module.__name__, module)


@pytest.mark.usefixtures("_pybullet")
def test_a_base_control_gets_thrust_and_attitude() -> None:
    """Thrust in PWM, angles about X, then Y, then Z of the body, and the position error."""
    made = Controller.from_preset("crazyflie", vehicle="crazyflie", height="feedforward")
    control = pybullet_control("cf2x", made)
    assert isinstance(control, DSLPIDControl)
    here, there, rest = np.array([0.0, 0.0, 1.0]), np.array([0.2, 0.0, 1.0]), np.zeros(3)
    turned = Rotation.from_euler("z", 0.5).as_quat()
    heading = np.array([0.0, 0.0, 0.5])
    pwm, angles, error = control.computeControl(0.01, here, turned, rest, there, target_rpy=heading)
    thrust_n = 4.0 * KF * (pwm * control.PWM2RPM_SCALE + control.PWM2RPM_CONST) ** 2
    np.testing.assert_allclose(thrust_n, MASS_KG * 9.81, rtol=1e-6)
    lift = Rotation.from_euler("XYZ", angles).as_matrix()[:, 2]
    assert lift[0] > 0.01  # towards the target
    assert abs(lift[1]) < 0.1 * lift[0]
    np.testing.assert_array_equal(error, there - here)
    again = control.computeControl(0.01, here, turned, rest, there, target_rpy=heading)[1]
    control.reset()
    after = control.computeControl(0.01, here, turned, rest, there, target_rpy=heading)[1]
    assert (again != angles).any()
    np.testing.assert_array_equal(after, angles)


@pytest.mark.usefixtures("_pybullet")
@pytest.mark.parametrize(("height_m", "idle"), [(0.0125, True), (0.02, True), (0.03, False)])
def test_a_base_control_on_the_floor_idles(height_m: float, idle: bool) -> None:
    """PyBullet gives the middle of the body: it lies on the floor at half its length, here 12.5 mm."""
    control = pybullet_control("cf2x", Controller.from_vehicle("crazyflie", measurement_age_s=0.0))
    here = np.array([0.0, 0.0, height_m])
    pwm = control.computeControl(0.01, here, LEVEL, np.zeros(3), here)[0]
    thrust_n = 4.0 * KF * (pwm * control.PWM2RPM_SCALE + control.PWM2RPM_CONST) ** 2
    assert (thrust_n < 3.0 * MASS_KG) == idle


@pytest.mark.long
@pytest.mark.usefixtures("_pybullet")
def test_a_base_control_refuses_what_does_not_fit() -> None:
    """Another control period, and several drones."""
    control = pybullet_control("cf2x", Controller.from_vehicle("crazyflie"))
    here, rest = np.array([0.0, 0.0, 1.0]), np.zeros(3)
    with pytest.raises(ArgumentError, match=r"control_timestep = 0\.02 must be 0\.01, the update period"):
        control.computeControl(0.02, here, LEVEL, rest, here)
    with pytest.raises(ArgumentError, match="controller: was made for 2 drones; a BaseControl flies one"):
        pybullet_control("cf2x", Controller.from_vehicle("crazyflie", 2))


def quad_x(control_hz: int = 120, touching: bool = False) -> Any:
    """Return what the adapter reads of PyFlyt's `QuadX` of 27 g and 2 N."""
    bodies = SimpleNamespace(
        getDynamicsInfo=lambda _, __: (0.027,), getContactPoints=lambda _: ((1,),) if touching else ()
    )
    motors = SimpleNamespace(thrust_coef=np.full((4, 1), 3.16e-10), max_rpm=np.full(4, 39778.0))
    return SimpleNamespace(Id=1, control_period=1.0 / control_hz, p=bodies, motors=motors)


def test_a_quadx_gets_rates_and_a_throttle() -> None:
    """Towards the target, from a velocity in the body; the thrust goes with the square of the throttle."""
    law = pyflyt_controller(quad_x(), Controller.from_vehicle("cf2x-pyflyt", sensors="true"))()
    yaw_rad = 0.5 * np.pi
    at_rest = np.array([[0.0] * 3, [0.0, 0.0, yaw_rad], [0.0] * 3, [0.0, 0.0, 1.0]])
    hover = np.array([0.0, 0.0, yaw_rad, 1.0])
    calm = law.step(at_rest, hover)
    np.testing.assert_allclose(calm[:3], 0.0, atol=1e-6)
    assert 2.0 * calm[3] ** 2 == pytest.approx(0.027 * 9.81 / 1.47, rel=1e-3)  # of vehicle cf2x-pyflyt
    law.reset()
    left = law.step(at_rest, np.array([-1.0, 0.0, yaw_rad, 1.0]))  # to its left, as it looks along y
    assert left[0] < -1.0
    assert abs(left[1]) < 0.01
    law.reset()
    follows = law.step(at_rest, np.array([*hover, 0.0, 1.0, 0.0]))  # the target goes ahead
    assert follows[1] > 0.5  # nose down
    law.reset()
    moving = at_rest.copy()
    moving[2] = 1.0, 0.0, 0.0  # ahead in the body, which is y of the world
    roll_rad_s, pitch_rad_s, *_ = law.step(moving, np.array([*hover, 0.0, 1.0, 0.0]))
    assert abs(roll_rad_s) < 1e-6
    assert 0.0 < pitch_rad_s < 0.1  # against the drag


@pytest.mark.parametrize(("touching", "idle"), [(True, True), (False, False)])
def test_a_quadx_on_the_floor_idles(touching: bool, idle: bool) -> None:
    """By the contacts that PyBullet reports."""
    law = pyflyt_controller(quad_x(touching=touching), Controller.from_vehicle("cf2x-pyflyt"))()
    state = np.array([[0.0] * 3] * 3 + [[0.0, 0.0, 0.01]])
    assert (2.0 * law.step(state, np.array([0.0, 0.0, 0.0, 0.01]))[3] ** 2 < 0.1) == idle


def test_a_quadx_that_does_not_fit_is_refused() -> None:
    """Another frequency, with the option that helps; several drones."""
    rule = r"control_period = 0\.01 must be 0\.00833333, .*: make it with update_period_s=0\.01"
    with pytest.raises(ArgumentError, match=rule):
        pyflyt_controller(quad_x(100), Controller.from_vehicle("cf2x-pyflyt"))
    pyflyt_controller(quad_x(100), Controller.from_vehicle("cf2x-pyflyt", update_period_s=0.01))
    with pytest.raises(ArgumentError, match="was made for 2 drones; a ControlClass flies one"):
        pyflyt_controller(quad_x(), Controller.from_vehicle("cf2x-pyflyt", 2))
