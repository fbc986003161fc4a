"""The controller between estimates and set-points: take-over, pauses, jumps, thrust of hover."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from mambo_codegen.numbers.gravity import hover_thrust
from mambo_sil.api.api_controller import Controller
from mambo_sil.errors import LinkError
from mambo_sil.flight.frames import turned_tilt, wrapped
from mambo_sil.flight.states import DroneState, StepOutcome, TargetState
from mambo_sil.life.lean import Lean
from mambo_sil.life.prediction import DelayPrediction
from mambo_sil.life.records import EstimatedState, SetAttitude
from mambo_sil.life.steady_frame import FrameJump, SteadyFrame
from mambo_sil.life.swings import Swings
from mambo_sil.model.identify.signals import UPDATES

PAUSE_S: Final = 0.1
"""Time without an estimate after which the controller begins anew, at the present attitude."""
Targets = Callable[[float], TargetState]
"""The target of a course a time ago, in s."""
LEAST_THRUST, MOST_THRUST = 0.05, 1.0
"""Bounds on the share of the largest thrust: with less an autopilot takes itself for landed."""
AT_LIMIT: Final = 0.99
"""Share of the largest disturbance that the controller learns, from which on it is at that limit."""
LEARNS_S: Final = 3.0
"""Time constant of the mean thrust that the flight needs."""


@dataclass(frozen=True, eq=False)
class Update:
    """One step of the controller: what it got, and what it commanded."""

    estimate: EstimatedState
    """As the controller got it: ahead by the delay of the link."""
    target: TargetState
    """As the controller got it: off by the rest of the jumps of the estimator."""
    command_rad: tuple[float, float]
    thrust_m_s2: float
    status: int
    take_overs: int
    number: int
    """Steps of the controller so far, those between two estimates included, modulo `UPDATES`."""
    start_thrust_m_s2: float
    """Thrust over mass with which the controller began."""
    thrust: float
    """Share of the largest thrust."""
    jumps: int
    jump: FrameJump | None
    """That of the estimator before this step, if there was one."""


class Steering:
    """Flies one drone with a controller of its height.

    `hover_thrust` is the share of the largest thrust that carries the drone; the controller learns an error
    of it as a steady disturbance. Raises LinkError for a controller that does not command the thrust.
    """

    def __init__(self, controller: Controller, record: Callable[[Update], None]) -> None:
        if controller.settings.height is None:
            raise LinkError(
                "the settings have no [height], but the autopilot wants roll, pitch and thrust from one "
                "controller: derive settings from a drone with [thrust] or [rotors] (mambo-nmpc design)"
            )
        self.controller = controller
        self.hover_m_s2 = hover_thrust(controller.settings)
        """The thrust over mass that the controller commands in hover."""
        self.hover_thrust = self.mean_thrust = math.nan
        """The shares of the largest thrust that carry the drone: as the autopilot says, and in the mean."""
        self.is_accepted = True
        """Whether the controller has accepted the last state."""
        self.away_m = 0.0
        """How far the drone is from the last target that the controller got."""
        self.pushed_s = 0.0
        """For how long the disturbance has been at the limit of what the controller learns."""
        self.frame = SteadyFrame()
        self.swings = Swings(controller.settings.limits.tilt_rad)
        most_m_s2 = AT_LIMIT * controller.settings.observer.disturbance_limit_m_s2
        self.lean = Lean(controller.settings.model.drag_1_s, most_m_s2)
        self.prediction = DelayPrediction(controller.settings, controller.settings.height, self.hover_m_s2)
        self.take_overs = 0
        self._steps = 0
        self._record = record
        self._last: EstimatedState | None = None
        self._jump: FrameJump | None = None
        """That of the estimator since the last step."""
        self._sent_rad, self._sent_m_s2, self._yaw_rad = np.zeros(2), self.hover_m_s2, 0.0
        self._clock_s = -math.inf

    def begin(self, estimate: EstimatedState) -> None:
        """Begin anew at an estimate, with the thrust of hover, and lean against the wind."""
        self.lean.begin(self.controller.disturbance_m_s2[0])
        roll_rad, pitch_rad, yaw_rad = self.lean.upright(estimate).attitude_rad.tolist()
        most_rad = self.controller.settings.limits.tilt_rad
        self._sent_rad = np.clip([roll_rad, pitch_rad], -most_rad, most_rad)
        self._sent_m_s2 = self.hover_m_s2
        self.controller.reset(self._sent_rad, thrust_m_s2=self._sent_m_s2)
        self.prediction.begin(self._sent_rad)
        self.frame.begin(estimate)
        self.swings.begin()
        self.pushed_s = 0.0
        self._last = self._jump = None
        self._clock_s = estimate.time_s - self.controller.update_period_s
        self._yaw_rad = yaw_rad - self.frame.heading_change_rad
        self.take_overs += 1

    def is_due(self, estimate: EstimatedState) -> bool:
        """Return whether the period of the last set-point is over at an estimate."""
        return estimate.time_s - self._clock_s > 0.5 * self.controller.update_period_s

    def steer(self, estimate: EstimatedState, targets: Targets) -> SetAttitude:
        """Return the set-point for an estimate that is due.

        The controller steps once for each of its periods that has passed: where the pilot was late, with
        states between the last one and this, and with the command that was sent last.
        """
        period_s = self.controller.update_period_s
        if estimate.time_s - self._clock_s > PAUSE_S:
            self.begin(estimate)
        steps = max(round((estimate.time_s - self._clock_s) / period_s), 1)
        self._clock_s += steps * period_s
        self._follow_frame(estimate)
        self._steps += steps
        push_m_s2 = self.controller.disturbance_m_s2[0]
        estimate = self.prediction.ahead(self.lean.upright(estimate), push_m_s2)
        last, self._last = self._last or estimate, estimate
        for left in range(steps - 1, 0, -1):
            self._step(_between(last, estimate, 1.0 - left / steps), self._goal(targets(left * period_s)))
            self.controller.report_command(self._sent_rad, self._sent_m_s2)
        target = self._goal(targets(0.0))
        outcome = self._step(estimate, target)
        set_point = self._send(estimate, target, outcome, steps * period_s)
        self.lean.fade(steps * period_s)
        return set_point

    def _follow_frame(self, estimate: EstimatedState) -> None:
        """Tell the controller of a jump of the estimator, and turn the lean with it."""
        jump = self.frame.follow(estimate)
        if jump is None:
            return
        self.controller.frame_jumped(jump.position_m, jump.velocity_m_s, jump.heading_rad)
        self.lean.turn(jump.heading_rad)
        self._jump = jump if self._jump is None else _sum(self._jump, jump)
        if self._last is not None:
            self._last = _moved(self._last, jump)

    def _step(self, estimate: EstimatedState, target: TargetState) -> StepOutcome:
        state = DroneState(estimate.position_m, estimate.velocity_m_s, estimate.attitude_rad)
        outcome = self.controller.step(state, target)
        push_m_s2 = self.controller.disturbance_m_s2[0] - self.lean.against_m_s2
        is_pushed = float(np.abs(push_m_s2).max()) >= AT_LIMIT * self.most_disturbance_m_s2
        self.pushed_s = self.pushed_s + self.controller.update_period_s if is_pushed else 0.0
        return outcome

    @property
    def most_disturbance_m_s2(self) -> float:
        """The largest disturbance that the controller learns along x or y."""
        return self.controller.settings.observer.disturbance_limit_m_s2

    def _goal(self, target: TargetState) -> TargetState:
        """Return the target that the controller gets for one of the course.

        It has the heading at which the controller began, if the course says none.
        """
        moved = self.frame.moved(target)
        yaw_rad = self._heading_rad if moved.yaw_rad is None else moved.yaw_rad
        return TargetState(
            moved.position_m,
            moved.velocity_m_s,
            moved.acceleration_m_s2,
            yaw_rad,
            ahead_m_s2=moved.ahead_m_s2,
        )

    def _send(
        self, estimate: EstimatedState, target: TargetState, outcome: StepOutcome, passed_s: float
    ) -> SetAttitude:
        """Return the set-point of an outcome, and record it; the controller learns of a capped thrust."""
        roll_rad, pitch_rad, heading_rad, thrust_m_s2 = outcome.attitude_thrust("NED").tolist()
        command_rad, most_rad = np.array([roll_rad, pitch_rad]), self.controller.settings.limits.tilt_rad
        lean_rad = self.lean.tilt_rad(float(estimate.attitude_rad[2]))
        leaning_rad = np.clip(command_rad + lean_rad, -most_rad, most_rad)
        more = float(np.prod(np.cos(command_rad)) / np.prod(np.cos(leaning_rad)))
        share = more * thrust_m_s2 / self.hover_m_s2 * self.hover_thrust
        thrust = min(max(share, LEAST_THRUST), MOST_THRUST)
        upright_m_s2 = thrust / more / self.hover_thrust * self.hover_m_s2
        if thrust != share:
            self.controller.report_thrust(upright_m_s2)
        self.prediction.sent(estimate.time_s, command_rad, upright_m_s2, passed_s)
        self.swings.watch(command_rad, estimate.time_s)
        self._sent_rad, self._sent_m_s2 = command_rad, thrust_m_s2
        self.mean_thrust += (thrust - self.mean_thrust) * min(passed_s / LEARNS_S, 1.0)
        self.is_accepted = int(outcome.status) == 0
        self.away_m = float(np.linalg.norm(target.position_m - estimate.position_m))
        self._record(
            Update(
                *(estimate, target, (roll_rad, pitch_rad), thrust_m_s2, int(outcome.status)),
                *(self.take_overs, self._steps % UPDATES, self.hover_m_s2, thrust, self.frame.jumps),
                self._jump,
            )
        )
        self._jump = None
        turn_rad, (roll_rad, pitch_rad) = heading_rad - float(estimate.attitude_rad[2]), leaning_rad.tolist()
        attitude_rad = np.array([*turned_tilt(roll_rad, pitch_rad, turn_rad), heading_rad])
        return SetAttitude(estimate.time_s, attitude_rad, thrust)

    def level(self, time_s: float) -> SetAttitude:
        """Return a level set-point with the thrust of hover, for a drone whose state is not known.

        The controller, which knows nothing of it, begins anew after it.
        """
        self._clock_s = -math.inf
        return SetAttitude(time_s, np.array([0.0, 0.0, self._heading_rad]), self.mean_thrust)

    @property
    def _heading_rad(self) -> float:
        """The heading at which the controller began, in the present frame of the estimator."""
        return self._yaw_rad + self.frame.heading_change_rad


def _moved(estimate: EstimatedState, jump: FrameJump) -> EstimatedState:
    """Return an estimate of the old frame in the new one."""
    return replace(
        estimate,
        position_m=estimate.position_m + jump.position_m,
        velocity_m_s=estimate.velocity_m_s + jump.velocity_m_s,
        attitude_rad=estimate.attitude_rad + np.array([0.0, 0.0, jump.heading_rad]),
    )


def _sum(one: FrameJump, other: FrameJump) -> FrameJump:
    """Return two jumps as one."""
    return FrameJump(
        one.position_m + other.position_m,
        one.velocity_m_s + other.velocity_m_s,
        one.heading_rad + other.heading_rad,
    )


def _between(last: EstimatedState, now: EstimatedState, share: float) -> EstimatedState:
    """Return the estimate on the line from the last one to now, after a share of the way."""
    turned_rad = wrapped(now.attitude_rad - last.attitude_rad)
    return EstimatedState(
        last.time_s + share * (now.time_s - last.time_s),
        last.position_m + share * (now.position_m - last.position_m),
        last.velocity_m_s + share * (now.velocity_m_s - last.velocity_m_s),
        last.attitude_rad + share * turned_rad,
    )
