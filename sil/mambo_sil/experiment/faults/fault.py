"""What a fault is: wrong inputs, missing updates, late commands, wrong weights.

A fault is a pure function of the controller's correct inputs and of the updates since its onset.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class ControllerInput:
    """Inputs of one controller at one update: state (7,), target (6,), thrust over mass."""

    state: FloatArray
    target: FloatArray
    thrust_acceleration_m_s2: float


class Effect(IntEnum):
    """What a fault does to the inputs; the engine has the same numbers in faults.c."""

    KEEP = 0
    FREEZE_STATE = 1
    SET_STATE = 2
    SCALE_STATE = 3
    SHIFT_STATE = 4
    WRAP_YAW = 5
    SHIFT_TARGET = 6
    SET_THRUST = 7


@dataclass(frozen=True, eq=False)
class Alteration:
    """A fault at the inputs of a controller.

    values:  of SCALE_STATE the factor of each column, of SHIFT_STATE and SHIFT_TARGET what is added to each,
             of SET_STATE and SET_THRUST the value, of WRAP_YAW half a turn.
    columns: first and behind the last column of SET_STATE.
    on, of:  SET_STATE acts in the first `on` of every `of` updates.
    """

    effect: Effect = Effect.KEEP
    values: tuple[float, ...] = ()
    columns: tuple[int, int] = (0, 0)
    on: int = 1
    of: int = 1

    def __call__(self, now: ControllerInput, began: ControllerInput, since: int) -> ControllerInput:
        """Return the controller's inputs.

        `now` are the correct ones, `began` those at the onset, `since` counts the updates since then.
        """
        given, values = now, np.asarray(self.values)
        match self.effect:
            case Effect.FREEZE_STATE:
                given = replace(now, state=began.state)
            case Effect.SET_STATE if since % self.of < self.on:
                given = replace(now, state=now.state.copy())
                given.state[slice(*self.columns)] = values[0]
            case Effect.SCALE_STATE:
                given = replace(now, state=now.state * values)
            case Effect.SHIFT_STATE:
                given = replace(now, state=now.state + values)
            case Effect.WRAP_YAW:
                given = replace(now, state=now.state.copy())
                given.state[6] = (now.state[6] + values[0]) % (2.0 * values[0]) - values[0]
            case Effect.SHIFT_TARGET:
                given = replace(now, target=now.target + values)
            case Effect.SET_THRUST:
                given = replace(now, thrust_acceleration_m_s2=self.values[0])
        return given


keep_inputs: Final = Alteration()
"""The correct inputs."""

freeze_state: Final = Alteration(Effect.FREEZE_STATE)
"""The state stays that at the onset; target and thrust stay correct."""

wrap_yaw: Final = Alteration(Effect.WRAP_YAW, (np.pi,))
"""The measured yaw is wrapped to [-pi, pi): it jumps where the heading passes south."""


def set_state(column: int | slice, value: float, *, on: int = 1, of: int = 1) -> Alteration:
    """Overwrite columns of the state with `value` in the first `on` of every `of` updates."""
    first, stop = (column.start, column.stop) if isinstance(column, slice) else (column, column + 1)
    return Alteration(Effect.SET_STATE, (value,), (first, stop), on, of)


def scale_state(scale: Sequence[float]) -> Alteration:
    """Multiply the state by `scale` (7,), as a wrong unit does."""
    return Alteration(Effect.SCALE_STATE, tuple(scale))


def shift_yaw(shift_rad: float) -> Alteration:
    """Add `shift_rad` to the measured yaw."""
    return Alteration(Effect.SHIFT_STATE, (*[0.0] * 6, shift_rad))


def move_target(by_m: float) -> Alteration:
    """Move the target along x."""
    return Alteration(Effect.SHIFT_TARGET, (by_m, *[0.0] * 5))


def report_thrust(value_m_s2: float) -> Alteration:
    """Overwrite the thrust acceleration."""
    return Alteration(Effect.SET_THRUST, (value_m_s2,))


@dataclass(frozen=True, eq=False)
class Fault:
    """A fault from update `begin` until before update `end`; the first update of a flight is 0.

    alter:        what happens to the controller's inputs.
    drop_every:   the controller is not called in the first of every so many updates, and its last command is
                  held; 0: it is always called.
    late_updates: delay of the commands in updates.
    """

    begin: int
    end: int
    alter: Alteration = keep_inputs
    drop_every: int = 0
    late_updates: int = 0

    def drops(self, since: int) -> bool:
        """Return whether the update `since` updates after the onset is dropped."""
        return self.drop_every > 0 and since % self.drop_every == 0


@dataclass(frozen=True)
class WeightChange:
    """New weights (tracking, effort) of flight `row`, set before update `update`."""

    row: int
    update: int
    weights: tuple[float, float]
