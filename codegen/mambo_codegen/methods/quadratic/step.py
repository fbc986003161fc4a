"""Step: a control step from checked inputs to the next command, in the order of its chapter in nmpc.c."""

from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.quadratic.arithmetic import QuadraticArithmetic
from mambo_codegen.methods.quadratic.attitude import AttitudeModel, AttitudeState
from mambo_codegen.methods.quadratic.constants import QuadraticConstants
from mambo_codegen.methods.quadratic.guard import VariationBudget
from mambo_codegen.methods.quadratic.height import HeightAxis, HeightBounds, HeightState, Lift
from mambo_codegen.methods.quadratic.no_height import NoHeight
from mambo_codegen.methods.quadratic.observer import Estimate, KalmanObserver
from mambo_codegen.methods.quadratic.optimizer import QuadraticOptimizer
from mambo_codegen.methods.quadratic.target_observer import ObservedMotion, level_observer, unknown_target
from mambo_codegen.methods.quadratic.tilt_gain import TiltGain, TiltGainState, unknown_gain
from mambo_codegen.methods.shared.inputs import FrameShift, Rows, choose
from mambo_codegen.methods.shared.limits import OF_HEIGHT, ActiveLimit, LimitsLaw, LimitsMemory
from mambo_codegen.methods.shared.math import Real, clamp

_GROUNDED: Final = 9
"""The column of a state that says whether the drone touches the floor, if there is a height."""

_LEVEL: Final = ("position_m", "velocity_m_s", "acceleration_m_s2", "ahead_m_s2", "known")
_UPWARD: Final = ("height_m", "climb_m_s", "climb_acceleration_m_s2", "climb_ahead_m_s2", "known")
"""What is read of a target along x and y, and up."""
REST_M_S: Final = 0.02
"""After an outage the model brakes to this speed along both axes; then the command is level."""


@dataclass(frozen=True)
class QuadraticMemory:
    """State of n controllers between two steps.

    tilt_rad and command_rad are (n, 2), steps_blind (n,) counts control steps since the last good state.
    height_bounds are zeros without a height, as are, without a guard, budget_rad (n, 2), how much the
    commands may vary, and is_coarse (n,), whether no position is measured.
    """

    estimate: Estimate
    attitude: AttitudeState
    target: ObservedMotion
    limits: LimitsMemory
    tilt_rad: Real
    command_rad: Real
    steps_blind: NDArray[np.int64]
    height: HeightState
    height_bounds: HeightBounds
    budget_rad: Real
    is_coarse: Rows
    tilt_gain: TiltGainState


@dataclass(frozen=True)
class CheckedInputs:
    """The inputs of n controllers in a step, zeros where they are not good.

    state (n, k), target (n, k), has_state (n,), and allows_command (n,): whether target and thrust are good.
    """

    state: Real
    has_state: Rows
    target: Real
    allows_command: Rows


@dataclass(frozen=True)
class _Observed:
    """What n controllers know of their drones in a step.

    lift:   the height, and what it makes of a tilt.
    tilt:   (n, 2) acceleration of the tilt, right and forward; world: the same along x and y.
    feedback_rad: (n, 2) what rate feedback adds to the commands.
    steps_blind: (n,) as in the memory.
    """

    attitude: AttitudeState
    lift: Lift
    tilt: Real
    tilt_gain: TiltGainState
    world: Real
    estimate: Estimate
    feedback_rad: Real
    steps_blind: NDArray[np.int64]


@dataclass(frozen=True)
class _Aim:
    """What n controllers aim at in a step.

    target: (n, 4 or more) less the height's columns, and within the limits.
    weight: (n,) by how much more tilts count with the next thrust than in hover; None if no more.
    limit_active: (n,) whether a limit of the height acts.
    steps_blind: (n,) as in the memory.
    has_command: (n,) whether there is a new command.
    rests:  (n,) whether the model has come to rest after an outage.
    """

    target: Real
    motion: ObservedMotion
    limits: LimitsMemory
    height: HeightState
    weight: Real | None
    limit_active: Rows
    steps_blind: NDArray[np.int64]
    has_command: Rows
    rests: Rows


@dataclass(frozen=True)
class _Commanded:
    """What n controllers command in a step; command_rad and budget_rad are (n, 2)."""

    attitude: AttitudeState
    command_rad: Real
    budget_rad: Real
    limits: LimitsMemory


class ControlStep:
    """The parts of a control step, in the scalar type of the controller, and how they work together."""

    def __init__(self, constants: QuadraticConstants) -> None:
        products, constant = QuadraticArithmetic(constants), constants.numbers.constant
        self.products = products
        self.observer = KalmanObserver(constants, products)
        self.model = AttitudeModel(constants, products)
        self.optimizer = QuadraticOptimizer(constants, products, self.model.command_limit)
        self.target_observer = level_observer(constants, products)
        self.limits = LimitsLaw(constants, constants.limiting)
        self.height: HeightAxis | NoHeight = NoHeight(constants)
        if constants.height:
            self.height = HeightAxis(constants, constants.height, products)
        self.tilt_budget: VariationBudget | None = None
        if guard := constants.guard:
            self.tilt_budget = VariationBudget(
                products, guard.tilt_budget_rad, guard.tilt_growth_rad, "angle"
            )
        self.tilt_gain: TiltGain | None = None
        if learnt := constants.tilt_gain:
            self.tilt_gain = TiltGain(learnt, products)
        self._feedback = constants.feedback_steps and np.array(
            [constant(steps, "feedback") for steps in constants.feedback_steps]
        )
        numbers = constants.port.numbers("target")
        self._level, self._upward = (
            [one.column for one in numbers if one.row.member in members] for members in (_LEVEL, _UPWARD)
        )
        self._is_predicted = constants.settings.model.start_attitude == "predicted"
        self._no_estimate = constants.observer.outage_steps + 1
        """`steps_blind` while the model brakes after an outage."""
        self.at_rest = self._no_estimate + 1
        """`steps_blind` before the first good state and when the model has come to rest."""
        self._rest_m_step = constant(REST_M_S * constants.settings.horizon.update_period_s, "speed")

    def advance(self, memory: QuadraticMemory, inputs: CheckedInputs) -> QuadraticMemory:
        """Return the memory after a control step, which observes, aims, commands and predicts."""
        seen = self._observe(memory, inputs)
        memory = replace(memory, tilt_gain=seen.tilt_gain)
        aim = self._aim(memory, inputs, seen)
        commanded = self._command(memory, seen, aim)
        return self._predict(memory, inputs, seen, aim, commanded)

    def restarted(self, command: Real, limits: LimitsMemory, height_bounds: HeightBounds) -> QuadraticMemory:
        """Return the memory of controllers that hold commands (n, 2), with a height (n, 3)."""
        command_rad = command[:, 0:2]
        n, zeros = len(command_rad), np.zeros_like(command_rad)
        height = self.height.steady(command[:, 2:], self.commanded_share(command_rad))
        full = self.tilt_budget.full if self.tilt_budget else 0
        return QuadraticMemory(
            estimate=Estimate(zeros, zeros, zeros),
            attitude=self.model.steady(command_rad, self.height.command_weight(height)),
            target=unknown_target(zeros),
            limits=replace(limits, active=np.zeros_like(limits.active)),
            tilt_rad=zeros,
            command_rad=command_rad,
            steps_blind=np.full(n, self.at_rest),
            height=height,
            height_bounds=height_bounds,
            budget_rad=np.full_like(command_rad, full),
            is_coarse=np.zeros(n, np.bool_),
            tilt_gain=unknown_gain(zeros, self.products.numbers.constant(1.0, "factor")),
        )

    def report_command(self, memory: QuadraticMemory, command: Real) -> QuadraticMemory:
        """Return the memory after commands (n, 2), with a height (n, 3), were sent in place of the last."""
        height = self.height.set_command(memory.height, command[:, 2:])
        weight = self.height.command_weight(height)
        attitude = self._told(memory, memory.attitude, memory.command_rad, command[:, 0:2], weight)
        return replace(memory, command_rad=command[:, 0:2], attitude=attitude, height=height)

    def estimate(self, memory: QuadraticMemory) -> list[Real]:
        """Return the numbers (n, k) of nmpc_estimate_t, in SI units."""
        columns = [*self.observer.estimate(memory.estimate), *self.height.estimate(memory.height)]
        return [*columns, memory.tilt_gain.gain] if self.tilt_gain else columns

    def saturated(self, memory: QuadraticMemory) -> Rows:
        """Return whether roll or pitch (n,) of the last command is that of the largest move, or beyond."""
        limits, sent = memory.limits, partial(self._sent, memory) if self.tilt_gain else None
        limit = self._learnt_limit(memory, limits.command_limit)
        most, least = self.model.largest_commands(limit, limits.bounds.tilt_rad, sent)
        return np.asarray(np.any((memory.command_rad >= most) | (memory.command_rad <= least), axis=1))

    def has_estimate(self, memory: QuadraticMemory) -> NDArray[np.bool_]:
        """Return whether there is an estimate (n,): not before the first good state and after an outage."""
        return memory.steps_blind < self._no_estimate

    def shift(self, memory: QuadraticMemory, jump: FrameShift) -> QuadraticMemory:
        """Return the memory after jumps of the frame."""
        moved = replace(
            memory,
            estimate=self.observer.shift(memory.estimate, jump),
            target=self.target_observer.shift(memory.target, jump.velocity_m_s),
            limits=self.limits.shift(memory.limits, jump.velocity_m_s),
            height=self.height.shift(memory.height, jump),
        )
        sine, cosine = self.products.sine_cosine(jump.heading_rad)
        turned = replace(
            moved,
            estimate=self.observer.turn(moved.estimate, sine, cosine),
            attitude=self.model.shift(moved.attitude, sine, cosine),
            height=self.height.turn(moved.height),
            target=self.target_observer.turn(moved.target, sine, cosine),
        )
        return choose(jump.heading_rad != 0, turned, moved)

    def commanded_share(self, command_rad: Real) -> Real:
        """Return the vertical share (n,) of the thrust with the attitude of commands (n, 2)."""
        vector = self.model.vector
        return self.height.share(command_rad) if vector is None else vector.of_command(command_rad)[0]

    def _observe(self, memory: QuadraticMemory, inputs: CheckedInputs) -> _Observed:
        """Return where the drones are."""
        none_yet = memory.steps_blind >= self._no_estimate
        attitude = self.model.advance(memory.attitude)
        share, slope = self._measure_direction(memory, inputs)
        attitude = self._measure_heading(attitude, inputs, none_yet)
        lift = self.height.observe(memory.height, inputs.state[:, 7:10], share, inputs.has_state, none_yet)
        measured = self._measure_tilt(inputs, slope, lift)
        tilt = np.where(inputs.has_state[:, None], measured, attitude.tilt)
        tilt_gain = self._learn_tilt_gain(memory, inputs, none_yet, attitude.tilt, measured)
        world = self.model.turn_to_world(attitude, tilt)
        estimate = self._correct_estimates(memory, inputs, none_yet, world)
        feedback_rad = self._measure_rates(memory, inputs)
        steps_blind = self._count_blind(memory.steps_blind, inputs.has_state)
        return _Observed(attitude, lift, tilt, tilt_gain, world, estimate, feedback_rad, steps_blind)

    def _measure_direction(self, memory: QuadraticMemory, inputs: CheckedInputs) -> tuple[Real, Real | None]:
        """Return the vertical share (n,) of the thrust, and its slopes (n, 2), None with small angles."""
        angles, vector = inputs.state[:, 4:6], self.model.vector
        if vector is None:
            tilt_rad = np.where(inputs.has_state[:, None], angles, memory.command_rad)
            return self.height.share(tilt_rad), None
        share, slope = vector.of_measured(angles)
        return np.where(inputs.has_state, share, self.commanded_share(memory.command_rad)), slope

    def _measure_heading(
        self, attitude: AttitudeState, inputs: CheckedInputs, none_yet: Rows
    ) -> AttitudeState:
        """Return the models at the measured heading."""
        sine, cosine = self.products.sine_cosine(inputs.state[:, 6])
        measured = choose(
            none_yet,
            replace(attitude, sine=sine, cosine=cosine),
            self.model.turn(attitude, sine, cosine, inputs.allows_command),
        )
        return choose(inputs.has_state, measured, attitude)

    def _measure_tilt(self, inputs: CheckedInputs, slope: Real | None, lift: Lift) -> Real:
        """Return the accelerations (n, 2) of the measured tilt."""
        if slope is None:
            return self.model.measure(inputs.state[:, 4:6], lift.weight)
        return self.model.accelerations(slope, lift.weight)

    def _learn_tilt_gain(
        self, memory: QuadraticMemory, inputs: CheckedInputs, none_yet: Rows, model: Real, measured: Real
    ) -> TiltGainState:
        """Return what the accelerations (n, 2) of the model's and of the measured tilt say of the gain."""
        before = memory.tilt_gain
        if self.tilt_gain is None:
            return before
        restarts = none_yet
        if inputs.state.shape[1] > _GROUNDED:
            restarts = restarts | (inputs.state[:, _GROUNDED] != 0)
        limit = memory.limits.bounds.tilt_rad[:, None]
        learnt = self.tilt_gain.learn(before, model, measured, memory.command_rad, limit)
        kept = self.tilt_gain.restart(before, model, measured, restarts)
        return choose(inputs.has_state, choose(restarts, kept, learnt), before)

    def _correct_estimates(
        self, memory: QuadraticMemory, inputs: CheckedInputs, none_yet: Rows, world: Real
    ) -> Estimate:
        """Return the estimates after the measurement; world (n, 2) is the acceleration of the tilt."""
        estimate, state = memory.estimate, inputs.state
        corrected = choose(
            none_yet,
            self.observer.start(estimate, state),
            self.observer.correct(estimate, state, world, memory.is_coarse),
        )
        return choose(inputs.has_state, corrected, estimate)

    def _measure_rates(self, memory: QuadraticMemory, inputs: CheckedInputs) -> Real:
        """Return what the change of the measured angles since the last step adds to commands (n, 2)."""
        if self._feedback is None:
            return np.zeros_like(memory.tilt_rad)
        change = self.products.feedback_product(self._feedback, inputs.state[:, 4:6] - memory.tilt_rad)
        known = inputs.has_state & (memory.steps_blind == 0)
        return np.where(known[:, None], change, np.zeros_like(change))

    def _count_blind(self, steps_blind: NDArray[np.int64], has_state: Rows) -> NDArray[np.int64]:
        """Return the control steps (n,) since the last good state."""
        waited = np.minimum(steps_blind + 1, np.maximum(steps_blind, self._no_estimate))
        return np.where(has_state, 0, waited)

    def _aim(self, memory: QuadraticMemory, inputs: CheckedInputs, seen: _Observed) -> _Aim:
        """Return what the next commands fly to; the height has its next thrust."""
        follows = inputs.allows_command & (seen.steps_blind < self._no_estimate)
        level, upward = inputs.target[:, self._level], inputs.target[:, self._upward]
        height, limit_active = self.height.aim(
            seen.lift.state, upward, inputs.state[:, 7:10], follows, memory.height_bounds
        )
        weight = self.height.command_weight(height)
        limits, within = self.limits.limit(memory.limits, seen.estimate.position_m, level)
        limits = choose(follows, limits, memory.limits)
        within = np.where(follows[:, None], within, level[:, : within.shape[1]])
        motion, target = self._track_target(memory, level, within, limits, follows)
        aim = _Aim(
            target, motion, limits, height, weight, limit_active, seen.steps_blind, follows, follows & False
        )
        return self._end_outage(aim, seen.estimate)

    def _track_target(
        self, memory: QuadraticMemory, program: Real, aim: Real, limits: LimitsMemory, follows: Rows
    ) -> tuple[ObservedMotion, Real]:
        """Return how the programs' targets move that are followed (n,), and the aims (n, 4 or more)."""
        motion = memory.target
        was_active, active = (one.active & ~OF_HEIGHT for one in (memory.limits, limits))
        found, fitted = self.target_observer.follow(motion, program, aim, active != 0)
        was_limited = (was_active != 0) & motion.is_known
        by_limits = (active & ActiveLimit.FENCE != 0) | self.limits.is_slow(limits.bounds, program)
        within = self.target_observer.follow_limits(found, aim[:, 2:4], was_limited, by_limits)
        found = choose(active != 0, within, found)
        return choose(follows, found, motion), np.where(follows[:, None], fitted, aim)

    def _end_outage(self, aim: _Aim, estimate: Estimate) -> _Aim:
        """Brake by the model's velocity where an outage lasts too long, until the model is at rest."""
        overdue = aim.steps_blind == self._no_estimate
        slow = np.all(np.abs(estimate.velocity_m_step) <= self._rest_m_step, axis=1)
        brakes, rests = overdue & ~slow, overdue & slow
        stopped = np.concatenate([estimate.position_m, np.zeros_like(aim.target[:, 2:])], axis=1)
        active = np.where(brakes, ActiveLimit.BRAKING, np.where(rests, 0, aim.limits.active))
        return replace(
            aim,
            target=np.where(brakes[:, None], stopped, aim.target),
            motion=choose(overdue, unknown_target(aim.motion.velocity_m_s), aim.motion),
            limits=replace(aim.limits, active=active),
            height=self.height.clear_target(aim.height, overdue),
            steps_blind=np.where(rests, self.at_rest, aim.steps_blind),
            has_command=aim.has_command | brakes,
            rests=rests,
        )

    def _command(self, memory: QuadraticMemory, seen: _Observed, aim: _Aim) -> _Commanded:
        """Return what flies to the aim; without one the last commands hold, and at rest they are level."""
        moves, by_thrust = self._minimize(memory, seen, aim)
        moved = replace(seen.attitude, command=self.products.move_acceleration(moves))
        angles_rad = self._find_angles(memory, moved, aim)
        angles_rad = self._limit_angles(memory, angles_rad, seen)
        moved, command, budget = self._guard_commands(memory, moved, angles_rad, aim)
        held = self._hold_command(memory, seen, aim)
        command = np.where(aim.has_command[:, None], command, held)
        attitude, level = choose(aim.has_command, moved, seen.attitude), np.zeros_like(command)
        attitude = choose(aim.rests, self.model.set_command(attitude, level, aim.weight), attitude)
        command = np.where(aim.rests[:, None], level, command)
        return _Commanded(attitude, command, budget, self._report_limits(memory.limits, aim, by_thrust))

    def _minimize(self, memory: QuadraticMemory, seen: _Observed, aim: _Aim) -> tuple[Real, Rows]:
        """Return the first free moves (n, 2), right and forward, by the minimum of the cost along both axes.

        And whether what the thrust leaves limits them (n,).
        """
        attitude, estimate = seen.attitude, seen.estimate
        disturbance = self.observer.disturbance(estimate) - aim.motion.acceleration_m_step2
        errors = (
            estimate.position_m - aim.target[:, 0:2],
            estimate.velocity_m_step - self.products.speed_product(aim.target[:, 2:4]),
            disturbance,
        )
        state = [
            *(self.model.turn_to_heading(attitude, error) for error in errors),
            self.model.turn_to_heading(attitude, aim.motion.jerk_m_step2_update),
            attitude.tilt if self._is_predicted else seen.tilt,
            attitude.integral,
            attitude.lagged,
            attitude.command,
        ]
        limit, left = self._largest_move(memory, aim)
        moves = self.optimizer.minimize(np.stack(state, axis=2), limit)
        if left is None:
            return moves, np.zeros(len(moves), np.bool_)
        return self.limits.shortened(moves, left)

    def _largest_move(self, memory: QuadraticMemory, aim: _Aim) -> tuple[Real, Real | None]:
        """Return the largest moves (n, 2), and what the thrust leaves (n,), None if it does not count."""
        spare = self.height.spare(aim.height)
        limit = self.model.weighed(self._learnt_limit(memory, aim.limits.command_limit), aim.weight)
        if spare is None:
            return limit, None
        left = self.products.to_move(spare)[:, None]
        return np.where(left < limit, left, limit), left[:, 0]

    def _find_angles(self, memory: QuadraticMemory, attitude: AttitudeState, aim: _Aim) -> Real:
        """Return roll and pitch (n, 2) that stand for the commands of models."""
        angles_rad = self.model.command_rad(self.height.over_weight(attitude.command, aim.weight))
        return self._sent(memory, angles_rad)

    def _learnt_limit(self, memory: QuadraticMemory, limit: Real) -> Real:
        """Return the largest moves (n, 2) of drones that tilt as learnt."""
        if self.tilt_gain is None:
            return limit
        return self.products.factor_product(limit, self.tilt_gain.share(memory.tilt_gain))

    def _sent(self, memory: QuadraticMemory, angles_rad: Real) -> Real:
        """Return what is sent (n, 2) to drones that tilt as learnt for angles (n, 2) of the model."""
        return self.tilt_gain.sent(memory.tilt_gain, angles_rad) if self.tilt_gain else angles_rad

    def _told(
        self,
        memory: QuadraticMemory,
        model: AttitudeState,
        asked_rad: Real,
        sent_rad: Real,
        weight: Real | None,
    ) -> AttitudeState:
        """Return models that know what was sent (n, 2) in place of what they asked for (n, 2)."""
        meant = partial(self.tilt_gain.meant, memory.tilt_gain) if self.tilt_gain else None
        return self.model.change_command(model, asked_rad, sent_rad, weight, meant)

    def _limit_angles(self, memory: QuadraticMemory, angles_rad: Real, seen: _Observed) -> Real:
        """Return angles (n, 2) with rate feedback, within the tilt limit."""
        if self._feedback is not None:  # the C adds none where its factor is 0: a sum with 0 has no sign -0
            angles_rad = np.where(self._feedback != 0, angles_rad + seen.feedback_rad, angles_rad)
        return clamp(angles_rad, memory.limits.bounds.tilt_rad[:, None])

    def _guard_commands(
        self, memory: QuadraticMemory, moved: AttitudeState, asked_rad: Real, aim: _Aim
    ) -> tuple[AttitudeState, Real, Real]:
        """Return the models that know what is commanded, the commands (n, 2), and the budgets."""
        budget = memory.budget_rad
        if self.tilt_budget is None:
            return moved, asked_rad, budget
        allowed, left = self.tilt_budget.spend(budget, memory.command_rad, asked_rad)
        command = clamp(allowed, memory.limits.bounds.tilt_rad[:, None])
        told = self._told(memory, moved, asked_rad, command, aim.weight)
        moved = choose((command != asked_rad).any(axis=1), told, moved)
        return moved, command, np.where(aim.has_command[:, None], left, budget)

    def _hold_command(self, memory: QuadraticMemory, seen: _Observed, aim: _Aim) -> Real:
        """Return the last commands (n, 2), less rate feedback."""
        if self._feedback is None:
            return memory.command_rad
        without = self._find_angles(memory, seen.attitude, aim)
        without = clamp(without, memory.limits.bounds.tilt_rad[:, None])
        is_fed = (self._feedback != 0) & (memory.steps_blind == 0)[:, None]
        return np.where(is_fed, without, memory.command_rad)

    def _report_limits(self, before: LimitsMemory, aim: _Aim, by_thrust: Rows) -> LimitsMemory:
        """Return the limits with those of the thrust, which limits the last moves or not (n,)."""
        kept = np.where(aim.rests, 0, before.active & ActiveLimit.THRUST)
        thrust = np.where(aim.has_command, np.where(by_thrust, ActiveLimit.THRUST, 0), kept)
        others = aim.limits.active & ~OF_HEIGHT
        height = np.where(aim.limit_active, ActiveLimit.HEIGHT, 0)
        return replace(aim.limits, active=others + height + thrust)

    def _predict(
        self,
        memory: QuadraticMemory,
        inputs: CheckedInputs,
        seen: _Observed,
        aim: _Aim,
        commanded: _Commanded,
    ) -> QuadraticMemory:
        """Return the memory with the estimates at the next control step."""
        return QuadraticMemory(
            estimate=self.observer.predict(seen.estimate, seen.world),
            attitude=commanded.attitude,
            target=aim.motion,
            limits=commanded.limits,
            tilt_rad=np.where(inputs.has_state[:, None], inputs.state[:, 4:6], memory.tilt_rad),
            command_rad=commanded.command_rad,
            steps_blind=aim.steps_blind,
            height=self.height.predict(aim.height, seen.lift.lies_on_floor),
            height_bounds=memory.height_bounds,
            budget_rad=commanded.budget_rad,
            is_coarse=memory.is_coarse,
            tilt_gain=memory.tilt_gain,
        )
