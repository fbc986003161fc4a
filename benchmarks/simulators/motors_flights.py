"""Flights in worlds that have motors only, by the true state: LQR and Lee's law, shipped and tuned, and ours.

Drake's QuadrotorPlant at 200 Hz, and a drone of 0.5 kg in MuJoCo at 500 Hz, both of `examples/`. Below Lee's
law and ours lies the same attitude loop, `mambo_nmpc.adapters.motors`; LQR commands the rotors by itself.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Protocol

import mujoco
import numpy as np
from pydrake.examples import QuadrotorPlant
from scipy.linalg import solve_continuous_are
from scipy.spatial.transform import Rotation

from benchmarks.simulators.missions import STEP_S
from benchmarks.simulators.pilots import Sight
from benchmarks.simulators.single import measure, search
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_nmpc.adapters.motors import Motors
from mambo_sil.api.api_controller import Controller
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.flight.states import DroneState, TargetState

EXAMPLES: Final = Path(__file__).parents[2] / "examples"
LEE_GAINS: Final = np.array([6.0, 10.0, 4.0, 6.0])
"""Along the ground and up: 1/s^2 of the distance, 1/s of the speed."""
LQR_WEIGHTS: Final = np.array([10.0, 10.0, 1.0, 1.0, 1.0])
"""Of Drake's example: position, angles, velocity, body rates; of the rotors' thrusts."""
MUJOCO_ARM_M: Final = 0.106


@dataclass(frozen=True, eq=False)
class RotorcraftState:
    """The state of a drone: position and velocity in NWU, quaternion x, y, z, w, rates in the body."""

    position_m: FloatArray
    velocity_m_s: FloatArray
    quaternion: FloatArray
    rates_rad_s: FloatArray


class MotorWorld(Protocol):
    """A simulated drone with four rotors."""

    vehicle: Vehicle
    rotors_m: FloatArray
    """(4, 2) along forward and left."""
    reaction: FloatArray

    def begin(self, position_m: FloatArray) -> None:
        """Place the drone at rest."""
        ...

    def motion(self) -> RotorcraftState:
        """Return its state."""
        ...

    def tick(self, thrusts_n: FloatArray, force_n: FloatArray) -> None:
        """Simulate a tick under the rotors' thrusts (4,) and a force (3,)."""
        ...


class Drake:
    """Drake's QuadrotorPlant, integrated by the midpoint rule at 400 Hz."""

    vehicle = Vehicle.from_file(EXAMPLES / "drake.toml")
    reaction = np.array([1.0, -1.0, 1.0, -1.0])

    def __init__(self) -> None:
        self._plant = QuadrotorPlant()
        self._context = self._plant.CreateDefaultContext()
        arm_m = self._plant.length()
        self.rotors_m = arm_m * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])

    def begin(self, position_m: FloatArray) -> None:
        """Place the drone at rest."""
        self._state = np.concatenate([position_m, np.zeros(9)])

    def motion(self) -> RotorcraftState:
        """Return its state; Drake's has the derivatives of the angles."""
        (roll, pitch, _), (d_roll, d_pitch, d_yaw) = self._state[3:6], self._state[9:]
        rates = np.array(
            [
                d_roll - np.sin(pitch) * d_yaw,
                np.cos(roll) * d_pitch + np.sin(roll) * np.cos(pitch) * d_yaw,
                -np.sin(roll) * d_pitch + np.cos(roll) * np.cos(pitch) * d_yaw,
            ]
        )
        quaternion = Rotation.from_euler("xyz", self._state[3:6]).as_quat()
        return RotorcraftState(self._state[:3], self._state[6:9], quaternion, rates)

    def tick(self, thrusts_n: FloatArray, force_n: FloatArray) -> None:
        """Simulate a tick of 5 ms."""
        for _ in range(2):
            half = self._state + 0.00125 * self._derivative(self._state, thrusts_n, force_n)
            self._state = self._state + 0.0025 * self._derivative(half, thrusts_n, force_n)

    def _derivative(self, state: FloatArray, thrusts_n: FloatArray, force_n: FloatArray) -> FloatArray:
        self._context.SetContinuousState(state)
        self._plant.get_input_port(0).FixValue(self._context, thrusts_n / self._plant.force_constant())
        found = np.asarray(self._plant.EvalTimeDerivatives(self._context).CopyToVector())
        found[6:9] += force_n / self._plant.m()
        return found


class Mujoco:
    """A drone of 0.5 kg in MuJoCo, whose four motors stand as an X, at 500 Hz."""

    vehicle = Vehicle.from_file(EXAMPLES / "quad.toml")
    reaction = np.array([1.0, -1.0, 1.0, -1.0])
    rotors_m = MUJOCO_ARM_M * np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]])

    def __init__(self) -> None:
        sites = "".join(f'<site name="r{k}" pos="{x} {y} 0"/>' for k, (x, y) in enumerate(self.rotors_m))
        motors = "".join(
            f'<motor site="r{k}" gear="0 0 1 0 0 {0.016 * turn}"/>' for k, turn in enumerate(self.reaction)
        )
        self._model = mujoco.MjModel.from_xml_string(
            '<mujoco><option timestep="0.002" integrator="RK4"/><worldbody><body><freejoint/>'
            f'{sites}<inertial pos="0 0 0" mass="0.5" diaginertia="0.003 0.003 0.005"/></body></worldbody>'
            f"<actuator>{motors}</actuator></mujoco>"
        )
        self._data = mujoco.MjData(self._model)

    def begin(self, position_m: FloatArray) -> None:
        """Place the drone at rest."""
        mujoco.mj_resetData(self._model, self._data)
        self._data.qpos[:3] = position_m

    def motion(self) -> RotorcraftState:
        """Return its state; MuJoCo's w comes first."""
        place, speed = self._data.qpos.copy(), self._data.qvel.copy()
        return RotorcraftState(place[:3], speed[:3], np.roll(place[3:7], -1), speed[3:6])

    def tick(self, thrusts_n: FloatArray, force_n: FloatArray) -> None:
        """Simulate a tick of 2 ms."""
        self._data.ctrl[:] = thrusts_n
        self._data.xfrc_applied[1, :3] = force_n
        mujoco.mj_step(self._model, self._data)


class RotorLaw(Protocol):
    """What commands the rotors of a world."""

    def aim(self, now: RotorcraftState, target: FloatArray) -> None:
        """Take a target (9,), once in a step."""
        ...

    def thrusts_n(self, now: RotorcraftState) -> FloatArray:
        """Return the thrusts of the rotors (4,), once in a tick."""
        ...


class GeneratedLaw:
    """The generated C, by the page, above the attitude loop of the vehicle's file."""

    def __init__(self, world: MotorWorld) -> None:
        self._mass_kg = float(world.vehicle.drone.body.mass_kg)
        self._controller = Controller.from_vehicle(world.vehicle, sensors="true")
        self._motors = Motors(world.vehicle, rotors_m=world.rotors_m, reaction=world.reaction)

    def aim(self, now: RotorcraftState, target: FloatArray) -> None:
        """Make a step of the controller."""
        angles_rad = Rotation.from_quat(now.quaternion).as_euler("xyz")
        state = DroneState.in_frame("NWU", now.position_m, now.velocity_m_s, angles_rad)
        wanted = TargetState.in_frame("NWU", target[:3], target[3:6], target[6:], yaw_rad=0.0)
        self._command = self._controller.step(state, wanted).attitude_thrust("NWU", mass_kg=self._mass_kg)

    def thrusts_n(self, now: RotorcraftState) -> FloatArray:
        """Follow the attitude."""
        return self._motors.thrusts_n(self._command, now.quaternion, now.rates_rad_s)


class Lee:
    """Lee's position law (2010) with the target's acceleration, above the same attitude loop."""

    def __init__(self, world: MotorWorld, factors: FloatArray) -> None:
        self._gains = LEE_GAINS * factors
        self._mass_kg = float(world.vehicle.drone.body.mass_kg)
        self._motors = Motors(world.vehicle, rotors_m=world.rotors_m, reaction=world.reaction)

    def aim(self, now: RotorcraftState, target: FloatArray) -> None:
        """Point the thrust along the wanted acceleration, and take as much of it as points there now."""
        level, up, level_speed, up_speed = self._gains
        wanted = np.array([level, level, up]) * (target[:3] - now.position_m)
        wanted += np.array([level_speed, level_speed, up_speed]) * (target[3:6] - now.velocity_m_s)
        wanted += target[6:] + np.array([0.0, 0.0, GRAVITY_M_S2])
        z = wanted / np.linalg.norm(wanted)
        y = np.cross(z, [1.0, 0.0, 0.0])
        y /= np.linalg.norm(y)
        turned = Rotation.from_matrix(np.stack([np.cross(y, z), y, z], axis=1)).as_euler("xyz")
        thrust_n = self._mass_kg * float(wanted @ Rotation.from_quat(now.quaternion).as_matrix()[:, 2])
        self._command = np.append(turned, thrust_n)

    def thrusts_n(self, now: RotorcraftState) -> FloatArray:
        """Follow the attitude."""
        return self._motors.thrusts_n(self._command, now.quaternion, now.rates_rad_s)


class Lqr:
    """LQR of the whole state about hover, with the weights of Drake's example, along a moving target."""

    def __init__(self, world: MotorWorld, factors: FloatArray) -> None:
        drone = world.vehicle.drone
        mass_kg, inertia = drone.body.mass_kg, np.array(drone.inertia_kg_m2)
        x, y = world.rotors_m.T
        reaction_m = world.vehicle.airframe.torque_per_thrust_m
        wrench = np.stack([np.ones(4), y, -x, world.reaction * reaction_m])
        a, b = np.zeros((12, 12)), np.zeros((12, 4))
        a[:6, 6:] = np.eye(6)
        a[6, 4], a[7, 3] = GRAVITY_M_S2, -GRAVITY_M_S2
        b[8], b[9:] = wrench[0] / mass_kg, wrench[1:] / inertia[:, np.newaxis]
        weights = LQR_WEIGHTS * factors
        q, r = np.diag(np.repeat(weights[:4], 3)), weights[4] * np.eye(4)
        self._gain = np.linalg.solve(r, b.T @ solve_continuous_are(a, b, q, r))
        self._hover_n = mass_kg * GRAVITY_M_S2 / 4.0
        self._most_n = drone.largest_thrust_n / 4.0

    def aim(self, now: RotorcraftState, target: FloatArray) -> None:
        """Take position and velocity."""
        del now
        self._target = target

    def thrusts_n(self, now: RotorcraftState) -> FloatArray:
        """Return hover less the gain times the error, within the rotors' limits."""
        angles_rad = Rotation.from_quat(now.quaternion).as_euler("xyz")
        off = (now.position_m - self._target[:3], angles_rad, now.velocity_m_s - self._target[3:6])
        error = np.concatenate([*off, now.rates_rad_s])
        return np.asarray(np.clip(self._hover_n - self._gain @ error, 0.0, self._most_n), np.float64)


class MotorDrone:
    """A drone of a world, flown by a law that is made for each flight."""

    period_s = STEP_S

    def __init__(self, world: MotorWorld, law: Callable[[MotorWorld], RotorLaw]) -> None:
        self._world, self._made = world, law
        self._ticks = round(STEP_S / world.vehicle.drone.step_s)

    def begin(self, position_m: FloatArray, seed: int | None) -> None:
        """Place the drone, whose state everybody knows."""
        del seed
        self._world.begin(position_m)
        self._law = self._made(self._world)

    def sight(self) -> Sight:
        """Return the true state."""
        now = self._world.motion()
        angles_rad = Rotation.from_quat(now.quaternion).as_euler("xyz")
        return Sight(*(one[np.newaxis] for one in (now.position_m, now.velocity_m_s, angles_rad)))

    def advance(self, seen: Sight, target: FloatArray, force_m_s2: FloatArray) -> None:
        """Fly for one period."""
        del seen
        self._law.aim(self._world.motion(), target)
        for _ in range(self._ticks):
            thrusts_n = self._law.thrusts_n(self._world.motion())
            self._world.tick(thrusts_n, self._world.vehicle.drone.body.mass_kg * force_m_s2)


def measure_all(folder: Path) -> Iterator[tuple[str, dict[str, Any], Mapping[str, Any]]]:
    """Yield title, scores and paths of both worlds; one flight each, without noise."""
    worlds: dict[str, MotorWorld] = {"Drake's QuadrotorPlant": Drake(), "MuJoCo, X of 0.5 kg": Mujoco()}
    for title, world in worlds.items():
        contestants: dict[str, Callable[[], MotorDrone]] = {}
        for name, law, count in (("LQR", Lqr, 5), ("Lee", Lee, 4)):

            def made(factors: FloatArray, law: Any = law, world: MotorWorld = world) -> MotorDrone:
                return MotorDrone(world, lambda here: law(here, factors))

            best, found = search(made, count, None)
            (folder / f"{title}-{name}-found.txt").write_text(f"{found}\n", "utf-8")
            contestants[name] = lambda made=made, count=count: made(np.ones(count))  # type: ignore[misc]
            contestants[f"{name}, tuned"] = lambda best=best: best  # type: ignore[misc]
        contestants["ours, by the page"] = lambda world=world: MotorDrone(world, GeneratedLaw)  # type: ignore[misc]
        yield from measure(title, contestants, None, seeds=(0,))
