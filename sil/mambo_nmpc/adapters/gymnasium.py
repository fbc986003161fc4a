"""Gymnasium: the plant as environments, `gymnasium.make("mambo_nmpc.adapters.gymnasium:MamboNmpc-v0")`.

`gymnasium.make_vec` of the same name makes n of them, whose drones are simulated together.
"""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, Literal, Unpack, get_args

import numpy as np
from numpy.typing import NDArray

from mambo_nmpc.adapters import load
from mambo_nmpc.curves import CurvePoint, sample
from mambo_sil.api.api_controller import Controller
from mambo_sil.api.flights import as_curve
from mambo_sil.api.options import ControllerOptions
from mambo_sil.api.simulated import LOST_M, SimulatedDrones
from mambo_sil.arguments import is_whole, of_shape, require, require_choice, require_number
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.disturbances import Disturbances
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_sections import PlacedSensors
from mambo_sil.flight.altitude_loops import Vertical
from mambo_sil.flight.frames import command_in_frame, vectors_to_ned
from mambo_sil.flight.names import SENSORS_NAMES, CurveName, SensorsName, kind_of
from mambo_sil.flight.scenario import LARGEST_WIND_M_S, choose_sensors
from mambo_sil.flight.states import TargetState
from mambo_sil.flight.trajectories import Trajectory

gymnasium: Any = load("gymnasium", "pip install gymnasium")
Environment: Any = gymnasium.Env
VectorEnvironment: Any = gymnasium.vector.VectorEnv

HEIGHT_M: Final = 1.0
SCATTER_M: Final = 0.3
CRASH_REWARD: Final = -10.0
MOST_STEPS: Final = 2000


ActionName = Literal["attitude", "target"]


class EnvironmentOptions(ControllerOptions, total=False):
    """What an environment is like, and its controller; a missing one has the default of the first value."""

    action: ActionName
    """"target" sets x and y of a position at rest, as shares of `reach_m`, to which the generated C flies;
    "attitude" commands roll and pitch, as shares of the tilt limit."""
    vehicle: str | Path | Vehicle
    """"crazyflie", another shipped drone, a vehicle.toml, or a Vehicle."""
    trajectory: CurveName | Trajectory
    """"bernoulli", another curve of the command `fly`, or an object as `mambo_nmpc.fly` takes it."""
    size_m: float
    """2 m: half-width, radius, step or height of a curve by name."""
    rate_rad_s: float
    """0.5 rad/s: its angular rate."""
    reach_m: float
    """5 m: what an action of 1 is, as a target."""
    sensors: SensorsName
    """"true": through what the drone is seen; others with their noise and delay."""
    wind_speed_m_s: float
    """0 m/s: mean wind 6 m above the ground, with its gusts."""
    wind_direction_rad: float
    """0, ahead: heading towards which the wind blows; pi / 2 is to the right."""


class _Flights:
    """What the environments of n drones have in common, in arrays (n, ...)."""

    def __init__(
        self,
        n: int,
        action: ActionName = "target",
        vehicle: str | Path | Vehicle = "crazyflie",
        trajectory: CurveName | Trajectory = "bernoulli",
        *,
        size_m: float = 2.0,
        rate_rad_s: float = 0.5,
        reach_m: float = 5.0,
        sensors: SensorsName = "true",
        wind_speed_m_s: float = 0.0,
        wind_direction_rad: float = 0.0,
        **options: Unpack[ControllerOptions],
    ) -> None:
        require_choice("action", action, get_args(ActionName))
        require_choice("sensors", sensors, SENSORS_NAMES)
        require_number("reach_m", reach_m, 0.1, LOST_M)
        require_number("wind_speed_m_s", wind_speed_m_s, 0.0, LARGEST_WIND_M_S)
        require_number("wind_direction_rad", wind_direction_rad, -math.tau, math.tau)
        require("height" not in options, "height", options.get("height"), "be left out: the plant has a loop")
        if not isinstance(vehicle, Vehicle):
            vehicle = Vehicle.of(vehicle_toml.load(str(vehicle)))
        vehicle.require_flights(n)
        self._vehicle = vehicle
        self.n, self._action = n, action
        centred = _seen_at_centre(vehicle)
        self._controller = Controller.from_vehicle(centred, n, sensors=kind_of(sensors), **options)
        longest_s = MOST_STEPS * self._controller.update_period_s
        self._curve = as_curve(trajectory, size_m, rate_rad_s, longest_s)
        self._sensors = choose_sensors(sensors, self._vehicle.drone)
        self._disturbances = Disturbances(wind_speed_m_s, wind_direction_rad)
        self._limits = self._controller.settings.limits
        self._scale = self._limits.tilt_rad if action == "attitude" else reach_m
        self._drones = self._seeded(range(n))
        self.steps = np.zeros(n, np.int64)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space = gymnasium.spaces.Box(-10.0 * LOST_M, 10.0 * LOST_M, (15,), np.float32)

    def begin(self, rng: np.random.Generator) -> None:
        """Let all drones hover near the start of the curve, with other noise and gusts."""
        scatter_m = self._scatter_m(rng)
        self._drones = self._seeded(rng.integers(0, 2**62, self.n).tolist())
        self._put(scatter_m, np.ones(self.n, np.bool_))

    def begin_again(self, rng: np.random.Generator, chosen: NDArray[np.bool_]) -> None:
        """Let the chosen drones (n,) hover there; noise and gusts go on."""
        self._put(self._scatter_m(rng), chosen)

    def _scatter_m(self, rng: np.random.Generator) -> FloatArray:
        return rng.uniform(-SCATTER_M, SCATTER_M, (self.n, 2))

    def _put(self, scatter_m: FloatArray, chosen: NDArray[np.bool_]) -> None:
        self.steps = np.where(chosen, 0, self.steps)
        start_m = vectors_to_ned("NWU", self._now().position_m).copy()
        start_m[:, :2] += scatter_m
        self._drones.place(start_m, chosen)
        self._controller.reset(which=chosen)

    def step(self, action: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.bool_], dict[str, Any]]:
        """Return observation, reward, whether it crashed, and info, after an update period of each."""
        scaled, said = self._scale * np.clip(action, -1.0, 1.0), dict[str, Any]()
        command_rad = command_in_frame("NWU", scaled)
        now = self._now()
        height_m, climb_m_s, acceleration_m_s2 = (part[:, 2] for part in now)
        lift: Vertical | FloatArray = Vertical(-height_m, climb_m_s, acceleration_m_s2)
        if self._action == "target":
            zeros = np.zeros((self.n, 2))
            target = TargetState.in_frame(
                "NWU", np.column_stack([scaled, height_m]), np.column_stack([zeros, climb_m_s])
            )
            if has_height := self._controller.settings.height is not None:
                self._controller.report_thrust(self._drones.report_thrust())
            known_m_s2 = None if has_height else self._drones.thrust_m_s2
            outcome = self._controller.step(self._drones.state, target, known_m_s2)
            command_rad = outcome.command_rad
            if outcome.thrust_m_s2 is not None:
                lift = np.asarray(outcome.thrust_m_s2, np.float64)
            said = {name: getattr(outcome, name) for name in ("status", "saturated", "active_limits")}
        flies = np.asarray(~np.isnan(command_rad).any(axis=1))
        self._drones.advance(np.where(flies[:, np.newaxis], command_rad, 0.0), lift)
        self.steps = self.steps + 1
        observation, info = self.observe({name: x for name, x in said.items() if x is not None})
        crashed = self._drones.crashed | ~flies
        return observation, CRASH_REWARD * crashed - info["distance_m"], crashed, info

    def observe(self, said: dict[str, Any]) -> tuple[FloatArray, dict[str, Any]]:
        """Return observations (n, 15) and info, of each an array (n,), with what the C said."""
        now = self._now()
        seen, true = (
            [np.nan_to_num(part, nan=10.0 * LOST_M) for part in state.to_frame("NWU")]
            for state in (self._drones.state, self._drones.true_state)
        )
        parts = *seen, now.position_m - seen[0], now.velocity_m_s - seen[1]
        info = {
            "distance_m": np.linalg.norm(now.position_m - true[0], axis=1),
            "speed_m_s": np.linalg.norm(true[1][:, :2], axis=1),
            "tilt_limit_rad": np.full(self.n, self._limits.tilt_rad),
            "speed_limit_m_s": np.full(self.n, self._limits.speed_m_s),
            "braking_limit_m_s2": np.full(self.n, self._limits.braking_m_s2),
        }
        bounds = self.observation_space.low, self.observation_space.high
        return np.clip(np.concatenate(parts, axis=1), *bounds).astype(np.float32), info | said

    def _now(self) -> CurvePoint:
        times_s = self.steps * self._controller.update_period_s
        return sample(self._curve, times_s, "NWU", height_m=HEIGHT_M)

    def _seeded(self, seeds: Any) -> SimulatedDrones:
        return SimulatedDrones(
            self._vehicle,
            self._controller.update_period_s,
            tuple(seeds),
            sensors=self._sensors,
            disturbances=self._disturbances,
        )


def _seen_at_centre(vehicle: Vehicle) -> Vehicle:
    """Return a drone without `sensors.lever_m`: the states of `SimulatedDrones` are those of its centre."""
    sensors = vehicle.drone.sensors
    if not isinstance(sensors, PlacedSensors) or not any(sensors.lever_m):
        return vehicle
    centred = sensors.model_copy(update={"lever_m": (0.0, 0.0, 0.0)})
    return replace(vehicle, drone=vehicle.drone.model_copy(update={"sensors": centred}))


class MamboNmpcEnv(Environment):  # type: ignore[misc] # a class of a package that need not be installed
    """A drone that is to follow a curve, in steps of the controller's update period.

    options:     `EnvironmentOptions`.
    action:      (2,) in -1..1. The height is that of the curve: held by the C with "target" and `[height]` in
                 the settings, else by an altitude loop.
    observation: (15,) position, velocity, roll, pitch, yaw, then position and velocity of the curve less
                 those of the drone, in NWU: x ahead, y left, z up.
    reward:      minus the distance from the curve in m, and -10 for a crash, which ends the episode. An
                 attitude of NaN is a crash; a target of NaN is refused by the C, which holds its command.
    info:        distance_m, speed_m_s, the limits tilt_limit_rad, speed_limit_m_s and braking_limit_m_s2, and
                 with "target" what the C says: status, saturated, active_limits (`nmpc_limits_active`).
    """

    def __init__(self, **options: Unpack[EnvironmentOptions]) -> None:
        self._flights = _Flights(1, **options)
        self.action_space = self._flights.action_space
        self.observation_space = self._flights.observation_space

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, Any]:
        """Hover near the start of the curve; the seed draws where, and noise and gusts."""
        super().reset(seed=seed, options=options)
        self._flights.begin(self.np_random)
        observation, info = self._flights.observe({})
        return observation[0], _first(info)

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Hold a command, or fly to a target, for one update period; raises ArgumentError for a shape."""
        given = of_shape("action", action, (2,))
        observation, reward, crashed, info = self._flights.step(given[np.newaxis])
        return observation[0], float(reward[0]), bool(crashed[0]), False, _first(info)


class MamboNmpcVectorEnv(VectorEnvironment):  # type: ignore[misc] # as above
    """n such environments, whose drones are simulated together: actions (n, 2), observations (n, 15).

    An environment that has ended starts again at the next step, whose action it does not take.
    """

    metadata: Final = {"autoreset_mode": gymnasium.vector.AutoresetMode.NEXT_STEP}

    def __init__(
        self, num_envs: int = 1, *, max_episode_steps: int = MOST_STEPS, **options: Unpack[EnvironmentOptions]
    ) -> None:
        self._flights = _Flights(num_envs, **options)
        rule = "be a whole number of 1 or more"
        require(is_whole(max_episode_steps, 1, 2**62), "max_episode_steps", max_episode_steps, rule)
        self.num_envs, self._most_steps = num_envs, max_episode_steps
        self.single_action_space = self._flights.action_space
        self.single_observation_space = self._flights.observation_space
        self.action_space = gymnasium.vector.utils.batch_space(self.single_action_space, num_envs)
        self.observation_space = gymnasium.vector.utils.batch_space(self.single_observation_space, num_envs)
        self._ended = np.zeros(num_envs, np.bool_)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, Any]:
        """Let all drones hover near the start of the curve; the seed draws where, and noise and gusts."""
        super().reset(seed=seed, options=options)
        self._flights.begin(self.np_random)
        self._ended = np.zeros(self.num_envs, np.bool_)
        return self._flights.observe({})

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Hold commands, or fly to targets, for one update period; raises ArgumentError for a shape."""
        given, begins = of_shape("actions", actions, (self.num_envs, 2)), self._ended
        observation, reward, crashed, info = self._flights.step(given)
        if begins.any():
            self._flights.begin_again(self.np_random, begins)
            said = {name: np.where(begins, 0, x) for name, x in info.items() if name in _SAID}
            observation, info = self._flights.observe(said)
            reward, crashed = np.where(begins, 0.0, reward), crashed & ~begins
        truncated = (self._flights.steps >= self._most_steps) & ~crashed
        self._ended = crashed | truncated
        return observation, reward, crashed, truncated, info


_SAID: Final = ("status", "saturated", "active_limits")


def _first(info: dict[str, Any]) -> dict[str, Any]:
    """Return the info of a single environment."""
    return {name: (int if name in _SAID else float)(values[0]) for name, values in info.items()}


gymnasium.register(
    "MamboNmpc-v0",
    entry_point=MamboNmpcEnv,
    vector_entry_point=MamboNmpcVectorEnv,
    max_episode_steps=MOST_STEPS,
)
