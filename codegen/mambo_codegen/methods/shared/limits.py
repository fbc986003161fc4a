"""Limits of speed, braking and place: what the controller aims at instead of a target that is too far.

While no limit acts, the target stays as it is, in every bit. Else the controller is given its own position
for the target's, and the limited desired velocity for the target's velocity. `limits.c` derives the law.
"""

from dataclasses import dataclass, replace
from enum import IntFlag
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.methods.shared.constants import Constants
from mambo_codegen.methods.shared.inputs import choose
from mambo_codegen.methods.shared.limits_arithmetic import LimitsArithmetic
from mambo_codegen.methods.shared.limits_constants import (
    LEAST_TURN_M2_S2,
    SPELLING,
    LimitsConstants,
    of_member,
)
from mambo_codegen.methods.shared.math import Real, clamp, larger, smaller
from mambo_codegen.methods.shared.tracker import TargetMotion, unknown_motion
from mambo_codegen.numbers.reach import PLANNED_SHARE
from mambo_codegen.settings.fields import SMALLEST_LIMIT

Rows = NDArray[np.bool_]


class ActiveLimit(IntFlag):
    """What `nmpc_limits_active` returns: the limits that act."""

    SPEED = 1
    BRAKING = 2
    FENCE = 4
    TILT = 8
    HEIGHT = 16
    THRUST = 32


OF_HEIGHT: Final = ActiveLimit.HEIGHT | ActiveLimit.THRUST
"""Limits that leave the target along x and y as it is."""


@dataclass(frozen=True)
class Bounds:
    """What follows from the limits of n controllers.

    centre_m:   (n, 2) of the fence.
    clear_m:    (n, 2) distance from the centre within which no wall limits the speed; less than 0 if the
                fence is too small for that.
    margin_m:   (n,) distance of that from the wall.
    knee_m:     (n,) distance up to which the approach speed is linear.
    near_m:     (n,) distance from the target at which braking ends.
    speed_m_s:  (n,) speed limit.
    braking:    (n,) twice the braking, m/s^2, at most what the approach rate asks for at the speed limit.
    tilt_rad:   (n,) tilt limit.
    """

    centre_m: Real
    clear_m: Real
    margin_m: Real
    knee_m: Real
    near_m: Real
    speed_m_s: Real
    braking: Real
    tilt_rad: Real


@dataclass(frozen=True)
class LimitsMemory:
    """What the limits of n controllers keep between two steps; without limits zeros, but for the tilt limit.

    command_limit: (n, 2) acceleration of a command at the tilt limit, right and forward, m/step^2; zeros with
                   the 1-norm.
    active:        (n,) the limits that acted in the last step, but TILT.
    target_m_s:    (n, 2) the target's velocity in the last step; zeros unless its turns limit the speed.
    turn_m2_s2:    (n,) mean product of successive ones, |v|^2 times the angle of an update period; likewise.
    """

    bounds: Bounds
    command_limit: Real
    active: NDArray[np.int64]
    target_m_s: Real
    turn_m2_s2: Real


def forgotten_target(memory: LimitsMemory) -> LimitsMemory:
    """Return the memory of controllers whose limits do not act and that have seen no target."""
    return replace(
        memory,
        active=np.zeros_like(memory.active),
        target_m_s=np.zeros_like(memory.target_m_s),
        turn_m2_s2=np.zeros_like(memory.turn_m2_s2),
    )


def _memory(bounds: Bounds) -> LimitsMemory:
    """Return the memory of controllers with `bounds` before the first step."""
    pair, one = np.zeros_like(bounds.centre_m), np.zeros_like(bounds.tilt_rad)
    return LimitsMemory(bounds, pair, np.zeros(len(one), np.int64), pair, one)


class NoLimits:
    """No limits of speed, braking and place: every target stays as it is."""

    def __init__(self, constants: Constants) -> None:
        self._tilt, self.defaults = constants.limits.tilt, np.zeros((1, 0), constants.numbers.computed)

    def memory(self, limits: Real) -> LimitsMemory:
        """Return the memory of controllers with limits (n, 0)."""
        pair, one = np.zeros((len(limits), 2), limits.dtype), np.zeros(len(limits), limits.dtype)
        tilt_rad = np.full_like(one, self._tilt)
        return _memory(Bounds(pair, pair, one, one, one, one, one, tilt_rad))

    def read(self, limits: ArrayLike) -> tuple[Real, Rows]:
        """Raise ValueError: there is nothing to set."""
        del limits
        raise ValueError("the settings have no limits")

    def aim(
        self, memory: LimitsMemory, motion: TargetMotion, position: Real, target: Real, follows: Rows
    ) -> tuple[LimitsMemory, TargetMotion, Real]:
        """Return memory, motions and targets as they are."""
        del position, follows
        return memory, motion, target

    def shift(self, memory: LimitsMemory, change_m_s: Real) -> LimitsMemory:
        """Return the memory as it is."""
        del change_m_s
        return memory

    def stored(self, memory: LimitsMemory, *, has_command: bool) -> list[Real]:
        """Return no columns: there is no nmpc_bounds_t."""
        del memory, has_command
        return []


class LimitsLaw:
    """The constants of the limits, in the scalar type of the controller."""

    def __init__(self, constants: Constants, limits: LimitsConstants) -> None:
        self._products = LimitsArithmetic(constants, limits)
        self._numbers, self._ranges = constants.numbers, constants.limits
        self._quantities = limits.quantities
        constant = self._numbers.constant
        self._smallest_speed = constant(SMALLEST_LIMIT, "velocity")
        self._smallest_braking = constant(SMALLEST_LIMIT, "braking")
        self._whole = constant(1.0, "sine")
        self._planned_share = constant(PLANNED_SHARE, "sine")
        self._slope = constant(SPELLING * limits.tilted.slope_m_s2_rad, "slope")
        self._trim = constant(limits.tilted.trim_m_s2, "braking")
        self._turn = None
        if limits.turn_m_s_rad is not None:
            self._turn = constant(limits.turn_m_s_rad, "slope")
            self._least_turn = constant(LEAST_TURN_M2_S2, "velocity")
        self._forgets = constants.tracker is not None
        self.defaults: Real = self.quantize([limits.limits])

    def memory(self, limits: Real) -> LimitsMemory:
        """Return the memory of controllers with good limits (n, k) before the first step."""
        return _memory(self.bounds(limits))

    def read(self, limits: ArrayLike) -> tuple[Real, Rows]:
        """Return limits (n, k) as numbers, and whether they may be set (n,), but for the height's."""
        given = self.quantize(limits)
        return given, self.check(given)

    def quantize(self, limits: ArrayLike) -> Real:
        """Return limits (n, k), of the constants' quantities, as numbers."""
        return self._numbers.quantize(limits, self._quantities).astype(self._numbers.computed)

    def check(self, limits: Real) -> Rows:
        """Return whether limits (n, k) may be set (n,), but for the height's; not if one is NaN."""
        speed, braking, tilt = (of_member(limits, one) for one in ("speed_m_s", "braking_m_s2", "tilt_rad"))
        low, high = of_member(limits, "fence_min_m"), of_member(limits, "fence_max_m")
        reach = self._ranges.position
        most = self._products.tilt_product(self._slope, tilt) - self._trim
        good: Rows = (
            (speed >= self._smallest_speed)
            & (speed <= self._ranges.velocity)
            & (tilt <= self._ranges.tilt)
            & (tilt >= -self._ranges.tilt)
            & (braking >= self._smallest_braking)
            & (braking <= most)
            & np.all((low >= -reach) & (low < high) & (high <= reach), axis=1)
        )
        return good

    def bounds(self, limits: Real) -> Bounds:
        """Derive what the steps need from good limits (n, k), but for the height's."""
        products, speed = self._products, of_member(limits, "speed_m_s")
        low, high = of_member(limits, "fence_min_m"), of_member(limits, "fence_max_m")
        braking_limit = of_member(limits, "braking_m_s2")
        braking = products.least_braking(braking_limit + braking_limit, speed)
        margin = products.margin(braking, speed)
        return Bounds(
            centre_m=products.half(low + high),
            clear_m=products.half(high - low) - margin[:, None],
            margin_m=margin,
            knee_m=products.knee(braking),
            near_m=products.near(braking),
            speed_m_s=speed,
            braking=braking,
            tilt_rad=of_member(limits, "tilt_rad"),
        )

    def _turn_speed(self, memory: LimitsMemory, velocity: Real) -> tuple[LimitsMemory, Real]:
        """Return the memory after targets with velocities (n, 2), and the speed that turns allow (n,)."""
        speed = memory.bounds.speed_m_s
        if self._turn is None:
            return memory, speed
        products, zero = self._products, np.zeros_like(speed)
        square = products.square_sum(velocity)
        moves = square > products.square(self._smallest_speed)
        turn = products.mean_turn(memory.turn_m2_s2, memory.target_m_s, velocity)
        turn = np.where(moves, clamp(turn, self._ranges.velocity), zero)
        target_speed = products.speed(np.where(moves, square, products.square(self._smallest_speed)))
        change = products.turn_product(self._turn, memory.bounds.tilt_rad)
        most, size = products.turn_most(change, target_speed), np.abs(turn)
        hard = moves & (size > most) & (size > self._least_turn)
        root = products.inverse_root(products.square(np.where(hard, size, self._least_turn)))
        share = products.share(np.where(hard, most, zero), root)
        turned = larger(products.share_product(target_speed, share), self._smallest_speed)
        memory = replace(memory, target_m_s=velocity, turn_m2_s2=turn)
        return memory, np.where(hard, smaller(speed, turned), speed)

    def _desire(
        self, bounds: Bounds, fastest: Real, position: Real, target: Real
    ) -> tuple[Real, NDArray[np.int64]]:
        """Return the desired velocities (n, 2) within the limits, and which limits act (n,).

        fastest (n,) is the speed limit, or the speed that the target's turn allows; position (n, 2) is that
        of the drone, target (n, 4 or more). Where no limit acts the velocity is not used: the target stays
        as it is.
        """
        products, place = self._products, position - bounds.centre_m
        clear = np.all(np.abs(place) <= bounds.clear_m, axis=1)
        is_free = clear & self._is_free(bounds, fastest, position, target)
        half_width = bounds.clear_m + bounds.margin_m[:, None]
        held, outside = _held(half_width, target, bounds.centre_m)
        error = held[:, 0:2] - position
        square = products.square_sum(error)
        end = np.where(self.is_slow(bounds, target) & ~outside, bounds.near_m, bounds.knee_m)
        far = square > products.square(end)
        ratio = np.where(far, self._braking_ratio(bounds, end, square), products.approach)
        desired = held[:, 2:4] + products.approach_speed(ratio[:, None], error)
        walled, cut = self._cut_off(bounds, half_width, place, desired)
        limited, fast = self._slowed(fastest, np.where(clear[:, None], desired, walled))
        active = np.where(fast, ActiveLimit.SPEED, np.where(far, ActiveLimit.BRAKING, 0)) + np.where(
            outside | (cut & ~clear), ActiveLimit.FENCE, 0
        )
        return limited, np.where(is_free, 0, active)

    def _is_free(self, bounds: Bounds, fastest: Real, position: Real, target: Real) -> Rows:
        """Return whether targets are so near, and desired velocities so small, that neither is limited."""
        products = self._products
        error = target[:, 0:2] - position
        desired = target[:, 2:4] + products.approach_speed(products.approach, error)
        free: Rows = (products.square_sum(error) <= products.square(bounds.near_m)) & (
            products.square_sum(desired) <= products.square(fastest)
        )
        return free

    def _braking_speed(self, bounds: Bounds, excess: Real) -> Real:
        """Return the speeds from which the braking stops within the knee and `excess` (n,)."""
        products = self._products
        square = products.braking_square(bounds.braking, products.half(bounds.knee_m) + excess)
        return products.braking_speed(square)

    def _approach(self, bounds: Bounds, distance: Real) -> Real:
        """Return the speeds from which the braking stops within `distance` (n,); negative beyond a wall."""
        excess = np.abs(distance) - bounds.knee_m
        far = excess > 0
        speed = self._braking_speed(bounds, np.where(far, excess, np.zeros_like(excess)))
        slow = self._products.approach_speed(self._products.approach, distance)
        return np.where(far, np.where(distance < 0, -speed, speed), slow)

    def _braking_ratio(self, bounds: Bounds, end: Real, square: Real) -> Real:
        """Return the approach speed over the distance (n,), from its square, where braking ends at `end`."""
        root = self._products.inverse_root(square)
        excess = np.abs(self._products.length(square, root) - end)
        return self._products.ratio(self._braking_speed(bounds, excess), root)

    def _slowed(self, fastest: Real, velocity: Real) -> tuple[Real, Rows]:
        """Return velocities (n, 2) of at most the speed limit (n,), and which were larger (n,)."""
        products = self._products
        square = products.square_sum(velocity)
        fast = square > products.square(fastest)
        share = products.share(fastest, products.inverse_root(square))
        slowed = np.where(fast[:, None], products.share_product(velocity, share[:, None]), velocity)
        return clamp(slowed, fastest[:, None]), fast

    def _cut_off(self, bounds: Bounds, half_width: Real, place: Real, velocity: Real) -> tuple[Real, Rows]:
        """Return velocities (n, 2) that brake in time before the walls, and which were others (n,).

        Outside, where `place` (n, 2) is more than `half_width` from the centre, they lead back in.
        """
        scalar = velocity.dtype.type
        towards = np.where(np.abs(place) <= half_width, velocity, place)
        sign = np.where(towards < 0, scalar(-1), scalar(1))
        room = half_width - (sign * place)
        most = np.stack([self._approach(bounds, room[:, axis]) for axis in range(2)], axis=1)
        cut = (sign * velocity) > most
        return np.where(cut, sign * most, velocity), np.any(cut, axis=1)

    def aim(
        self, memory: LimitsMemory, motion: TargetMotion, position: Real, target: Real, follows: Rows
    ) -> tuple[LimitsMemory, TargetMotion, Real]:
        """Return memory, motions of targets, and targets (n, k) within the limits, where they are followed.

        position (n, 2) is the drone's, follows (n,) whether a controller follows its target.
        """
        after, within = self.limit(memory, position, target)
        motion = choose(follows, self.forget_braking(motion, memory, after, target), motion)
        return (
            choose(follows, after, memory),
            motion,
            np.where(follows[:, None], within, target[:, : within.shape[1]]),
        )

    def limit(self, memory: LimitsMemory, position: Real, target: Real) -> tuple[LimitsMemory, Real]:
        """Return the targets (n, k) that stand for `target`, at drones at `position` (n, 2)."""
        memory, fastest = self._turn_speed(memory, target[:, 2:4])
        desired, active = self._desire(memory.bounds, fastest, position, target)
        limit_active = (active != 0)[:, None]
        velocity = np.where(limit_active, desired, target[:, 2:4])
        within = np.concatenate([np.where(limit_active, position, target[:, 0:2]), velocity], axis=1)
        return replace(memory, active=active), within

    def forget_braking(
        self, motion: TargetMotion, before: LimitsMemory, after: LimitsMemory, target: Real
    ) -> TargetMotion:
        """Return what is known of targets (n, 4 or more), nothing where braking ends."""
        if not self._forgets:
            return motion
        was = before.active & ~OF_HEIGHT
        ends = (was == ActiveLimit.BRAKING) & (after.active == 0) & self.is_slow(after.bounds, target)
        return choose(ends, unknown_motion(motion.velocity_m_s), motion)

    def shift(self, memory: LimitsMemory, change_m_s: Real) -> LimitsMemory:
        """Change the remembered velocity with the frame, by the first columns of `change_m_s`."""
        if self._turn is None:
            return memory
        moved = clamp(memory.target_m_s + change_m_s[:, 0:2], self._ranges.velocity)
        return replace(memory, target_m_s=moved)

    def shortened(self, move: Real, length: Real) -> tuple[Real, Rows]:
        """Return vectors (n, 2) of at most a length (n,), and which took its planned share or more (n,)."""
        products = self._products
        square = products.square_sum(move)
        is_long = square >= products.square(length)
        takes_much = square >= products.square(products.share_product(length, self._planned_share))
        share = smaller(products.share(length, products.inverse_root(square)), self._whole)
        return np.where(is_long[:, None], products.share_product(move, share[:, None]), move), takes_much

    def is_slow(self, bounds: Bounds, target: Real) -> Rows:
        """Return whether targets move at half the speed at which braking ends or less, along x and y (n,)."""
        products = self._products
        slow = products.approach_speed(products.approach, products.half(bounds.knee_m))
        rows: Rows = np.all(np.abs(target[:, 2:4]) <= slow[:, None], axis=1)
        return rows

    def stored(self, memory: LimitsMemory, *, has_command: bool) -> list[Real]:
        """Return the columns of nmpc_bounds_t, in their order."""
        bounds = memory.bounds
        columns = [bounds.centre_m, bounds.clear_m]
        columns += [
            one[:, None]
            for one in (
                *(bounds.margin_m, bounds.knee_m, bounds.near_m),
                *(bounds.speed_m_s, bounds.braking, bounds.tilt_rad),
            )
        ]
        columns += [memory.command_limit] if has_command else []
        return columns + ([] if self._turn is None else [memory.target_m_s, memory.turn_m2_s2[:, None]])


def limits_law(constants: Constants) -> LimitsLaw | NoLimits:
    """Return the limits of a controller."""
    return LimitsLaw(constants, constants.limiting) if constants.limiting else NoLimits(constants)


def _held(half_width: Real, target: Real, centre: Real) -> tuple[Real, Rows]:
    """Return targets (n, 4) put within the fence, velocities not leading out, and which were not (n,)."""
    place, velocity = target[:, 0:2] - centre, target[:, 2:4]
    beyond = np.abs(place) > half_width
    position = np.where(beyond, centre + clamp(place, half_width), target[:, 0:2])
    zero = np.zeros_like(velocity)
    within = np.where(place > 0, smaller(velocity, zero), larger(velocity, zero))
    held = np.concatenate([position, np.where(beyond, within, velocity)], axis=1)
    return held, np.any(beyond, axis=1)
