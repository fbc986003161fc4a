"""The controller between estimates and set-points: take-over, pauses, jumps of the estimator, hover thrust."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.api.api_controller import Controller
from mambo_sil.api.states import DroneState, TargetState
from mambo_sil.errors import LinkError
from mambo_sil.link.records import Estimate, SetAttitude
from mambo_sil.link.steady_frame import SteadyFrame

PAUSE_S: Final = 0.1
"""Time without an estimate after which the controller begins anew, at the present attitude."""
LEAST_THRUST, MOST_THRUST = 0.05, 1.0
"""Bounds on the share of the largest thrust: with less an autopilot takes itself for landed."""
LEARNS_S: Final = 3.0
"""Time constant of the mean thrust that the flight needs."""


@dataclass(frozen=True, eq=False)
class Update:
    """One step of the controller: what it got, and what it commanded."""

    estimate: Estimate
    """As the controller got it."""
    target: TargetState
    command_rad: tuple[float, float]
    thrust_m_s2: float
    status: int
    take_overs: int
    thrust: float
    """Share of the largest thrust."""
    jumps: int


class Steering:
    """Flies one drone with a controller of its height; `hover_thrust` turns thrust over mass into a share.

    A thrust over mass of g is that share; an error of it is learnt by the controller as a steady
    disturbance. Raises LinkError for a controller that does not command the thrust.
    """

    def __init__(self, controller: Controller, record: Callable[[Update], None]) -> None:
        if controller.settings.height is None:
            raise LinkError(
                "the settings have no [height], but the autopilot wants roll, pitch and thrust from one "
                "controller: derive settings from a drone with [thrust] or [rotors] (mambo-nmpc design)"
            )
        self.controller = controller
        self.hover_thrust = math.nan
        self.mean_thrust = math.nan
        """The share of the largest thrust that the flight needs on average."""
        self.frame = SteadyFrame()
        self.take_overs = 0
        self._record = record
        self._yaw_rad = 0.0
        self._last_s = -math.inf

    def begin(self, estimate: Estimate) -> None:
        """Begin anew at an estimate, with the thrust of hover."""
        roll_rad, pitch_rad, yaw_rad = estimate.attitude_rad.tolist()
        most_rad = self.controller.settings.limits.tilt_rad
        command_rad = np.clip([roll_rad, pitch_rad], -most_rad, most_rad)
        self.controller.reset(command_rad, thrust_m_s2=GRAVITY_M_S2)
        self.frame.begin(estimate)
        self._yaw_rad = yaw_rad - self.frame.heading_change_rad
        self.take_overs += 1

    def steer(self, estimate: Estimate, target: TargetState) -> tuple[SetAttitude, float, bool]:
        """Return the set-point for an estimate, the time since the last one, and whether it was accepted.

        The controller begins anew after a pause, which counts as no time.
        """
        if estimate.time_s - self._last_s > PAUSE_S:
            self.begin(estimate)
            self._last_s = estimate.time_s
        passed_s = estimate.time_s - self._last_s
        self._last_s = estimate.time_s
        held = self.frame.hold(estimate)
        yaw_rad = self._heading_rad if target.yaw_rad is None else target.yaw_rad
        turned = TargetState(target.position_m, target.velocity_m_s, target.acceleration_m_s2, yaw_rad)
        outcome = self.controller.step(
            DroneState(held.position_m, held.velocity_m_s, held.attitude_rad), turned
        )
        roll_rad, pitch_rad, heading_rad, thrust_m_s2 = outcome.attitude_thrust("NED").tolist()
        share = thrust_m_s2 / GRAVITY_M_S2 * self.hover_thrust
        thrust = min(max(share, LEAST_THRUST), MOST_THRUST)
        if thrust != share:
            self.controller.set_thrust(thrust / self.hover_thrust * GRAVITY_M_S2)
        self._learn(thrust, passed_s)
        update = Update(
            *(held, turned, (roll_rad, pitch_rad), thrust_m_s2, int(outcome.status)),
            *(self.take_overs, thrust, self.frame.jumps),
        )
        self._record(update)
        attitude_rad = np.array([roll_rad, pitch_rad, heading_rad])
        return SetAttitude(estimate.time_s, attitude_rad, thrust), passed_s, update.status == 0

    def level(self, time_s: float) -> SetAttitude:
        """Return a level set-point with the thrust of hover, for a drone whose state is not known."""
        thrust = self.mean_thrust if math.isfinite(self.mean_thrust) else self.hover_thrust
        return SetAttitude(time_s, np.array([0.0, 0.0, self._heading_rad]), thrust)

    @property
    def _heading_rad(self) -> float:
        """The heading at which the controller began, in the present frame of the estimator."""
        return self._yaw_rad + self.frame.heading_change_rad

    def _learn(self, thrust: float, passed_s: float) -> None:
        if not math.isfinite(self.mean_thrust):
            self.mean_thrust = self.hover_thrust
        self.mean_thrust += (thrust - self.mean_thrust) * passed_s / LEARNS_S
