"""Inputs of a control step: their numbers, their ranges, and the status that follows."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from enum import IntEnum
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.methods.shared.constants import Constants
from mambo_codegen.methods.shared.math import Real, clamp
from mambo_codegen.numbers.representation import THRUST
from mambo_codegen.port.taken import MOST_KNOWN

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Record = TypeVar("Record", bound="DataclassInstance")
Rows = NDArray[np.bool_]


class Status(IntEnum):
    """What `nmpc_step` and its siblings return."""

    OK = 0
    NULL_POINTER = 1
    BAD_STATE = 2
    BAD_TARGET = 3
    BAD_THRUST = 4
    BAD_WEIGHT = 5
    BAD_COMMAND = 6
    BAD_LIMITS = 7
    BAD_JUMP = 8


@dataclass(frozen=True)
class FrameShift:
    """Jumps of the frames of n controllers, in the numbers of the C.

    position_m, velocity_m_s: (n, 2) along x and y; (n, 3) with a height, up.
    heading_rad: (n,)
    """

    position_m: Real
    velocity_m_s: Real
    heading_rad: Real


class Inputs:
    """The inputs of n controllers, in the numbers of the C."""

    def __init__(self, constants: Constants) -> None:
        self._numbers, self._target = constants.numbers, constants.target
        self._state, self._command, self._shift = constants.state, constants.command, constants.shift
        self._has_height = constants.has_height
        self._known = [one.column for one in constants.port.wholes("target")]
        self.limits = constants.limits

    def quantize(
        self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike | None
    ) -> tuple[Real, Real, Real]:
        """Return states (n, 7), targets (n, k) and thrusts (n,) as numbers; k is 4, or 6 with accelerations.

        With a height states are (n, 10), and targets have 2 columns more, or 3; there is no thrust, and the
        numbers are the least. The columns of a target beyond k are ignored. Raises ValueError for a thrust
        that is missing, or that there is not.
        """
        if (thrust_acceleration_m_s2 is None) != self._has_height:
            raise ValueError(
                "with [height] a step takes no thrust"
                if self._has_height
                else "without [height] a step takes the thrust"
            )
        states = self.numbers(state, self._state)
        if thrust_acceleration_m_s2 is None:
            thrusts = np.full(len(states), self.limits.thrust_least)
        else:
            thrusts = self.numbers(np.asarray(thrust_acceleration_m_s2)[:, None], THRUST)[:, 0]
        return states, self.numbers(np.asarray(target)[:, : len(self._target)], self._target), thrusts

    def numbers(self, values: ArrayLike, quantities: Sequence[str]) -> Real:
        """Return `values` as numbers, in the type that the reference computes with."""
        return self._numbers.quantize(values, quantities).astype(self._numbers.computed)

    def check(self, state: Real, target: Real, thrust: Real) -> tuple[Rows, Rows, Rows]:
        """Return whether each state, each target and each thrust (n,) is finite and within its range."""
        limits = self.limits
        good_state, good_target = self._within(state, self._state), self._within(target, self._target)
        if self._known:
            good_target = good_target & np.isin(target[:, self._known[0]], range(MOST_KNOWN + 1))
        good_thrust: Rows = (thrust >= limits.thrust_least) & (thrust <= limits.thrust_most)
        return good_state, good_target, good_thrust

    def _within(self, values: Real, quantities: Sequence[str]) -> Rows:
        """Return for each row of (n, k) whether all values lie in the ranges of their quantities."""
        good: Rows = np.ones(len(values), np.bool_)
        for quantity, limit in self.limits.largest.items():
            columns = [column for column, name in enumerate(quantities) if name == quantity]
            good &= within(values[:, columns], limit)
        return good

    def status(self, good_state: Rows, good_target: Rows, good_thrust: Rows) -> NDArray[np.int64]:
        """Return the status (n,) of a step whose inputs are good or not; the first bad one names it."""
        return np.select(
            [~good_state, ~good_target, ~good_thrust],
            [Status.BAD_STATE, Status.BAD_TARGET, Status.BAD_THRUST],
            Status.OK,
        )

    def command(self, command: ArrayLike) -> tuple[Real, Rows]:
        """Return commands (n, 2) clamped to the tilt limit, and whether each may be set.

        With a height they have the thrust for a third column, which is not limited.
        """
        given = self.numbers(command, self._command)
        angles = given[:, 0:2]
        good = self._within(given, self._command)
        return np.concatenate([clamp(angles, self.limits.tilt), given[:, 2:]], axis=1), good

    def shift(self, change: ArrayLike) -> tuple["FrameShift", Rows]:
        """Return jumps of the frame (n, k), and whether each is finite and within its range.

        The columns are changes of x, y, with a height the height, then of their velocities, then the heading.
        """
        given = self.numbers(change, self._shift)
        axes, good = len(self._shift) // 2, self._within(given, self._shift)
        position, velocity, heading = given[:, :axes], given[:, axes : 2 * axes], given[:, 2 * axes :]
        zero = self._numbers.computed(0)
        position, velocity, heading = (
            np.where(good[:, None], part, zero) for part in (position, velocity, heading)
        )
        return FrameShift(position, velocity, heading[:, 0]), good


def within(values: Real, limit: Any) -> Rows:
    """Return for each row of (n, k) whether all values lie in -limit..limit; NaN does not."""
    inside: Rows = np.all((values >= -limit) & (values <= limit), axis=1)
    return inside


def choose(chosen: Rows, new: Record, old: Record) -> Record:
    """Return a record of arrays (n, ...) with the rows of `new` where `chosen` (n,), else of `old`.

    What one of them does not have, which is None, neither has.
    """
    if chosen.all():
        return new

    def rows(name: str) -> Any:
        ours, theirs = getattr(new, name), getattr(old, name)
        if ours is None:
            return None
        if is_dataclass(ours):
            return choose(chosen, ours, theirs)
        return np.where(chosen.reshape(-1, *[1] * (ours.ndim - 1)), ours, theirs)

    return replace(new, **{field.name: rows(field.name) for field in fields(new)})
