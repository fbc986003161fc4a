"""Height: the third axis, whose command is the thrust; and what it means for the others."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.quadratic.arithmetic import QuadraticArithmetic
from mambo_codegen.methods.quadratic.attitude_constants import MOST_WEIGHT
from mambo_codegen.methods.quadratic.axis import AxisMotion, gains_of, row_product
from mambo_codegen.methods.quadratic.constants import QuadraticConstants
from mambo_codegen.methods.quadratic.guard import VariationBudget
from mambo_codegen.methods.quadratic.height_constants import (
    COSINE_TERMS,
    FLOOR_MARGIN_M,
    LEAST_COSINE,
    LEAST_WEIGHT,
    HeightConstants,
)
from mambo_codegen.methods.quadratic.target_observer import (
    ObservedMotion,
    climb_observer,
    unknown_target,
)
from mambo_codegen.methods.quadratic.thrust_vector import inverse, inverse_line
from mambo_codegen.methods.shared.inputs import FrameShift, Rows, choose
from mambo_codegen.methods.shared.math import Real, clamp, confine
from mambo_codegen.settings.fields import SMALLEST_LIMIT


@dataclass(frozen=True)
class HeightState:
    """The height of n controllers, (n,) each; up is positive. Without a height zeros.

    height_m, velocity_m_step, disturbance_m_step2, gain: estimates; of the last two the settings choose one.
    thrust, lagged, command: sa, sc, su of the model of the thrust in nmpc.c, m/step^2.
    target:      the motion of the target, (n, 1).
    share:       of the thrust that acts vertically: the cosine of the tilt.
    thrust_m_s2: the last command, or what the motors were given in place of it.
    commanded_m_s2, budget_m_s2: the last command, and how much it may vary; zeros without a guard.
    """

    height_m: Real
    velocity_m_step: Real
    disturbance_m_step2: Real
    gain: Real
    thrust: Real
    lagged: Real
    command: Real
    target: ObservedMotion
    share: Real
    thrust_m_s2: Real
    commanded_m_s2: Real
    budget_m_s2: Real


@dataclass(frozen=True)
class HeightBounds:
    """Limits of the height of n controllers, (n,) each, in m.

    floor_m, ceiling_m: the walls of the fence.
    up_m, down_m:       the distances at which the law approaches at the largest climb and descent.
    """

    floor_m: Real
    ceiling_m: Real
    up_m: Real
    down_m: Real


@dataclass(frozen=True)
class Lift:
    """What a step knows of the height of n controllers.

    lies_on_floor: (n,) whether the drone lies on the floor.
    weight:    (n,) by how much more the measured tilt counts than in hover; None if no more.
    """

    state: HeightState
    lies_on_floor: Rows
    weight: Real | None


def unknown_height(like: Real) -> HeightState:
    """Return zeros for the height of controllers, with the shape (n,) and the type of `like`."""
    no, still = np.zeros_like(like), unknown_target(like[:, None])
    return HeightState(no, no, no, no, no, no, no, still, no, no, no, no)


class HeightAxis:
    """The constants of the height, in the scalar type of the controller."""

    def __init__(
        self, constants: QuadraticConstants, found: HeightConstants, products: QuadraticArithmetic
    ) -> None:
        constant, settings = products.numbers.constant, constants.settings
        self._products, self._found, self._axis = products, found, AxisMotion(constants, products)
        last = "gain" if found.learns_gain else "disturbance"
        self._gains = gains_of(constant, found.gain, ("position", "velocity", last))
        self._thrust_row = [constant(value, "attitude") for value in found.thrust_row]
        self._lagged_row = [constant(value, "attitude") for value in found.lagged_row]
        self._rows = [
            [constant(value, f"row_{state}") for value, state in zip(row, found.states, strict=True)]
            for row in found.rows
        ]
        self._ratio = constant(found.ratio, "ratio")
        self.deciding: Rows = np.zeros((0, 4), np.bool_)
        """Of the last thrusts (n, 4): whether no limit, floor or guard decided, whether the second row did;
        the same where no state was 0."""
        self._one, self._cosine_one = constant(1.0, "factor"), constant(1.0, "sine")
        self._half, self._fourth = (constant(term, "sine") for term in COSINE_TERMS)
        self._least_cosine = constant(LEAST_COSINE, "sine")
        self._gravity = constant(found.gravity_m_step2, "acceleration")
        self._per_gravity = constant(found.per_gravity, "per_gravity")
        self._least = constant((LEAST_WEIGHT - 1) * found.gravity_m_step2, "acceleration")
        self._most = constant((MOST_WEIGHT - 1) * found.gravity_m_step2, "acceleration")
        self._thrusts = [constant(value, "acceleration") for value in found.thrust_m_step2]
        *self._thrusts_m_s2, self._hover_m_s2 = (constant(value, "thrust") for value in found.command_m_s2)
        self._learnt_limit = constant(found.learnt_limit, "factor" if found.learns_gain else "acceleration")
        self._reach = constant(found.reach_steps, "reach")
        self._margin = constant(FLOOR_MARGIN_M, "position")
        self._target_observer = climb_observer(constants, products, found)
        self._budget: VariationBudget | None = None
        if guard := constants.guard:
            self._budget = VariationBudget(
                products, guard.thrust_budget_m_s2, guard.thrust_growth_m_s2, "thrust"
            )
        self._height_limit = constant(settings.ranges.position_m, "position")
        self._step2 = constant(found.step2_s2, "step2")
        self._steps2 = constant(found.steps2_per_s2, "thrust_per_step2")
        self._lines = {
            name: inverse_line(line, products)
            for name, line in (("thrust", found.thrust_inverse), ("weight", found.weight_inverse))
        }
        self._spare: tuple[Any, list[Any], Any, Any] | None = None
        if vector := constants.thrust_vector:
            chords = [[constant(value, "factor") for value in chord] for chord in vector.chords]
            least = constant(vector.least_spare_m_step2, "acceleration")
            known = constant(vector.known_spare, "factor")
            self._spare = constant(vector.spare_m_step2, "acceleration"), chords, least, known
        self._least_speed = constant(SMALLEST_LIMIT, "velocity")
        self._most_speeds = np.array([constant(value, "velocity") for value in found.most_m_s])

    def hover(self, n: int) -> Real:
        """Return level commands (n, 3) with the thrust of hover."""
        level = np.zeros((n, 2), self._products.numbers.computed)
        return np.column_stack([level, np.full(n, self._hover_m_s2)])

    def bounds(self, limits: Real) -> HeightBounds:
        """Derive what the steps need from good limits (n, 4), of HEIGHT_LIMITS."""
        products = self._products
        distance = products.reach_product(self._reach, products.speed_product(limits[:, 2:4]))
        return HeightBounds(limits[:, 0], limits[:, 1], distance[:, 0], distance[:, 1])

    def check_limits(self, limits: Real) -> Rows:
        """Return whether limits (n, 4) may be set (n,); not if one is NaN."""
        floor, ceiling, speeds = limits[:, 0], limits[:, 1], limits[:, 2:4]
        good: Rows = (
            (floor >= -self._height_limit)
            & (floor < ceiling)
            & (ceiling <= self._height_limit)
            & np.all((speeds >= self._least_speed) & (speeds <= self._most_speeds), axis=1)
        )
        return good

    def steady(self, thrust_m_s2: Real, share: Real) -> HeightState:
        """Return the height of drones with a steady thrust (n, 1), of which `share` (n,) acts vertically."""
        unknown = unknown_height(thrust_m_s2[:, 0])
        command = self._vertical(share, thrust_m_s2[:, 0])
        if self._budget is not None:
            full = np.full_like(command, self._budget.full)
            unknown = replace(unknown, commanded_m_s2=thrust_m_s2[:, 0], budget_m_s2=full)
        return replace(
            unknown,
            gain=np.full_like(command, self._one),
            thrust=command,
            lagged=command,
            command=command,
            share=share,
            thrust_m_s2=thrust_m_s2[:, 0],
        )

    def limited(self, thrust_m_s2: Real) -> Real:
        """Return thrusts (n, 1) within their limits."""
        return confine(thrust_m_s2, *self._thrusts_m_s2)

    def set_thrust(self, state: HeightState, thrust_m_s2: Real) -> HeightState:
        """Change the last thrusts to `thrust_m_s2` (n, 1), within the limits."""
        thrust = thrust_m_s2[:, 0]
        return replace(state, command=self._vertical(state.share, thrust), thrust_m_s2=thrust)

    def set_command(self, state: HeightState, thrust_m_s2: Real) -> HeightState:
        """Change the last commands to `thrust_m_s2` (n, 1), within the limits."""
        changed = self.set_thrust(state, thrust_m_s2)
        return changed if self._budget is None else replace(changed, commanded_m_s2=thrust_m_s2[:, 0])

    def observe(
        self, state: HeightState, measured: Real, share: Real, has_state: Rows, none_yet: Rows
    ) -> Lift:
        """Let the model answer the last command, and correct the estimates; arguments as of `measure`."""
        state, lies_on_floor = self.measure(self.advance(state), measured, share, has_state, none_yet)
        return Lift(state, lies_on_floor, self.weight(self.lift(state, state.thrust)))

    def command_weight(self, state: HeightState) -> Real:
        """Return by how much more tilts (n,) count with the last command than in hover."""
        return self.weight(self.lift(state, state.command))

    def advance(self, state: HeightState) -> HeightState:
        """Let the model of the thrust answer the last command over one control step."""
        row, total = self._thrust_row, self._products.attitude_sum
        thrust = ((row[0] * state.thrust) + (row[1] * state.lagged)) + (row[2] * state.command)
        lagged = (self._lagged_row[0] * state.lagged) + (self._lagged_row[1] * state.command)
        return replace(state, thrust=total(thrust), lagged=total(lagged))

    def measure(
        self, state: HeightState, measured: Real, share: Real, has_state: Rows, none_yet: Rows
    ) -> tuple[HeightState, Rows]:
        """Correct the estimates by measured height, climb and contact with the floor (n, 3).

        share (n,) of the thrust acts vertically. Returns also which drones (n,) lie on the floor.
        """
        lies_on_floor = has_state & (measured[:, 2] != 0) & (self._acceleration(state) <= 0)
        step = self._products.speed_product(measured[:, 1])
        first = has_state & none_yet
        started = replace(state, height_m=measured[:, 0], velocity_m_step=step)
        lying = replace(started, velocity_m_step=np.zeros_like(step))
        found = choose(none_yet, started, self._correct(state, measured, step))
        corrected = choose(has_state, choose(lies_on_floor, lying, found), state)
        delivered = self._vertical(share, state.thrust_m_s2)
        steady = replace(corrected, thrust=delivered, lagged=delivered, command=delivered)
        return replace(choose(first, steady, corrected), share=share), lies_on_floor

    def aim(
        self, state: HeightState, target: Real, measured: Real, follows: Rows, bounds: HeightBounds
    ) -> tuple[HeightState, Rows]:
        """Set the next thrust for targets (n, 2 or more), or for rest at the own height.

        measured (n, 3): as in `measure`, zeros without a good state. follows (n,): whether there is a target.
        Returns also whether speed or fence changed what was aimed at (n,).
        """
        products, motion = self._products, state.target
        goal = np.where(follows, target[:, 0], state.height_m)
        never = np.zeros(len(target), np.bool_)
        found, aim = self._target_observer.follow(motion, target, target[:, :2], never)
        motion = choose(follows, found, motion)
        climb = np.where(follows, products.speed_product(aim[:, 1]), np.zeros_like(goal))
        disturbance, acceleration = state.disturbance_m_step2, motion.acceleration_m_step2[:, 0]
        disturbance = np.where(follows, disturbance - acceleration, disturbance)
        jerk = np.where(follows, motion.jerk_m_step2_update[:, 0], np.zeros_like(goal))
        error = state.height_m - goal
        lead = products.reach_product(self._reach, climb)
        up = confine(bounds.ceiling_m - state.height_m, -bounds.down_m, bounds.up_m)
        down = confine(state.height_m - bounds.floor_m, -bounds.up_m, bounds.down_m)
        limited = confine(error, lead - up, lead + down)
        share = state.share
        if self._found.learns_gain:
            share = products.factor_product(share, state.gain)
        least, most = (products.factor_product(thrust, share) - self._gravity for thrust in self._thrusts)
        values = [
            *(limited, state.velocity_m_step - climb, disturbance, jerk),
            *(self.lift(state, thrust) for thrust in (state.thrust, state.lagged, state.command)),
        ]
        command = self._minimize(values, least, most)
        rests = (measured[:, 2] != 0) & (goal - measured[:, 0] <= self._margin)
        command = np.where(rests, least, command)
        self.deciding = self.deciding & ~rests[:, None]
        thrust = products.factor_product(self._gravity + command, self._inverse("thrust", share))
        thrust = self.limited(products.thrust_product(self._steps2, thrust))
        if self._budget is not None:
            thrust, budget = self._budget.spend(state.budget_m_s2, state.commanded_m_s2, thrust)
            self.deciding = self.deciding & self._budget.is_enough[:, None]
            thrust = self.limited(thrust)
            state = replace(state, commanded_m_s2=thrust, budget_m_s2=budget)
        command = self._vertical(state.share, thrust)
        return replace(state, command=command, target=motion, thrust_m_s2=thrust), limited != error

    def predict(self, state: HeightState, lies_on_floor: Rows) -> HeightState:
        """Predict the estimates at the next control step; a drone that lies on the floor stays there."""
        acceleration = np.where(lies_on_floor, 0, self._acceleration(state))
        height_m, velocity = self._axis.predict((state.height_m, state.velocity_m_step), acceleration)
        return replace(state, height_m=height_m, velocity_m_step=velocity)

    def shift(self, state: HeightState, jump: FrameShift) -> HeightState:
        """Move the estimate with the frame."""
        change = self._products.speed_product(jump.velocity_m_s[:, 2])
        motion = state.height_m, state.velocity_m_step
        height_m, velocity = self._axis.shift(motion, jump.position_m[:, 2], change)
        moved = replace(state, height_m=height_m, velocity_m_step=velocity)
        return replace(moved, target=self._target_observer.shift(state.target, jump.velocity_m_s[:, 2:]))

    def turn(self, state: HeightState) -> HeightState:
        """Return the heights after turns of the frame, of which the target's next velocity is the first."""
        return replace(state, target=self._target_observer.begin_again(state.target))

    def clear_target(self, state: HeightState, cleared: Rows) -> HeightState:
        """Forget the targets of some controllers (n,)."""
        unknown = unknown_target(state.target.velocity_m_s)
        return replace(state, target=choose(cleared, unknown, state.target))

    def weight(self, acceleration: Real) -> Real:
        """Return (g + acceleration)/g (n,), by which the tilt of a climbing drone counts, within limits."""
        limited = confine(acceleration, self._least, self._most)
        weight: Real = self._one + self._products.gravity_product(self._per_gravity, limited)
        return weight

    def over_weight(self, acceleration: Real, weight: Real | None) -> Real:
        """Return accelerations (n, 2) over weights (n,), never too small by rounding."""
        return self._products.factor_product(acceleration, self._inverse("weight", weight)[:, None])

    def _inverse(self, name: str, value: Any) -> Real:
        """Return 1/value from products, as `Reciprocal` has it."""
        return inverse(self._products, self._lines[name], value)

    def share(self, tilt_rad: Real) -> Real:
        """Return cos roll cos pitch (n,) of angles (n, 2), at least LEAST_COSINE."""
        product = self._products.sine_product
        square = self._products.angle_square(tilt_rad)
        cosine = self._cosine_one - product(square, self._half - product(square, self._fourth))
        both = product(cosine[:, 0], cosine[:, 1])
        limited = np.where(both < self._least_cosine, self._least_cosine, both)
        return self._products.to_factor(limited)

    def spare(self, state: HeightState) -> Real | None:
        """Return the horizontal acceleration (n,) that the thrust leaves; None if unknown."""
        if self._spare is None:
            return None
        product, (largest, chords, least, known) = self._products.factor_product, self._spare
        vertical = self.lift(state, state.command) + self._gravity
        if self._found.learns_gain:
            largest = product(largest, state.gain)
        lines = [product(largest, rise) - product(vertical, fall) for rise, fall in chords]
        found = lines[0]
        for line in lines[1:]:
            found = np.where(line < found, line, found)
        always = np.where(state.target.memory[:, 0] > 0, found, product(vertical, known))
        found = np.where(found < always, always, found)
        limited: Real = np.where(found < least, least, found)
        return limited

    def _vertical(self, share: Real, thrust_m_s2: Real) -> Real:
        """Return the share of a thrust over mass (n,) that acts vertically, m/step^2."""
        return self._products.factor_product(self._products.step2_product(self._step2, thrust_m_s2), share)

    def lift(self, state: HeightState, thrust: Real) -> Real:
        """Return the vertical acceleration (n,) of a vertical thrust of the model, less gravity."""
        if self._found.learns_gain:
            thrust = self._products.factor_product(thrust, state.gain)
        lift: Real = thrust - self._gravity
        return lift

    def _acceleration(self, state: HeightState) -> Real:
        """Return the vertical acceleration (n,), with that of the disturbance."""
        lift = self.lift(state, state.thrust)
        return lift + state.disturbance_m_step2 if self._found.learns_acceleration else lift

    def _correct(self, state: HeightState, measured: Real, step: Real) -> HeightState:
        products, gains = self._products, self._gains
        motion = state.height_m, state.velocity_m_step
        by = self._axis.innovate(motion, (measured[:, 0], step), self._acceleration(state))
        height_m, velocity = self._axis.correct(motion, gains, by)
        corrected = replace(state, height_m=height_m, velocity_m_step=velocity)
        on_ground = measured[:, 2] != 0
        if self._found.learns_gain:
            change = products.gain_correction(gains[2][0], by[0], gains[2][1], by[1])
            learnt = state.gain + np.where(on_ground & (change > 0), 0, change)
            least, most = self._one - self._learnt_limit, self._one + self._learnt_limit
            return replace(corrected, gain=confine(learnt, least, most))
        if self._found.learns_acceleration:
            change = products.disturbance_correction(gains[2][0], by[0], gains[2][1], by[1])
            change = np.where(on_ground & (change > 0), 0, change)
            learnt = clamp(state.disturbance_m_step2 + change, self._learnt_limit)
            return replace(corrected, disturbance_m_step2=learnt)
        return corrected

    def _minimize(self, state: list[Real], least: Real, most: Real) -> Real:
        """Return the first free move (n,) between limits that are not symmetric."""
        products = self._products
        least, most = products.to_move(least), products.to_move(most)
        moves = [row_product(products, row, state) for row in self._rows]
        best, beyond = moves[0], np.zeros_like(moves[0])
        if len(moves) > 1:
            beyond = confine(moves[1], least, most) - moves[1]
            best = best - products.ratio_product(self._ratio, beyond)
        move = confine(best, least, most)
        decided, whole = move == best, np.all(np.stack(state) != 0, axis=0)
        used = np.stack([decided, decided & (beyond != 0)], axis=1)
        self.deciding = np.concatenate([used, used & whole[:, None]], axis=1)
        return products.move_acceleration(move)

    def stored(self, state: HeightState) -> list[NDArray[Any]]:
        """Return the columns (n, 1) of nmpc_height_t, in their order."""
        columns = [state.height_m, state.velocity_m_step]
        columns += [state.gain] if self._found.learns_gain else []
        columns += [state.disturbance_m_step2] if self._found.learns_acceleration else []
        columns += [state.thrust, state.lagged, state.command, state.share, state.thrust_m_s2]
        columns += [] if self._budget is None else [state.commanded_m_s2, state.budget_m_s2]
        stored = [column[:, None] for column in columns]
        return [*stored, *self._target_observer.stored(state.target)]

    def estimate(self, state: HeightState) -> list[NDArray[Any]]:
        """Return the columns (n, 1) of nmpc_estimate_t: height, climb, and what is learnt of the thrust."""
        products = self._products
        columns = [state.height_m, products.per_step_product(state.velocity_m_step)]
        columns += [state.gain] if self._found.learns_gain else []
        if self._found.learns_acceleration:
            columns.append(products.per_step2_product(state.disturbance_m_step2))
        return [column[:, None] for column in columns]
