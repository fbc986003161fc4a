"""Controller: checks the inputs of a step, predicts, optimizes the plan and applies its first move."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.methods.one_norm import cost
from mambo_codegen.methods.one_norm.arithmetic import OneNormArithmetic
from mambo_codegen.methods.one_norm.constants import OneNormConstants
from mambo_codegen.methods.one_norm.optimizer import Minimize, Rprop, Search
from mambo_codegen.methods.one_norm.predictor import Prediction, Predictor
from mambo_codegen.methods.shared.inputs import Inputs, Status, choose
from mambo_codegen.methods.shared.limits import LimitsMemory, forgotten_target, limits_law
from mambo_codegen.methods.shared.math import Real, clamp
from mambo_codegen.methods.shared.tracker import TargetMotion, Tracker, unknown_motion
from mambo_codegen.numbers.gravity import hover_thrust
from mambo_codegen.numbers.representation import WEIGHTS


@dataclass(frozen=True)
class OneNormMemory:
    """State of n controllers between two steps.

    command_rad, the first moves of the last plan, is (n, 2), plan_rad (n, control, 2), weights (n, 2), cost
    (n,), gradient (n, control, 2), iterations (n,), converged (n,). Without a tracker `target` stays unknown,
    without limits `limits` zeros. steps_blind (n,) counts steps since the last good state with limits.
    sent_rad (n, 2) are the last commands, tilt_rad (n, 2) the angles of the last good step, has_tilt (n,)
    whether there was one.
    """

    command_rad: Real
    plan_rad: Real
    weights: Real
    cost: Real
    gradient: Real
    iterations: NDArray[np.int64]
    converged: NDArray[np.bool_]
    target: TargetMotion
    limits: LimitsMemory
    steps_blind: NDArray[np.int64]
    sent_rad: Real
    tilt_rad: Real
    has_tilt: NDArray[np.bool_]


@dataclass(frozen=True)
class OneNormStep:
    """The result of one step of n controllers; after bad input all but the status is of the last good step.

    status:      (n,) a `Status` each.
    command_rad: (n, 2) roll and pitch commands, in rad.
    cost:        (n,) cost of the plan that the last iteration evaluated.
    gradient:    (n, control, 2) gradient of that plan, per rad.
    plan_rad:    (n, control, 2) the optimized moves; the first and the rate feedback are the command.
    iterations:  (n,) updates made.
    converged:   (n,) whether the cost changed by less than the tolerance between two iterations.
    limits:      (n, k) all numbers of nmpc_bounds_t in their order; None without limits, as the next two.
    steps_blind: (n,) control steps since the last good state.
    active_limits: (n,) the limits that act, as `ActiveLimit`, but TILT.

    With fixed point the numbers are the integers of the C, converted exactly to SI units in float64.
    """

    status: NDArray[np.int64]
    command_rad: Real
    cost: Real
    gradient: Real
    plan_rad: Real
    iterations: NDArray[np.int64]
    converged: NDArray[np.bool_]
    limits: Real | None = None
    steps_blind: NDArray[np.int64] | None = None
    active_limits: NDArray[np.int64] | None = None


class OneNormController:
    """n controllers in NumPy that compute the bits of the generated C.

    `minimize` may be wrapped to record the iterations of the optimizer.
    """

    def __init__(self, constants: OneNormConstants, n: int = 1, minimize: Minimize = Rprop.minimize) -> None:
        settings, products = constants.settings, OneNormArithmetic(constants)
        self._constants = constants
        self.settings = settings
        self._numbers, self._inputs = constants.numbers, Inputs(constants)
        self._products = products
        self._feedback = constants.feedback_steps and np.array(
            [constants.numbers.constant(steps, "feedback") for steps in constants.feedback_steps]
        )
        self._predictor = Predictor(constants, products)
        self._tracker = Tracker(constants.tracker, products) if constants.tracker else None
        self._limits = limits_law(constants)
        self._outage_steps = constants.outage_steps
        self._rprop = Rprop(settings, products)
        self._minimize = minimize
        self._evaluated: tuple[Prediction, Real] | None = None
        """The plans (n, control, 2) that were evaluated last."""
        self.scalar = self._numbers.scalar
        control, computed = settings.horizon.control, self._numbers.computed
        weights = [settings.cost.tracking_weight, settings.cost.effort_weight]
        self.memory = OneNormMemory(
            command_rad=np.zeros((n, 2), computed),
            plan_rad=np.zeros((n, control, 2), computed),
            weights=np.tile(self._inputs.numbers([weights], WEIGHTS), (n, 1)),
            cost=np.zeros(n, computed),
            gradient=np.zeros((n, control, 2), computed),
            iterations=np.zeros(n, np.int64),
            converged=np.zeros(n, np.bool_),
            target=unknown_motion(np.zeros((n, 2), computed)),
            limits=self._limits.memory(np.repeat(self._limits.defaults, n, axis=0)),
            steps_blind=np.zeros(n, np.int64),
            sent_rad=np.zeros((n, 2), computed),
            tilt_rad=np.zeros((n, 2), computed),
            has_tilt=np.zeros(n, np.bool_),
        )

    def reset(self, command_rad: ArrayLike) -> NDArray[np.int64]:
        """Set last command and plan to `command_rad` (n, 2), clamped to the tilt limit; forget the target.

        Returns a status (n,); a command that is not finite, or beyond the range of attitudes, changes
        nothing.
        """
        given, good = self._inputs.command(command_rad)
        self.memory = choose(good, self._held(clamp(given, self._tilt_limit())), self.memory)
        return np.where(good, Status.OK, Status.BAD_COMMAND)

    def frame_jumped(self, change: ArrayLike) -> NDArray[np.int64]:
        """Tell the controllers that their frames have jumped: `change` (n, 5).

        The columns are changes of x and y (m), of the velocities (m/s), and of the heading (rad). Returns a
        status (n,); a change that is not finite, or out of range, changes nothing.
        """
        jump, good = self._inputs.shift(change)
        memory, motion = self.memory, self.memory.target
        if self._tracker is not None:
            motion = self._tracker.shift(motion, jump.velocity_m_s)
            turned = self._tracker.turn(motion, *self._products.sine_cosine(jump.heading_rad))
            motion = choose(jump.heading_rad != 0, turned, motion)
        limits = self._limits.shift(memory.limits, jump.velocity_m_s)
        self.memory = choose(good, replace(memory, target=motion, limits=limits), memory)
        return np.where(good, Status.OK, Status.BAD_JUMP)

    def set_limits(self, limits: ArrayLike) -> NDArray[np.int64]:
        """Replace the limits by `limits` (n, 7), in the order of nmpc_limits_t.

        Returns a status (n,); bad limits change nothing. Raises ValueError without limits in the settings.
        """
        given, good = self._limits.read(limits)
        new = replace(self.memory.limits, bounds=self._limits.memory(given).bounds)
        memory, tilt = self.memory, new.bounds.tilt_rad[:, None]
        limited = replace(
            memory,
            command_rad=clamp(memory.command_rad, tilt),
            plan_rad=clamp(memory.plan_rad, tilt[:, None]),
            limits=new,
            sent_rad=clamp(memory.sent_rad, tilt),
        )
        self.memory = choose(good, limited, memory)
        return np.where(good, Status.OK, Status.BAD_LIMITS)

    def set_weights(self, weights: ArrayLike) -> NDArray[np.int64]:
        """Replace tracking and effort weight by `weights` (n, 2), each from 0 to its limit.

        Returns a status (n,); bad weights change nothing.
        """
        given = self._inputs.numbers(weights, WEIGHTS)
        good = np.all((given >= 0) & (given <= self._inputs.limits.weights), axis=1)
        self.memory = replace(self.memory, weights=np.where(good[:, None], given, self.memory.weights))
        return np.where(good, Status.OK, Status.BAD_WEIGHT)

    def step(
        self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike | None = None
    ) -> OneNormStep:
        """Compute the next commands.

        state (n, 7): x, y (m), vx, vy (m/s), roll, pitch, yaw (rad), world frame, north-east-down.
        target (n, 4): x, y (m), vx, vy (m/s).
        thrust_acceleration_m_s2 (n,): thrust over mass, up.
        """
        states, targets, thrusts = self._inputs.quantize(state, target, thrust_acceleration_m_s2)
        status = self._inputs.status(*self._inputs.check(states, targets, thrusts))
        good = status == Status.OK
        zero = self._numbers.computed(0)
        states, targets = (np.where(good[:, None], given, zero) for given in (states, targets))
        thrusts = np.where(good, thrusts, self._inputs.limits.thrust_least)
        if self.settings.model.thrust == "hover":
            thrusts = np.full_like(thrusts, self._numbers.constant(hover_thrust(self.settings), "thrust"))
        limits, motion, within = self._limits.aim(
            self.memory.limits, self.memory.target, states[:, 0:2], targets, good
        )
        if self._tracker is not None:
            motion = self._tracker.update(motion, within[:, 2:4])
        searched = self._search(states, within, thrusts, motion.acceleration_m_step2)
        new = replace(
            self.memory,
            command_rad=searched.moves_rad[:, 0],
            plan_rad=searched.moves_rad,
            cost=searched.cost,
            gradient=searched.gradient,
            iterations=searched.iterations,
            converged=searched.converged,
            target=motion,
            limits=limits,
            steps_blind=np.zeros(len(states), np.int64),
            sent_rad=self._command(searched.moves_rad[:, 0], states[:, 4:6]),
            tilt_rad=states[:, 4:6],
            has_tilt=np.ones(len(states), np.bool_),
        )
        held = replace(self.memory, sent_rad=self.memory.command_rad)  # without the rate feedback
        new = self.memory = self._after_outage(status, choose(good, new, held))
        to_si, has_limits = self._numbers.to_si, self._constants.has_limits
        return OneNormStep(
            status=status,
            command_rad=to_si(new.sent_rad, "angle"),
            cost=to_si(new.cost, "cost"),
            gradient=to_si(new.gradient, "gradient"),
            plan_rad=to_si(new.plan_rad, "angle"),
            iterations=new.iterations,
            converged=new.converged,
            limits=to_si(self.stored_limits, *self._constants.limits_stored) if has_limits else None,
            steps_blind=new.steps_blind if has_limits else None,
            active_limits=new.limits.active if has_limits else None,
        )

    @property
    def stored_limits(self) -> Real:
        """All numbers of nmpc_bounds_t (n, k), in their order; k is 0 without limits."""
        none = np.zeros((len(self.memory.command_rad), 0), self._numbers.computed)
        return np.concatenate([none, *self._limits.stored(self.memory.limits, has_command=False)], axis=1)

    @property
    def last_estimate(self) -> Real:
        """No numbers (n, 0): nothing is estimated."""
        return np.zeros((len(self.memory.command_rad), 0), self._numbers.computed)

    @property
    def deciding(self) -> NDArray[np.bool_]:
        """Of which rows of `response_sum` the last gradients consist (n, prediction)."""
        assert self._evaluated is not None, "asked for behind a step"
        return cost.rows_used(self._predictor.errors(*self._evaluated))

    @property
    def has_estimate(self) -> NDArray[np.bool_]:
        """Return that there is no estimate (n,)."""
        return np.zeros(len(self.memory.command_rad), np.bool_)

    @property
    def outcome(self) -> dict[str, NDArray[Any]]:
        """What the last call left, in the numbers of the C."""
        memory = self.memory
        limits = {
            "limits": self.stored_limits,
            "steps_blind": memory.steps_blind,
            "active_limits": memory.limits.active,
        }
        return {
            "iterations": memory.iterations,
            "converged": memory.converged,
            "saturated": np.any(np.abs(memory.sent_rad) >= self._tilt_limit(), axis=1),
            "command_rad": memory.sent_rad,
            "cost": memory.cost,
            "gradient": memory.gradient,
            "plan_rad": memory.plan_rad,
        } | (limits if self._constants.has_limits else {})

    def _command(self, moves_rad: Real, tilt_rad: Real) -> Real:
        """Return the commands (n, 2): the first moves, and what the rates of the attitude add."""
        if self._feedback is None:
            return moves_rad
        memory = self.memory
        change = self._products.feedback_product(self._feedback, tilt_rad - memory.tilt_rad)
        added = np.where(memory.has_tilt[:, None], moves_rad + change, moves_rad)
        return clamp(added, self._tilt_limit())

    def _tilt_limit(self) -> Real:
        """Return the tilt limits (n, 1)."""
        return self.memory.limits.bounds.tilt_rad[:, None]

    def _held(self, command: Real) -> OneNormMemory:
        """Return the memory of controllers that hold commands (n, 2) and have forgotten the target."""
        n, limits = len(command), self.memory.limits
        return replace(
            self.memory,
            command_rad=command,
            plan_rad=np.broadcast_to(command[:, None], self.memory.plan_rad.shape),
            target=unknown_motion(command),
            limits=forgotten_target(limits),
            steps_blind=np.zeros(n, np.int64),
            sent_rad=command,
            has_tilt=np.zeros(n, np.bool_),
        )

    def _after_outage(self, status: NDArray[np.int64], memory: OneNormMemory) -> OneNormMemory:
        """Return the memory with one more bad state where it was bad; the command is level after many."""
        if self._outage_steps is None:
            return memory
        bad = status == Status.BAD_STATE
        steps_blind = np.where(
            bad, np.minimum(memory.steps_blind + 1, self._outage_steps), memory.steps_blind
        )
        memory = replace(memory, steps_blind=steps_blind)
        level = replace(self._held(np.zeros_like(memory.sent_rad)), steps_blind=steps_blind)
        return choose(bad & (steps_blind == self._outage_steps), level, memory)

    def _search(self, state: Real, target: Real, thrust: Real, target_acceleration: Real) -> Search:
        memory = self.memory
        acceleration = None if self._tracker is None else target_acceleration
        prediction = self._predictor.prepare(state, target, thrust, acceleration)

        def evaluate(moves_rad: Real) -> tuple[Real, Real]:
            self._evaluated = prediction, moves_rad
            return cost.evaluate(self._predictor, prediction, memory.weights, moves_rad, memory.command_rad)

        start = memory.plan_rad
        self._rprop.limit = self._tilt_limit()[:, :, None]
        if self.settings.optimizer.warm_start == "last_command":
            start = np.repeat(memory.command_rad[:, None], start.shape[1], axis=1)
        return self._minimize(self._rprop, evaluate, start)
