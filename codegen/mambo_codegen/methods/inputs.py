"""Inputs of a control step: their numbers, their ranges, and the status that follows."""

from collections.abc import Sequence
from dataclasses import fields, is_dataclass, replace
from enum import IntEnum
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.methods.constants import Constants
from mambo_codegen.methods.math import Real, clamp
from mambo_codegen.numbers.representation import COMMAND, STATE, THRUST

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


class Inputs:
    """The inputs of n controllers, in the numbers of the C."""

    def __init__(self, constants: Constants) -> None:
        self._numbers, self._target = constants.numbers, constants.target
        self.limits = constants.limits

    def quantize(
        self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike
    ) -> tuple[Real, Real, Real]:
        """Return states (n, 7), targets (n, k) and thrusts (n,) as numbers; k is 4, or 6 with accelerations.

        The columns of a target beyond k are ignored.
        """
        thrusts = np.asarray(thrust_acceleration_m_s2)[:, None]
        return (
            self.numbers(state, STATE),
            self.numbers(np.asarray(target)[:, : len(self._target)], self._target),
            self.numbers(thrusts, THRUST)[:, 0],
        )

    def numbers(self, values: ArrayLike, quantities: Sequence[str]) -> Real:
        """Return `values` as numbers, in the type that the reference computes with."""
        return self._numbers.quantize(values, quantities).astype(self._numbers.computed)

    def check(self, state: Real, target: Real, thrust: Real) -> tuple[Rows, Rows, Rows]:
        """Return whether each state, each target and each thrust (n,) is finite and within its range."""
        limits = self.limits
        good_state = (
            within(state[:, 0:2], limits.position)
            & within(state[:, 2:4], limits.velocity)
            & within(state[:, 4:6], limits.attitude)
            & within(state[:, 6:7], limits.yaw)
        )
        good_target = (
            within(target[:, 0:2], limits.position)
            & within(target[:, 2:4], limits.velocity)
            & within(target[:, 4:], limits.thrust_most)
        )
        good_thrust: Rows = (thrust >= limits.thrust_least) & (thrust <= limits.thrust_most)
        return good_state, good_target, good_thrust

    def status(self, good_state: Rows, good_target: Rows, good_thrust: Rows) -> NDArray[np.int64]:
        """Return the status (n,) of a step whose inputs are good or not; the first bad one names it."""
        return np.select(
            [~good_state, ~good_target, ~good_thrust],
            [Status.BAD_STATE, Status.BAD_TARGET, Status.BAD_THRUST],
            Status.OK,
        )

    def command(self, command_rad: ArrayLike) -> tuple[Real, Rows]:
        """Return commands (n, 2) clamped to the tilt limit, and whether each may be set."""
        given = self.numbers(command_rad, COMMAND)
        return clamp(given, self.limits.tilt), within(given, self.limits.attitude)


def within(values: Real, limit: Any) -> Rows:
    """Return for each row of (n, k) whether all values lie in -limit..limit; NaN does not."""
    inside: Rows = np.all((values >= -limit) & (values <= limit), axis=1)
    return inside


def choose(chosen: Rows, new: Record, old: Record) -> Record:
    """Return a record of arrays (n, ...) with the rows of `new` where `chosen` (n,), else those of `old`."""

    def rows(name: str) -> Any:
        ours, theirs = getattr(new, name), getattr(old, name)
        if is_dataclass(ours):
            return choose(chosen, ours, theirs)
        return np.where(chosen.reshape(-1, *[1] * (ours.ndim - 1)), ours, theirs)

    return replace(new, **{field.name: rows(field.name) for field in fields(new)})
