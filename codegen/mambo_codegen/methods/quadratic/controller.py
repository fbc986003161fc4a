"""Controller with a quadratic cost: estimates the state, models the attitude loops, minimises the cost."""

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.methods.quadratic.arithmetic import QuadraticArithmetic
from mambo_codegen.methods.quadratic.attitude import AttitudeModel, AttitudeState, rotate
from mambo_codegen.methods.quadratic.constants import QuadraticConstants
from mambo_codegen.methods.quadratic.height import HeightAxis, HeightBounds, HeightState
from mambo_codegen.methods.quadratic.observer import Estimate, KalmanObserver
from mambo_codegen.methods.quadratic.optimizer import QuadraticOptimizer
from mambo_codegen.methods.shared.inputs import Inputs, Rows, Status, choose, within
from mambo_codegen.methods.shared.limits import ActiveLimit, LimitsLaw, LimitsMemory, no_limits
from mambo_codegen.methods.shared.limits_constants import LIMITS
from mambo_codegen.methods.shared.math import Real, clamp
from mambo_codegen.methods.shared.tracker import TargetMotion, Tracker, unknown_motion
from mambo_codegen.numbers.representation import COMMAND, THRUST

REST_M_S: Final = 0.02
"""After an outage the model brakes to this speed along both axes; then the command is level."""


@dataclass(frozen=True)
class QuadraticMemory:
    """State of n controllers between two steps.

    tilt_rad and command_rad are (n, 2), missed (n,) counts control steps since the last good state. Without
    limits `limits` stays zeros; without a height the last two are None, and
    without limits the last.
    """

    estimate: Estimate
    attitude: AttitudeState
    target: TargetMotion
    limits: LimitsMemory
    tilt_rad: Real
    command_rad: Real
    missed: NDArray[np.int64]
    height: HeightState | None
    height_bounds: HeightBounds | None


@dataclass(frozen=True)
class _Lift:
    """What a step knows of the height of n controllers.

    lies:   (n,) whether the drone lies on the floor.
    weight: (n,) by how much more the measured tilt counts than in hover.
    """

    state: HeightState
    lies: Rows
    weight: Real


@dataclass(frozen=True)
class QuadraticStep:
    """The result of one step of n controllers.

    status:      (n,) a `Status` each.
    command_rad: (n, 2) roll and pitch commands, in rad.
    missed:      (n,) control steps since the last good state.
    saturated:   (n,) whether the last command lies at the tilt limit.
    stored:      (n, k) all numbers of nmpc_t in their order, of the quantities `QuadraticConstants.stored`.
    active:      (n,) the limits that act, as `ActiveLimit`, but TILT; None without limits.
    thrust_m_s2: (n,) commanded thrust over mass; None without a height.
    """

    status: NDArray[np.int64]
    command_rad: Real
    missed: NDArray[np.int64]
    saturated: NDArray[np.bool_]
    stored: Real
    active: NDArray[np.int64] | None = None
    thrust_m_s2: Real | None = None


class QuadraticController:
    """n controllers with a quadratic cost in NumPy that compute the bits of the generated C."""

    def __init__(self, constants: QuadraticConstants, n: int = 1) -> None:
        self.settings, self._constants = constants.settings, constants
        self._numbers, self._products = constants.numbers, QuadraticArithmetic(constants)
        self._inputs = Inputs(constants)
        self._observer = KalmanObserver(constants, self._products)
        self._model = AttitudeModel(constants, self._products)
        self.optimizer = QuadraticOptimizer(constants, self._products, self._model.command_limit)
        self._tracker = Tracker(constants.tracker, self._products) if constants.tracker else None
        self._feedback = constants.feedback_steps and np.array(
            [self._numbers.constant(steps, "feedback") for steps in constants.feedback_steps]
        )
        self._limits = LimitsLaw(constants, constants.limiting) if constants.limiting else None
        self._height = HeightAxis(constants, constants.height, self._products) if constants.height else None
        self._no_estimate = constants.observer.outage_steps + 1
        """`missed` while the model brakes after an outage, and without limits from then on."""
        self._at_rest = self._no_estimate + 1 if self._limits else self._no_estimate
        """`missed` before the first good state and when the model has come to rest."""
        self._rest_m_step = self._numbers.constant(REST_M_S * self.settings.horizon.update_period_s, "speed")
        self.scalar = self._numbers.scalar
        level = np.zeros((n, 2), self._numbers.computed)
        limits, bounds = no_limits(level), None
        if self._limits is not None:
            defaults = np.repeat(self._limits.defaults, n, axis=0)
            limits, bounds = self._limited(defaults), self._height_bounds(defaults)
        if self._height is not None:
            level = np.column_stack([level, np.full(n, self._height.hover_m_s2)])
        self.memory = self._restarted(level, limits, bounds)

    def reset(self, command_rad: ArrayLike) -> NDArray[np.int64]:
        """Forget everything; the drones hold the attitudes of `command_rad` (n, 2), clamped to the limit.

        With a height (n, 3): they hold that thrust over mass too. Returns a status (n,); a command that is
        not finite, or beyond its range, changes nothing.
        """
        given, good = self._command(command_rad)
        memory = self.memory
        self.memory = choose(good, self._restarted(given, memory.limits, memory.height_bounds), memory)
        return np.where(good, Status.OK, Status.BAD_COMMAND)

    def set_command(self, command_rad: ArrayLike) -> NDArray[np.int64]:
        """Tell the controllers that `command_rad` (n, 2) or (n, 3) was sent in place of the last command.

        Returns a status (n,) as `reset` does.
        """
        given, good = self._command(command_rad)
        memory = self.memory
        height = memory.height
        if self._height is not None and height is not None:
            height = self._height.set_thrust(height, given[:, 2])
        change = given[:, 0:2] - memory.command_rad
        attitude = self._model.change_command(memory.attitude, change, self._weight(height))
        new = replace(memory, command_rad=given[:, 0:2], attitude=attitude, height=height)
        self.memory = choose(good, new, memory)
        return np.where(good, Status.OK, Status.BAD_COMMAND)

    def set_thrust(self, thrust_m_s2: ArrayLike) -> NDArray[np.int64]:
        """Tell the controllers that the drones got thrusts over mass (n,) in place of those commanded.

        Returns a status (n,); a thrust that is not finite, or out of range, changes nothing.
        Raises ValueError without a height in the settings.
        """
        memory = self.memory
        if self._height is None or memory.height is None:
            raise ValueError("the settings have no height")
        given = self._inputs.numbers(np.asarray(thrust_m_s2)[:, None], THRUST)
        good = within(given, self._inputs.limits.thrust_most)
        height = self._height.set_thrust(memory.height, self._height.limited(given[:, 0]))
        self.memory = choose(good, replace(memory, height=height), memory)
        return np.where(good, Status.OK, Status.BAD_THRUST)

    def set_limits(self, limits: ArrayLike) -> NDArray[np.int64]:
        """Replace the limits by `limits` (n, k), in the order of nmpc_limits_t; k is 7, or 11 with a height.

        Returns a status (n,); bad limits change nothing. Raises ValueError without limits in the settings.
        """
        if self._limits is None:
            raise ValueError("the settings have no limits")
        given = self._limits.quantize(limits)
        good = self._limits.check(given)
        if self._height is not None:
            good = good & self._height.check_limits(given[:, len(LIMITS) :])
        memory, new = self.memory, self._limited(given)
        kept = memory.limits
        limited = replace(
            memory,
            limits=replace(new, velocity_m_s=kept.velocity_m_s, active=kept.active),
            command_rad=clamp(memory.command_rad, new.bounds.tilt_rad[:, None]),
            height_bounds=self._height_bounds(given),
        )
        self.memory = choose(good, limited, memory)
        return np.where(good, Status.OK, Status.BAD_LIMITS)

    def step(
        self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike | None = None
    ) -> QuadraticStep:
        """Compute the next commands; the inputs are those of `ReferenceController.step`."""
        states, targets, thrusts = self._inputs.quantize(state, target, thrust_acceleration_m_s2)
        has_state, has_target, has_thrust = self._inputs.check(states, targets, thrusts)
        zero = self._numbers.computed(0)
        states = np.where(has_state[:, None], states, zero)
        targets = np.where(has_target[:, None], targets, zero)
        self._advance(states, has_state, targets, has_target & has_thrust)
        memory, thrust = self.memory, None
        if memory.height is not None:
            thrust = self._numbers.to_si(memory.height.thrust_m_s2, *THRUST)
        return QuadraticStep(
            status=self._inputs.status(has_state, has_target, has_thrust),
            command_rad=self._numbers.to_si(memory.command_rad, *COMMAND),
            missed=memory.missed,
            saturated=self.saturated,
            stored=self._numbers.to_si(self.stored, *self._constants.stored),
            active=memory.limits.active if self._limits else None,
            thrust_m_s2=thrust,
        )

    def _limited(self, limits: Real) -> LimitsMemory:
        """Return the memory of limits (n, 7), of the quantities LIMITS."""
        assert self._limits is not None
        bounds = self._limits.bounds(limits)
        return replace(
            no_limits(bounds.centre_m),
            bounds=bounds,
            command_limit=self._model.command_limit_at(bounds.tilt_rad, self._inputs.limits.tilt),
        )

    def _height_bounds(self, limits: Real) -> HeightBounds | None:
        """Return what follows from limits (n, 11) for the height; None without it."""
        return None if self._height is None else self._height.bounds(limits[:, len(LIMITS) :])

    def _tilt_limit(self) -> Any:
        """Return the tilt limit, or one for each controller (n, 1)."""
        return (
            self._inputs.limits.tilt if self._limits is None else self.memory.limits.bounds.tilt_rad[:, None]
        )

    def _command(self, command: ArrayLike) -> tuple[Real, Rows]:
        """Return commands (n, 2) or (n, 3) within their limits, and whether each may be set."""
        given, good = self._inputs.command(command)
        angles = clamp(given[:, 0:2], self._tilt_limit())
        if self._height is None:
            return angles, good
        return np.column_stack([angles, self._height.limited(given[:, 2])]), good

    def _restarted(
        self, command: Real, limits: LimitsMemory, height_bounds: HeightBounds | None
    ) -> QuadraticMemory:
        """Return the memory of controllers that hold commands (n, 2), with a height (n, 3)."""
        command_rad = command[:, 0:2]
        n, zeros = len(command_rad), np.zeros_like(command_rad)
        height = None if self._height is None else self._height.steady(command[:, 2], command_rad)
        return QuadraticMemory(
            estimate=Estimate(zeros, zeros, zeros),
            attitude=self._model.steady(command_rad, self._weight(height)),
            target=unknown_motion(zeros),
            limits=replace(limits, active=np.zeros_like(limits.active)),
            tilt_rad=zeros,
            command_rad=command_rad,
            missed=np.full(n, self._at_rest),
            height=height,
            height_bounds=height_bounds,
        )

    def _weight(self, height: HeightState | None) -> Real | None:
        """Return by how much more tilts (n,) count than in hover; None without a height."""
        if self._height is None or height is None:
            return None
        return self._height.weight(self._height.lift(height, height.command))

    def _lift(self, state: Real, has_state: Rows, none_yet: Rows) -> _Lift | None:
        """Return the height after the measurement; None without a height."""
        memory = self.memory
        if self._height is None or memory.height is None:
            return None
        tilt_rad = np.where(has_state[:, None], state[:, 4:6], memory.command_rad)
        height, lies = self._height.measure(
            self._height.advance(memory.height), state[:, 7:10], tilt_rad, has_state, none_yet
        )
        return _Lift(height, lies, self._height.weight(self._height.lift(height, height.thrust)))

    def _aim_height(
        self, lift: _Lift | None, target: Real, state: Real, commands: Rows
    ) -> tuple[HeightState | None, Rows]:
        """Return the height with the next thrust, None without a height, and where a limit acts (n,)."""
        if self._height is None or lift is None:
            return None, commands & False
        upward = target[:, len(self._constants.level_target) :]
        return self._height.aim(lift.state, upward, state[:, 7:10], commands, self.memory.height_bounds)

    def _forget_height_target(self, height: HeightState | None, overdue: Rows) -> HeightState | None:
        """Return the height without the motion of its target where an outage lasts too long (n,)."""
        if self._height is None or height is None:
            return None
        return self._height.clear_target(height, overdue)

    def _predict_height(self, height: HeightState | None, lift: _Lift | None) -> HeightState | None:
        """Return the height at the next control step."""
        if self._height is None or height is None or lift is None:
            return None
        return self._height.predict(height, lift.lies)

    def _advance(
        self, state: Real, has_state: NDArray[np.bool_], target: Real, allows_command: NDArray[np.bool_]
    ) -> None:
        memory, model = self.memory, self._model
        none_yet = memory.missed >= self._no_estimate
        attitude = model.advance(memory.attitude)
        sine, cosine = self._products.sine_cosine(state[:, 6])
        measured = choose(
            none_yet,
            replace(attitude, sine=sine, cosine=cosine),
            model.turn(attitude, sine, cosine, allows_command),
        )
        attitude = choose(has_state, measured, attitude)
        lift = self._lift(state, has_state, none_yet)
        feedback = np.zeros_like(memory.command_rad)
        if self._feedback is not None:
            change = self._products.feedback_product(self._feedback, state[:, 4:6] - memory.tilt_rad)
            feedback = np.where((has_state & (memory.missed == 0))[:, None], change, feedback)
        tilt = np.where(
            has_state[:, None], model.measure(state[:, 4:6], lift.weight if lift else None), attitude.tilt
        )
        world = self._to_world(attitude, tilt)
        corrected = choose(
            none_yet,
            self._observer.start(memory.estimate, state),
            self._observer.correct(memory.estimate, state, world),
        )
        estimate = choose(has_state, corrected, memory.estimate)
        waited = np.minimum(memory.missed + 1, np.maximum(memory.missed, self._no_estimate))
        missed = np.where(has_state, 0, waited)
        commands = allows_command & (missed < self._no_estimate)
        motion, limits = memory.target, memory.limits
        height, acts = self._aim_height(lift, target, state, commands)
        target = target[:, : len(self._constants.level_target)]
        if self._limits is not None:
            limited, within = self._limits.limit(limits, estimate.position_m, target)
            motion = choose(commands, self._limits.forget_braking(motion, limits, limited, target), motion)
            limits = choose(commands, limited, limits)
            target = np.where(commands[:, None], within, target)
        if self._tracker is not None:
            motion = choose(commands, self._tracker.update(motion, target[:, self._tracker.columns]), motion)
        overdue = missed == self._no_estimate
        slow = np.all(np.abs(estimate.velocity_m_step) <= self._rest_m_step, axis=1)
        brakes, rests = (overdue & ~slow, overdue & slow) if self._limits else (overdue & False,) * 2
        if self._limits is not None:
            stopped = np.concatenate([estimate.position_m, np.zeros_like(target[:, 2:])], axis=1)
            target = np.where(brakes[:, None], stopped, target)
            motion = choose(overdue, unknown_motion(motion.velocity_m_s), motion)
            height = self._forget_height_target(height, overdue)
            limits = replace(limits, active=_active(limits, brakes, rests, acts))
        commands = commands | brakes
        weight = self._weight(height)
        limit = model.weighed(limits.command_limit if self._limits else model.command_limit, weight)
        moves = self._minimize(attitude, estimate, motion, target, tilt, limit=limit)
        moved = replace(attitude, command=self._products.move_acceleration(moves))
        command, held = self._angles(moved.command, weight), memory.command_rad
        if self._feedback is not None:  # the C adds none where its factor is 0: a sum with 0 has no sign -0
            command = np.where(self._feedback != 0, command + feedback, command)
            without = clamp(self._angles(attitude.command, weight), self._tilt_limit())
            held = np.where((self._feedback != 0) & (memory.missed == 0)[:, None], without, held)
        command = np.where(commands[:, None], clamp(command, self._tilt_limit()), held)
        attitude, rest_rad = choose(commands, moved, attitude), np.zeros_like(command)
        self.memory = QuadraticMemory(
            estimate=self._observer.predict(estimate, world),
            attitude=choose(rests, model.set_command(attitude, rest_rad, weight), attitude),
            target=motion,
            limits=limits,
            tilt_rad=np.where(has_state[:, None], state[:, 4:6], memory.tilt_rad),
            command_rad=np.where(rests[:, None], rest_rad, command),
            missed=np.where(rests, self._at_rest, missed),
            height=self._predict_height(height, lift),
            height_bounds=memory.height_bounds,
        )

    def _angles(self, command: Real, weight: Real | None) -> Real:
        """Return roll and pitch (n, 2) of commands (n, 2) while tilts count `weight` (n,) times."""
        if self._height is not None and weight is not None:
            command = self._height.over_weight(command, weight)
        return self._model.command_rad(command)

    def _minimize(
        self,
        attitude: AttitudeState,
        estimate: Estimate,
        motion: TargetMotion,
        target: Real,
        tilt: Real,
        *,
        limit: Real,
    ) -> Real:
        """Return the first free moves (n, 2), right and forward, within `limit`, (2,) or (n, 2)."""
        disturbance, jerk = self._observer.disturbance(estimate), np.zeros_like(tilt)
        if self._tracker is not None:
            disturbance = disturbance - motion.acceleration_m_step2
            jerk = self._to_heading(attitude, motion.jerk_m_step2_update)
        errors = (
            estimate.position_m - target[:, 0:2],
            estimate.velocity_m_step - self._products.speed_product(target[:, 2:4]),
            disturbance,
        )
        if self.settings.model.attitude == "predicted":
            tilt = attitude.tilt
        state = [
            *(self._to_heading(attitude, error) for error in errors),
            jerk,
            tilt,
            attitude.integral,
            attitude.lagged,
            attitude.command,
        ]
        return self.optimizer.minimize(np.stack(state, axis=2), limit)

    def _to_world(self, attitude: AttitudeState, heading: Real) -> Real:
        """Return vectors (n, 2) along x and y from those along right and forward."""
        return rotate(self._products, heading[:, ::-1], attitude.sine, attitude.cosine)

    def _to_heading(self, attitude: AttitudeState, world: Real) -> Real:
        """Return vectors (n, 2) along right and forward from those along x and y."""
        return rotate(self._products, world[:, ::-1], attitude.sine, attitude.cosine)

    @property
    def saturated(self) -> NDArray[np.bool_]:
        """Whether roll or pitch (n,) of the last command is that of the largest move, or beyond."""
        limit = self.memory.limits.command_limit if self._limits else self._model.command_limit
        one, other = (
            self._model.command_rad(self._products.move_acceleration(np.atleast_2d(moves)))
            for moves in (limit, -limit)
        )
        command = self.memory.command_rad
        is_largest = (command >= np.maximum(one, other)) | (command <= np.minimum(one, other))
        return np.asarray(np.any(is_largest, axis=1))

    @property
    def outcome(self) -> dict[str, NDArray[Any]]:
        """What the last call left, in the numbers of the C."""
        memory = self.memory
        return {
            "missed": memory.missed,
            "saturated": self.saturated,
            "command_rad": memory.command_rad,
            **({} if memory.height is None else {"thrust_m_s2": memory.height.thrust_m_s2}),
            "stored": self.stored,
            **({"active": memory.limits.active} if self._limits else {}),
        }

    @property
    def stored_limits(self) -> Real:
        """All numbers of nmpc_bounds_t (n, k), in their order; k is 0 without limits."""
        if self._limits is None:
            return np.zeros((len(self.memory.command_rad), 0), self._numbers.computed)
        columns = self._limits.stored(self.memory.limits, has_command=True)
        bounds = self.memory.height_bounds
        if bounds is not None:
            columns.append(np.column_stack([bounds.floor_m, bounds.ceiling_m, bounds.up_m, bounds.down_m]))
        return np.concatenate(columns, axis=1)

    @property
    def stored(self) -> Real:
        """All numbers of nmpc_t (n, k), in their order and in the numbers of the C."""
        memory = self.memory
        estimate, attitude, motion = memory.estimate, memory.attitude, memory.target
        columns = [estimate.position_m, estimate.velocity_m_step, estimate.disturbance_m_step2]
        columns += [attitude.tilt, attitude.integral, attitude.lagged, attitude.command]
        columns += [attitude.sine[:, None], attitude.cosine[:, None]]
        if self._tracker is not None:
            columns += [] if self._tracker.is_given else [motion.velocity_m_s]
            columns += [motion.acceleration_m_step2, motion.jerk_m_step2_update]
        if self._height is not None and memory.height is not None:
            columns += self._height.stored(memory.height)
        columns += [self.stored_limits]
        if self._feedback is not None:
            columns += [memory.tilt_rad]
        return np.concatenate([*columns, memory.command_rad], axis=1)


def _active(limits: LimitsMemory, brakes: Rows, rests: Rows, acts: Rows) -> NDArray[np.int64]:
    """Return the limits that act (n,), where an outage brakes or rests, and where one of the height acts."""
    active = np.where(brakes, ActiveLimit.BRAKING, np.where(rests, 0, limits.active))
    return (active & ~ActiveLimit.HEIGHT) + np.where(acts, ActiveLimit.HEIGHT, 0)
