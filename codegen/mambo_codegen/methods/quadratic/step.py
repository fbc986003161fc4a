"""Step: a control step from checked inputs to the next command, in the order of its chapter in nmpc.c."""

from dataclasses import dataclass, replace
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
from mambo_codegen.methods.quadratic.tilt_gain import TiltGain, TiltGainState
from mambo_codegen.methods.shared.inputs import FrameShift, Rows, choose
from mambo_codegen.methods.shared.limits import ActiveLimit, LimitsMemory, limits_law
from mambo_codegen.methods.shared.math import Real, clamp
from mambo_codegen.methods.shared.tracker import TargetMotion, Tracker, unknown_motion

_GROUNDED: Final = 9
"""The column of a state that says whether the drone touches the floor, if there is a height."""

REST_M_S: Final = 0.02
"""After an outage the model brakes to this speed along both axes; then the command is level."""


@dataclass(frozen=True)
class QuadraticMemory:
    """State of n controllers between two steps.

    tilt_rad and command_rad are (n, 2), missed (n,) counts control steps since the last good state.
    height_bounds is None unless there are limits and a height. budget_rad (n, 2) is how much the commands may
    vary, is_coarse (n,) whether no position is measured; zeros without a guard.
    """

    estimate: Estimate
    attitude: AttitudeState
    target: TargetMotion
    limits: LimitsMemory
    tilt_rad: Real
    command_rad: Real
    missed: NDArray[np.int64]
    height: HeightState
    height_bounds: HeightBounds | None
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
class _Aim:
    """What n controllers aim at in a step.

    target: (n, 4 or more) less the height's columns, and within the limits.
    weight: (n,) by how much more tilts count with the next thrust than in hover; None if no more.
    missed: (n,) as in the memory.
    has_command: (n,) whether there is a new command.
    rests:  (n,) whether the model has come to rest after an outage.
    """

    target: Real
    motion: TargetMotion
    limits: LimitsMemory
    height: HeightState
    weight: Real | None
    missed: NDArray[np.int64]
    has_command: Rows
    rests: Rows


class ControlStep:
    """The parts of a control step, in the scalar type of the controller, and how they work together."""

    def __init__(self, constants: QuadraticConstants) -> None:
        products, constant = QuadraticArithmetic(constants), constants.numbers.constant
        self.products = products
        self.observer = KalmanObserver(constants, products)
        self.model = AttitudeModel(constants, products)
        self.optimizer = QuadraticOptimizer(constants, products, self.model.command_limit)
        self.tracker = Tracker(constants.tracker, products) if constants.tracker else None
        self.limits = limits_law(constants)
        self.height: HeightAxis | NoHeight = NoHeight(constants)
        if constants.height:
            self.height = HeightAxis(constants, constants.height, products)
        self.tilt_budget: VariationBudget | None = None
        if guard := constants.guard:
            self.tilt_budget = VariationBudget(products, guard.tilt_rad, guard.tilt_growth_rad, "angle")
        self.tilt_gain: TiltGain | None = None
        if learnt := constants.tilt_gain:
            self.tilt_gain = TiltGain(learnt, products)
        self._feedback = constants.feedback_steps and np.array(
            [constant(steps, "feedback") for steps in constants.feedback_steps]
        )
        self._level_columns = len(constants.level_target)
        self._is_predicted = constants.settings.model.attitude == "predicted"
        self._no_estimate = constants.observer.outage_steps + 1
        """`missed` while the model brakes after an outage, and without limits from then on."""
        self.at_rest = self._no_estimate + self.limits.brake
        """`missed` before the first good state and when the model has come to rest."""
        self._rest_m_step = constant(REST_M_S * constants.settings.horizon.update_period_s, "speed")

    def advance(self, memory: QuadraticMemory, inputs: CheckedInputs) -> QuadraticMemory:
        """Return the memory after a control step."""
        none_yet, has_state = memory.missed >= self._no_estimate, inputs.has_state
        attitude = self._turn(memory.attitude, inputs, none_yet)
        angles, seen = inputs.state[:, 4:6], has_state[:, None]
        share, slope = self._direction(memory, inputs)
        lift = self.height.observe(memory.height, inputs.state[:, 7:10], share, has_state, none_yet)
        measured = (
            self.model.measure(angles, lift.weight)
            if slope is None
            else self.model.accelerations(slope, lift.weight)
        )
        tilt = np.where(seen, measured, attitude.tilt)
        memory = replace(memory, tilt_gain=self._learn(memory, inputs, none_yet, attitude.tilt, measured))
        world = self._to_world(attitude, tilt)
        estimate = self._observe(memory, inputs, none_yet, world)
        aim = self._aim(memory, inputs, lift, estimate)
        moves, by_thrust = self._minimize(memory, attitude, estimate, aim, tilt)
        attitude, command, budget = self._command(memory, inputs, attitude, moves, aim)
        return QuadraticMemory(
            estimate=self.observer.predict(estimate, world),
            attitude=attitude,
            target=aim.motion,
            limits=self._with_thrust(memory.limits, aim, by_thrust),
            tilt_rad=np.where(seen, angles, memory.tilt_rad),
            command_rad=command,
            missed=aim.missed,
            height=self.height.predict(aim.height, lift.on_ground),
            height_bounds=memory.height_bounds,
            budget_rad=budget,
            is_coarse=memory.is_coarse,
            tilt_gain=memory.tilt_gain,
        )

    def has_estimate(self, memory: QuadraticMemory) -> NDArray[np.bool_]:
        """Return whether there is an estimate (n,): not before the first good state and after an outage."""
        return memory.missed < self._no_estimate

    def shift(self, memory: QuadraticMemory, jump: FrameShift) -> QuadraticMemory:
        """Return the memory after jumps of the frame."""
        moved = replace(
            memory,
            estimate=self.observer.shift(memory.estimate, jump),
            target=self.tracker.shift(memory.target, jump.velocity_m_s) if self.tracker else memory.target,
            limits=self.limits.shift(memory.limits, jump.velocity_m_s),
            height=self.height.shift(memory.height, jump),
        )
        sine, cosine = self.products.sine_cosine(jump.heading_rad)
        turned = replace(
            moved,
            estimate=self.observer.turn(moved.estimate, sine, cosine),
            attitude=self.model.shift(moved.attitude, sine, cosine),
            height=self.height.turn(moved.height),
            target=self.tracker.turn(moved.target, sine, cosine) if self.tracker else moved.target,
        )
        return choose(jump.heading_rad != 0, turned, moved)

    def commanded_share(self, command_rad: Real) -> Real:
        """Return the vertical share (n,) of the thrust with the attitude of commands (n, 2)."""
        vector = self.model.vector
        return self.height.share(command_rad) if vector is None else vector.of_command(command_rad)[0]

    def _direction(self, memory: QuadraticMemory, inputs: CheckedInputs) -> tuple[Real, Real | None]:
        """Return the vertical share (n,) of the thrust, and its slopes (n, 2), None with small angles."""
        angles, vector = inputs.state[:, 4:6], self.model.vector
        if vector is None:
            tilt_rad = np.where(inputs.has_state[:, None], angles, memory.command_rad)
            return self.height.share(tilt_rad), None
        share, slope = vector.of_measured(angles)
        return np.where(inputs.has_state, share, self.commanded_share(memory.command_rad)), slope

    def _learn(
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

    def _sent(self, memory: QuadraticMemory, command_rad: Real) -> Real:
        """Return what is sent for commands (n, 2) of the model."""
        return self.tilt_gain.sent(memory.tilt_gain, command_rad) if self.tilt_gain else command_rad

    def _with_thrust(self, before: LimitsMemory, aim: _Aim, by_thrust: Rows) -> LimitsMemory:
        """Return the memory of the limits, with whether the thrust limited the last command (n,)."""
        if not self.limits.brake:
            return aim.limits
        kept = np.where(aim.rests, 0, before.active & ActiveLimit.THRUST)
        thrust = np.where(aim.has_command, np.where(by_thrust, ActiveLimit.THRUST, 0), kept)
        return replace(aim.limits, active=(aim.limits.active & ~ActiveLimit.THRUST) + thrust)

    def _turn(self, attitude: AttitudeState, inputs: CheckedInputs, none_yet: Rows) -> AttitudeState:
        """Return the models after they have answered the last command, at the measured heading."""
        attitude = self.model.advance(attitude)
        sine, cosine = self.products.sine_cosine(inputs.state[:, 6])
        measured = choose(
            none_yet,
            replace(attitude, sine=sine, cosine=cosine),
            self.model.turn(attitude, sine, cosine, inputs.allows_command),
        )
        return choose(inputs.has_state, measured, attitude)

    def _observe(
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

    def _count(self, missed: NDArray[np.int64], has_state: Rows) -> NDArray[np.int64]:
        """Return the control steps (n,) since the last good state."""
        waited = np.minimum(missed + 1, np.maximum(missed, self._no_estimate))
        return np.where(has_state, 0, waited)

    def _aim(self, memory: QuadraticMemory, inputs: CheckedInputs, lift: Lift, estimate: Estimate) -> _Aim:
        """Return what the controllers aim at; the height has its next thrust."""
        missed = self._count(memory.missed, inputs.has_state)
        columns, follows = self._level_columns, inputs.allows_command & (missed < self._no_estimate)
        level, upward = inputs.target[:, :columns], inputs.target[:, columns:]
        height, limit_active = self.height.aim(
            lift.state, upward, inputs.state[:, 7:10], follows, memory.height_bounds
        )
        limits, motion, target = self.limits.aim(
            memory.limits, memory.target, estimate.position_m, level, follows
        )
        if self.tracker is not None:
            motion = choose(follows, self.tracker.update(motion, target[:, self.tracker.columns]), motion)
        weight = self.height.command_weight(height)
        aim = _Aim(target, motion, limits, height, weight, missed, has_command=follows, rests=follows & False)
        if not self.limits.brake:
            return aim
        return self._end_outage(aim, estimate, limit_active)

    def _end_outage(self, aim: _Aim, estimate: Estimate, limit_active: Rows) -> _Aim:
        """Brake by the model's velocity where an outage lasts too long, until the model is at rest.

        limit_active (n,): whether a limit of the height acts.
        """
        overdue = aim.missed == self._no_estimate
        slow = np.all(np.abs(estimate.velocity_m_step) <= self._rest_m_step, axis=1)
        brakes, rests = overdue & ~slow, overdue & slow
        stopped = np.concatenate([estimate.position_m, np.zeros_like(aim.target[:, 2:])], axis=1)
        active = np.where(brakes, ActiveLimit.BRAKING, np.where(rests, 0, aim.limits.active))
        active = (active & ~ActiveLimit.HEIGHT) + np.where(limit_active, ActiveLimit.HEIGHT, 0)
        return replace(
            aim,
            target=np.where(brakes[:, None], stopped, aim.target),
            motion=choose(overdue, unknown_motion(aim.motion.velocity_m_s), aim.motion),
            limits=replace(aim.limits, active=active),
            height=self.height.clear_target(aim.height, overdue),
            missed=np.where(rests, self.at_rest, aim.missed),
            has_command=aim.has_command | brakes,
            rests=rests,
        )

    def _command(
        self,
        memory: QuadraticMemory,
        inputs: CheckedInputs,
        attitude: AttitudeState,
        moves: Real,
        aim: _Aim,
    ) -> tuple[AttitudeState, Real, Real]:
        """Return the models with the next commands, roll and pitch (n, 2) that are sent, and the budgets."""
        moved = replace(attitude, command=self.products.move_acceleration(moves))
        command = self._sent(memory, self._angles(moved.command, aim.weight))
        held, tilt_limit = memory.command_rad, memory.limits.bounds.tilt_rad[:, None]
        if self._feedback is not None:  # the C adds none where its factor is 0: a sum with 0 has no sign -0
            fed = self._feedback != 0
            command = np.where(fed, command + self._rate_feedback(memory, inputs), command)
            without = self._sent(memory, self._angles(attitude.command, aim.weight))
            without = clamp(without, tilt_limit)
            held = np.where(fed & (memory.missed == 0)[:, None], without, held)
        command, budget = clamp(command, tilt_limit), memory.budget_rad
        if self.tilt_budget is not None:
            wanted = command
            command, left = self.tilt_budget.spend(budget, memory.command_rad, wanted)
            command, budget = clamp(command, tilt_limit), np.where(aim.has_command[:, None], left, budget)
            gain = memory.tilt_gain.gain if self.tilt_gain else None
            told = self.model.change_command(moved, wanted, command, aim.weight, gain)
            moved = choose((command != wanted).any(axis=1), told, moved)
        command = np.where(aim.has_command[:, None], command, held)
        attitude, level = choose(aim.has_command, moved, attitude), np.zeros_like(command)
        attitude = choose(aim.rests, self.model.set_command(attitude, level, aim.weight), attitude)
        return attitude, np.where(aim.rests[:, None], level, command), budget

    def _rate_feedback(self, memory: QuadraticMemory, inputs: CheckedInputs) -> Real:
        """Return what the change of the measured angles since the last step adds to commands (n, 2)."""
        change = self.products.feedback_product(self._feedback, inputs.state[:, 4:6] - memory.tilt_rad)
        known = inputs.has_state & (memory.missed == 0)
        return np.where(known[:, None], change, np.zeros_like(change))

    def _angles(self, command: Real, weight: Real | None) -> Real:
        """Return roll and pitch (n, 2) of commands (n, 2) while tilts count `weight` (n,) times."""
        return self.model.command_rad(self.height.over_weight(command, weight))

    def _minimize(
        self, memory: QuadraticMemory, attitude: AttitudeState, estimate: Estimate, aim: _Aim, tilt: Real
    ) -> tuple[Real, Rows]:
        """Return the first free moves (n, 2), right and forward, with the acceleration `tilt` (n, 2).

        And whether what the thrust leaves limits one of them (n,).
        """
        disturbance, jerk = self.observer.disturbance(estimate), np.zeros_like(tilt)
        if self.tracker is not None:
            disturbance = disturbance - aim.motion.acceleration_m_step2
            jerk = self._to_heading(attitude, aim.motion.jerk_m_step2_update)
        errors = (
            estimate.position_m - aim.target[:, 0:2],
            estimate.velocity_m_step - self.products.speed_product(aim.target[:, 2:4]),
            disturbance,
        )
        state = [
            *(self._to_heading(attitude, error) for error in errors),
            jerk,
            attitude.tilt if self._is_predicted else tilt,
            attitude.integral,
            attitude.lagged,
            attitude.command,
        ]
        limit, spare = aim.limits.command_limit, self.height.spare(aim.height)
        if self.tilt_gain is not None:
            limit = self.products.factor_product(limit, self.tilt_gain.share(memory.tilt_gain))
        limit = self.model.weighed(limit, aim.weight)
        if spare is None:
            return self.optimizer.minimize(np.stack(state, axis=2), limit), np.zeros(len(tilt), np.bool_)
        left = self.products.to_move(spare)[:, None]
        limit = np.where(left < limit, left, limit)
        moves = self.optimizer.minimize(np.stack(state, axis=2), limit)
        return moves, np.any((limit == left) & (np.abs(moves) >= limit), axis=1)

    def _to_world(self, attitude: AttitudeState, heading: Real) -> Real:
        """Return vectors (n, 2) along x and y from those along right and forward."""
        return self.products.turn(heading[:, ::-1], attitude.sine, attitude.cosine)

    def _to_heading(self, attitude: AttitudeState, world: Real) -> Real:
        """Return vectors (n, 2) along right and forward from those along x and y."""
        return self.products.turn(world[:, ::-1], attitude.sine, attitude.cosine)
