"""Target observer: velocity, acceleration, jerk and snap of a target, from its set-points, noisy or not."""

from dataclasses import dataclass, fields, replace
from typing import Any, Final

import numpy as np

from mambo_codegen.methods.quadratic.arithmetic import QuadraticArithmetic
from mambo_codegen.methods.quadratic.constants import QuadraticConstants
from mambo_codegen.methods.quadratic.height_constants import HeightConstants
from mambo_codegen.methods.quadratic.target_observer_constants import (
    FALL,
    MotionLimits,
    TargetObserverConstants,
)
from mambo_codegen.methods.shared.inputs import Rows, choose
from mambo_codegen.methods.shared.math import Real, clamp, confine

_HAS_TURNED: Final = 2
"""`missed` where the next velocity is taken as it is."""


@dataclass(frozen=True)
class ObservedMotion:
    """What n controllers know of their targets' motion along k axes, (n, k) each but the last.

    acceleration_m_step2, jerk_m_step2_update: A_T and J_T, which the law reads.
    velocity_m_s, acceleration, jerk, snap: of the fit, in m/s per step^i.
    innovation: that of the last set-point; 0 if it was rejected.
    noise:      mean change of that from set-point to set-point.
    memory:     velocities that the fit counts; 0 with known accelerations.
    missed:     1 if the last set-point was rejected, 2 after a turn of the frame, else 0.
    desired_m_s, desired_acceleration, desired_jerk: while limits act, the velocity within them, its change
                and the change of that, in m/s per step^i; of no use for a height.
    is_known:   (n,) whether there was a set-point.
    """

    acceleration_m_step2: Real
    jerk_m_step2_update: Real
    velocity_m_s: Real
    acceleration: Real
    jerk: Real
    snap: Real
    innovation: Real
    noise: Real
    memory: Real
    missed: Real
    desired_m_s: Real
    desired_acceleration: Real
    desired_jerk: Real
    is_known: Rows


def unknown_target(like: Real) -> ObservedMotion:
    """Return the motion before the first step, with the shape (n, axes) and the type of `like`."""
    zeros, known = np.zeros_like(like), np.zeros(len(like), np.bool_)
    values = {field.name: zeros for field in fields(ObservedMotion) if field.name != "is_known"}
    return ObservedMotion(**values, is_known=known)


class TargetObserver:
    """The constants of the observer along x and y, or of the height, in the scalar type of the controller.

    A target has positions, velocities, accelerations, accelerations ahead, and how much of that is known.
    """

    def __init__(
        self,
        constants: TargetObserverConstants,
        limits: MotionLimits,
        products: QuadraticArithmetic,
        axes: int,
        shares: tuple[float, float],
    ) -> None:
        """`shares` are the drag per step, and the feed-forward gain of the snap in the jerk, in s."""
        constant = products.numbers.constant
        self._products, self._axes = products, axes
        self._acceleration, self._jerk, self._snap, self._known_snap, self._jump, self._known_jump = (
            constant(value, "velocity") for value in limits.row
        )
        self._drag = constant(shares[0], "factor")
        self._step = constant(constants.update_s, "tracker")
        self._snap_step = constant(shares[1], "tracker")
        self._ahead_snap_step = constant(shares[1] - constants.half_ahead_s, "tracker")
        self._snap_share = constant(constants.snap_share, "sine")
        self._update = constant(constants.update_s, "step")
        self._half, self._sixth = constant(0.5, "sine"), constant(1 / 6, "sine")
        self._ahead = constant(constants.ahead_share, "factor")
        self._share = constant(constants.noise_share, "sine")
        self._first_noise = constant(constants.first_noise, "velocity")
        self._most_noise = constant(constants.most_noise, "velocity")
        self._whole, self._top = constant(1.0, "factor"), constant(constants.fade_top, "factor")
        self._fade = constant(constants.fade, "per_noise")
        self._slopes = [constant(slope, "per_count") for slope in constants.memory_slopes]
        self._known_slope = constant(constants.known_slope, "per_count")
        counts = constants.least, constants.slow, constants.longest, constants.first
        self._least, self._slow, self._longest, self._first = (constant(n, "whole") for n in counts)
        self._known_least, self._known_longest = (
            constant(n, "whole") for n in (constants.known_least, constants.known_longest)
        )
        self._gains, self._known_gains = (
            np.array([[constant(value, "sine") for value in row] for row in table])
            for table in (constants.gains, constants.known_gains)
        )
        self._velocity_range = constant(constants.velocity_range, "velocity")
        self._bound = products.target_product(self._step, self._acceleration)
        self._jerk_limit = products.target_product(self._step, self._jerk)
        self._desired_gain = constant(constants.desired_gain, "sine")
        self._desired_jerk_gain = constant(constants.desired_jerk_gain, "sine")

    def stored(self, motion: ObservedMotion) -> list[Real]:
        """Return the columns (n, k) that nmpc_t stores of motions, in their order."""
        axes = np.stack(
            [
                *(motion.velocity_m_s, motion.acceleration, motion.jerk, motion.snap),
                *(motion.innovation, motion.noise, motion.memory, motion.missed),
            ],
            axis=2,
        )
        fed = [motion.acceleration_m_step2, motion.jerk_m_step2_update]
        desired = [motion.desired_m_s, motion.desired_acceleration, motion.desired_jerk]
        return [*fed, axes.reshape(len(axes), -1), *(desired if self._axes > 1 else [])]

    def follow(
        self, motion: ObservedMotion, program: Real, aim: Real, limited: Rows
    ) -> tuple[ObservedMotion, Real]:
        """Return the motions after a set-point, and what is aimed at, whose velocity is the fit's.

        program (n, k) are the program's targets, aim (n, 2 or 3 axes) these within the limits, limited (n,)
        whether a limit has changed them.
        """
        velocity, told, ahead = (program[:, k * self._axes : (k + 1) * self._axes] for k in (1, 2, 3))
        known = program[:, -1].astype(np.int64)[:, None]
        found = self._feed(self._observe(motion, velocity, told, ahead, known), known)
        fitted = np.where(
            (known == 0) & ~limited[:, None], found.velocity_m_s, aim[:, self._axes : 2 * self._axes]
        )
        return found, np.concatenate([aim[:, : self._axes], fitted, aim[:, 2 * self._axes :]], axis=1)

    def follow_limits(
        self, motion: ObservedMotion, desired: Real, was_limited: Rows, by_limits: Rows
    ) -> ObservedMotion:
        """Return the motions with desired velocities (n, 2) within limits, which act.

        was_limited (n,): whether there was one in the step before; by_limits (n,): whether A_T and J_T are
        those of the desired velocity.
        """
        products, product = self._products, self._products.tracker_product
        change = desired - motion.desired_m_s
        predicted = motion.desired_acceleration + motion.desired_jerk
        difference, zeros = change - predicted, np.zeros_like(desired)
        steady = np.abs(change) <= self._acceleration
        difference = np.where(steady, difference, zeros)
        acceleration = clamp(predicted + product(self._desired_gain, difference), self._acceleration)
        jerk = clamp(motion.desired_jerk + product(self._desired_jerk_gain, difference), self._jerk)
        begins = ~was_limited[:, None]
        moved = replace(
            motion,
            desired_m_s=desired,
            desired_acceleration=np.where(
                begins, motion.acceleration, np.where(steady, acceleration, motion.desired_acceleration)
            ),
            desired_jerk=np.where(begins | ~steady, zeros, jerk),
        )
        fed = self._fed(
            moved,
            products.target_product(self._step, moved.desired_acceleration),
            products.target_product(self._step, moved.desired_jerk),
        )
        return choose(by_limits, fed, moved)

    def shift(self, motion: ObservedMotion, change_m_s: Real) -> ObservedMotion:
        """Change the targets' velocities by the first columns of `change_m_s`, which is no acceleration."""
        moved, desired = (
            clamp(one + change_m_s[:, : self._axes], self._velocity_range)
            for one in (motion.velocity_m_s, motion.desired_m_s)
        )
        return replace(motion, velocity_m_s=moved, desired_m_s=desired)

    def turn(self, motion: ObservedMotion, sine: Real, cosine: Real) -> ObservedMotion:
        """Turn the motions (n, 2) by the angles of sine and cosine (n,), but for the velocity.

        A caller turns the target about the drone, so that the next velocity is taken as it is.
        """

        def turned(vector: Real, limit: Any) -> Real:
            return clamp(self._products.turn(vector, sine, cosine), limit)

        return replace(
            motion,
            acceleration_m_step2=turned(motion.acceleration_m_step2, self._bound),
            jerk_m_step2_update=turned(motion.jerk_m_step2_update, self._jerk_limit),
            acceleration=turned(motion.acceleration, self._acceleration),
            jerk=turned(motion.jerk, self._jerk),
            snap=turned(motion.snap, self._known_snap),
            desired_m_s=turned(motion.desired_m_s, self._velocity_range),
            desired_acceleration=turned(motion.desired_acceleration, self._acceleration),
            desired_jerk=turned(motion.desired_jerk, self._jerk),
            innovation=np.zeros_like(motion.innovation),
            missed=np.full_like(motion.missed, _HAS_TURNED),
        )

    def begin_again(self, motion: ObservedMotion) -> ObservedMotion:
        """Return the motion of a height whose frame has turned, about the vertical: it stays."""
        return motion

    def _observe(
        self, motion: ObservedMotion, velocity: Real, told: Real, ahead: Real, known: Any
    ) -> ObservedMotion:
        """Return the fit after a set-point."""
        products = self._products
        told, ahead = (
            clamp(products.change_product(self._update, one), self._acceleration) for one in (told, ahead)
        )
        begun = self._begin(motion, known)
        predicted = self._predict(begun)
        zeros = np.zeros_like(told)
        jerk = clamp(products.factor_product(ahead - told, self._ahead), self._jerk)
        grown = products.tracker_product(self._snap_share, (jerk - motion.jerk) - motion.snap)
        stated = replace(
            predicted,
            velocity_m_s=velocity,
            acceleration=np.where(known == 0, zeros, told),
            jerk=jerk,
            snap=clamp(motion.snap + grown, self._known_snap),
            innovation=zeros,
            missed=zeros,
            is_known=np.ones_like(motion.is_known),
        )
        first = replace(stated, jerk=np.where(known == 2, jerk, zeros), snap=zeros)
        by_velocity = self._limit(self._correct_velocity(predicted, velocity), self._snap)
        by_acceleration = self._correct_acceleration(predicted, velocity, told)
        by_acceleration = self._limit(by_acceleration, self._known_snap)
        later = _select(known, (by_velocity, by_acceleration, stated))
        return choose(motion.is_known, later, first)

    def _begin(self, motion: ObservedMotion, known: Any) -> ObservedMotion:
        """Return motions that count set-points of another kind from now on, where these are of another kind.

        Kinds are velocities, and accelerations, of which a motion has none in memory.
        """
        gives, zeros = known > 0, np.zeros_like(motion.memory)
        changes = gives == (motion.memory > 0)
        noise, memory = (np.where(gives, zeros, one) for one in (self._first_noise, self._first))
        return replace(
            motion,
            memory=np.where(changes, memory, motion.memory),
            noise=np.where(changes, noise, motion.noise),
            innovation=np.where(changes, zeros, motion.innovation),
        )

    def _predict(self, motion: ObservedMotion) -> ObservedMotion:
        """Return the fit a step later."""
        product = self._products.tracker_product
        half, sixth = product(self._half, motion.snap), product(self._sixth, motion.snap)
        change = motion.acceleration + (product(self._half, motion.jerk) + sixth)
        return replace(
            motion,
            velocity_m_s=motion.velocity_m_s + change,
            acceleration=motion.acceleration + (motion.jerk + half),
            jerk=motion.jerk + motion.snap,
        )

    def _limit(self, motion: ObservedMotion, snap: Any) -> ObservedMotion:
        """Return the fit within its limits."""
        return replace(
            motion,
            velocity_m_s=clamp(motion.velocity_m_s, self._velocity_range),
            acceleration=clamp(motion.acceleration, self._acceleration),
            jerk=clamp(motion.jerk, self._jerk),
            snap=clamp(motion.snap, snap),
        )

    def _judge(
        self, motion: ObservedMotion, innovation: Real, jump: Any
    ) -> tuple[ObservedMotion, Rows, Rows]:
        """Return motions with their noise, and which innovations are accepted, and which are jumps.

        A jump is the second in a row that is rejected; the prediction is taken for the first one.
        """
        noise = motion.noise
        trust = jump + ((noise + noise) + (noise + noise))
        change = np.abs(innovation - motion.innovation)
        change = np.where(change > trust, trust, change)
        noise = noise + self._products.tracker_product(self._share, change - noise)
        accepted = np.abs(innovation) <= trust
        jumped = ~accepted & (motion.missed != 0)
        zeros = np.zeros_like(innovation)
        judged = replace(
            motion,
            innovation=np.where(accepted, innovation, zeros),
            noise=np.where(noise > self._most_noise, self._most_noise, noise),
            missed=np.where(accepted | jumped, zeros, zeros + 1),
        )
        return judged, accepted, jumped

    def _correct_velocity(self, predicted: ObservedMotion, velocity: Real) -> ObservedMotion:
        """Return the fit with a velocity."""
        product, count = self._products.tracker_product, self._products.count_product
        has_turned = predicted.missed == _HAS_TURNED
        innovation = np.where(has_turned, np.zeros_like(velocity), velocity - predicted.velocity_m_s)
        motion, accepted, jumped = self._judge(predicted, innovation, self._jump)
        accepted = accepted & ~has_turned
        quick = self._least + count(self._slopes[0], motion.noise)
        wanted = np.minimum(
            np.minimum(quick, self._slow + count(self._slopes[1], motion.noise)), self._longest
        )
        longer = motion.memory + 1
        shorter = longer - FALL
        fallen = np.where(shorter > wanted, shorter, wanted)
        memory = np.where(longer > wanted, fallen, longer)
        gains = self._gains[np.maximum(memory - self._least, 0).astype(np.int64)]
        before = motion.velocity_m_s, motion.acceleration, motion.jerk, motion.snap
        fitted = [value + product(gains[..., k], innovation) for k, value in enumerate(before)]
        zeros = np.zeros_like(velocity)
        return replace(
            motion,
            velocity_m_s=np.where(
                has_turned | jumped, velocity, np.where(accepted, fitted[0], motion.velocity_m_s)
            ),
            acceleration=np.where(accepted, fitted[1], motion.acceleration),
            jerk=np.where(accepted, fitted[2], np.where(jumped, zeros, motion.jerk)),
            snap=np.where(accepted, fitted[3], np.where(jumped, zeros, motion.snap)),
            memory=np.where(accepted, memory, np.where(jumped, self._first, motion.memory)),
        )

    def _correct_acceleration(self, predicted: ObservedMotion, velocity: Real, told: Real) -> ObservedMotion:
        """Return the fit with an acceleration that the target knows."""
        product, count = self._products.tracker_product, self._products.count_product
        innovation = told - predicted.acceleration
        motion, accepted, jumped = self._judge(predicted, innovation, self._known_jump)
        wanted = np.minimum(self._known_least + count(self._known_slope, motion.noise), self._known_longest)
        gains = self._known_gains[(wanted - self._known_least).astype(np.int64)]
        before = motion.acceleration, motion.jerk, motion.snap
        fitted = [value + product(gains[..., k], innovation) for k, value in enumerate(before)]
        zeros = np.zeros_like(told)
        return replace(
            motion,
            velocity_m_s=velocity,
            acceleration=np.where(accepted, fitted[0], np.where(jumped, told, motion.acceleration)),
            jerk=np.where(accepted, fitted[1], np.where(jumped, zeros, motion.jerk)),
            snap=np.where(accepted, fitted[2], np.where(jumped, zeros, motion.snap)),
        )

    def _feed(self, motion: ObservedMotion, known: Any) -> ObservedMotion:
        """Return motions with A_T and J_T, which count less the noisier the velocities are."""
        products = self._products
        acceleration = products.target_product(self._step, motion.acceleration)
        snap_step = np.where(known == 2, self._ahead_snap_step, self._snap_step)
        by_snap = products.target_product(snap_step, motion.snap)
        jerk = products.target_product(self._step, motion.jerk) + by_snap
        belief = self._top - products.noise_product(self._fade, motion.noise)
        belief = confine(belief, np.zeros_like(belief), self._whole)
        faded = (known == 0) & (belief < self._whole)
        acceleration = np.where(faded, products.factor_product(acceleration, belief), acceleration)
        jerk = np.where(faded, products.factor_product(jerk, belief), jerk)
        return self._fed(motion, acceleration, jerk)

    def _fed(self, motion: ObservedMotion, acceleration: Real, jerk: Real) -> ObservedMotion:
        """Return motions with A_T, and with J_T, to which the drag adds."""
        if self._drag:
            jerk = jerk + self._products.factor_product(acceleration, self._drag)
        return replace(
            motion, acceleration_m_step2=acceleration, jerk_m_step2_update=clamp(jerk, self._jerk_limit)
        )


def level_observer(constants: QuadraticConstants, products: QuadraticArithmetic) -> TargetObserver:
    """Return the observer of targets along x and y."""
    found = constants.target_observer
    shares = constants.observer.drag_1_step, float(np.mean(constants.law.snap_s))
    return TargetObserver(found, found.level, products, 2, shares)


def climb_observer(
    constants: QuadraticConstants, products: QuadraticArithmetic, height: HeightConstants
) -> TargetObserver:
    """Return the observer of the height of targets."""
    found = constants.target_observer
    assert found.climb is not None, "with a height"
    return TargetObserver(found, found.climb, products, 1, (0.0, height.snap_s))


def _select(known: Any, cases: tuple[ObservedMotion, ObservedMotion, ObservedMotion]) -> ObservedMotion:
    """Return the motions (n, k) of the cases 0, 1 and 2 by what is known (n, 1)."""
    first, second, third = cases
    names = [name for name in vars(first) if name != "is_known"]
    return replace(
        first,
        **{
            name: np.where(
                known == 0,
                getattr(first, name),
                np.where(known == 1, getattr(second, name), getattr(third, name)),
            )
            for name in names
        },
    )
