"""Gymnasium: the plant as an environment, `gymnasium.make("mambo_nmpc.adapters.gymnasium:MamboNmpc-v0")`."""

from typing import Any, Final, Literal, Unpack

import numpy as np

from mambo_nmpc.adapters import load
from mambo_nmpc.curves import CurvePoint, curve, sample
from mambo_sil.api.api_controller import Controller
from mambo_sil.api.options import ControllerOptions
from mambo_sil.api.simulated import LOST_M, SimulatedDrone
from mambo_sil.arguments import of_shape, require, require_choice, require_number
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.altitude_loops import Vertical
from mambo_sil.flight.frames import command_in_frame, vectors_to_ned
from mambo_sil.flight.names import CurveName
from mambo_sil.flight.states import TargetState

gymnasium: Any = load("gymnasium", "pip install gymnasium")
Environment: Any = gymnasium.Env

HEIGHT_M: Final = 1.0
SCATTER_M: Final = 0.3
CRASH_REWARD: Final = -10.0


class MamboNmpcEnv(Environment):  # type: ignore[misc] # a class of a package that need not be installed
    """A drone that is to follow a curve, in steps of the controller's update period.

    action:      (2,) in -1..1: "attitude" commands roll and pitch, as shares of the tilt limit; "target" sets
                 x and y of a position at rest, as shares of `reach_m`, to which the generated C flies. The
                 height is that of the curve: held by the C with "target" and `[height]` in the settings, else
                 by an altitude loop.
    observation: (15,) position, velocity, roll, pitch, yaw, then position and velocity of the curve less
                 those of the drone, in NWU: x ahead, y left, z up.
    reward:      minus the distance from the curve in m, and -10 for a crash, which ends the episode. An
                 attitude of NaN is a crash; a target of NaN is refused by the C, which holds its command.
    info:        distance_m, speed_m_s, the limits tilt_limit_rad, speed_limit_m_s and braking_limit_m_s2, and
                 with "target" what the C says: status, saturated, active (`nmpc_limits_active`).
    """

    def __init__(
        self,
        action: Literal["attitude", "target"] = "target",
        vehicle: str = "crazyflie",
        trajectory: CurveName = "bernoulli",
        *,
        size_m: float = 2.0,
        rate_rad_s: float = 0.5,
        reach_m: float = 5.0,
        **options: Unpack[ControllerOptions],
    ) -> None:
        require_choice("action", action, ("attitude", "target"))
        require_number("reach_m", reach_m, 0.1, LOST_M)
        require("height" not in options, "height", options.get("height"), "be left out: the plant has a loop")
        self._action, self._curve = action, curve(trajectory, size_m, rate_rad_s)
        self._controller = Controller.from_vehicle(vehicle, sensors="true", **options)
        self._drone = SimulatedDrone(vehicle_toml.load(vehicle), self._controller.update_period_s)
        self._limits = self._controller.settings.limits
        self._scale = self._limits.tilt_rad if action == "attitude" else reach_m
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space = gymnasium.spaces.Box(-10.0 * LOST_M, 10.0 * LOST_M, (15,), np.float32)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, Any]:
        """Hover near the start of the curve; the seed draws where."""
        super().reset(seed=seed, options=options)
        self._steps = 0
        start_m = vectors_to_ned("NWU", self._now.position_m)
        start_m[:2] += self.np_random.uniform(-SCATTER_M, SCATTER_M, 2)
        self._drone.place(start_m)
        self._controller.reset()
        return self._observe({})

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Hold a command, or fly to a target, for one update period; raises ArgumentError for a shape."""
        scaled, said = self._scale * np.clip(of_shape("action", action, (2,)), -1.0, 1.0), {}
        command_rad = command_in_frame("NWU", scaled)
        height_m, climb_m_s, acceleration_m_s2 = (float(part[2]) for part in self._now)
        lift: Vertical | float = Vertical(-height_m, climb_m_s, acceleration_m_s2)
        if self._action == "target":
            target = TargetState.in_frame("NWU", [*scaled, height_m], [0.0, 0.0, climb_m_s])
            if has_height := self._controller.settings.height is not None:
                self._controller.set_thrust(self._drone.report_thrust())
            known_m_s2 = None if has_height else self._drone.thrust_m_s2
            outcome = self._controller.step(self._drone.state, target, known_m_s2)
            command_rad = outcome.command_rad
            if outcome.thrust_m_s2 is not None:
                lift = float(outcome.thrust_m_s2)
            said = {name: getattr(outcome, name) for name in ("status", "saturated", "active")}
        flies = not np.isnan(command_rad).any()
        if flies:
            self._drone.advance(command_rad, lift)
        self._steps += 1
        observation, info = self._observe({name: int(x) for name, x in said.items() if x is not None})
        crashed = self._drone.crashed or not flies
        return observation, CRASH_REWARD * crashed - info["distance_m"], crashed, False, info

    @property
    def _now(self) -> CurvePoint:
        return sample(self._curve, self._steps * self._controller.update_period_s, "NWU", height_m=HEIGHT_M)

    def _observe(self, said: dict[str, int]) -> tuple[Any, dict[str, Any]]:
        """Return observation and info, with what the C said."""
        state = self._drone.state.as_in_frame("NWU")
        position_m, velocity_m_s, attitude_rad = (np.nan_to_num(part, nan=10.0 * LOST_M) for part in state)
        error_m, slowness_m_s = self._now.position_m - position_m, self._now.velocity_m_s - velocity_m_s
        parts = position_m, velocity_m_s, attitude_rad, error_m, slowness_m_s
        bounds = self.observation_space.low, self.observation_space.high
        info = {
            "distance_m": float(np.linalg.norm(error_m)),
            "speed_m_s": float(np.linalg.norm(velocity_m_s[:2])),
            "tilt_limit_rad": self._limits.tilt_rad,
            "speed_limit_m_s": self._limits.speed_m_s,
            "braking_limit_m_s2": self._limits.braking_m_s2,
        }
        return np.clip(np.concatenate(parts), *bounds).astype(np.float32), info | said


gymnasium.register("MamboNmpc-v0", entry_point=MamboNmpcEnv, max_episode_steps=2000)
