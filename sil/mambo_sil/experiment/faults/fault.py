"""What a fault is: wrong inputs, missing updates, late commands, wrong weights.

A fault is a pure function of the controller's correct inputs and of the updates since its onset.
"""

from dataclasses import dataclass, replace

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class ControllerInput:
    """Inputs of one controller at one update: state (7,), target (9,), thrust over mass.

    Of a controller of the height: state (10,), target (13,), and the reported thrust.
    """

    state: FloatArray
    target: FloatArray
    thrust_acceleration_m_s2: float


@dataclass(frozen=True)
class KeepInputs:
    """The correct inputs."""

    def __call__(self, now: ControllerInput, _began: ControllerInput, _since: int) -> ControllerInput:
        """Return what the controller is given.

        `now` are the correct inputs, `began` those at the onset, `since` counts the updates since then; so it
        is for every alteration.
        """
        return now


@dataclass(frozen=True)
class FreezeState:
    """The state stays that at the onset; target and thrust stay correct."""

    def __call__(self, now: ControllerInput, began: ControllerInput, _since: int) -> ControllerInput:
        """Return what the controller is given."""
        return replace(now, state=began.state)


@dataclass(frozen=True)
class SetState:
    """Columns of the state are overwritten with `value` in the first `on` of every `of` updates."""

    columns: range
    value: float
    on: int = 1
    of: int = 1

    def __call__(self, now: ControllerInput, _began: ControllerInput, since: int) -> ControllerInput:
        """Return what the controller is given."""
        if since % self.of >= self.on:
            return now
        state = now.state.copy()
        state[self.columns.start : self.columns.stop] = self.value
        return replace(now, state=state)


@dataclass(frozen=True)
class ScaleState:
    """The state is multiplied by seven factors, as a wrong unit does; the height counts as the position."""

    factors: tuple[float, ...]

    @property
    def numbers(self) -> tuple[float, ...]:
        """The factors of a state with a height."""
        return (*self.factors, self.factors[0], self.factors[2], 1.0)

    def __call__(self, now: ControllerInput, _began: ControllerInput, _since: int) -> ControllerInput:
        """Return what the controller is given."""
        return replace(now, state=now.state * np.array(self.numbers[: len(now.state)]))


@dataclass(frozen=True)
class ShiftState:
    """Seven numbers are added to the state."""

    by: tuple[float, ...]

    def __call__(self, now: ControllerInput, _began: ControllerInput, _since: int) -> ControllerInput:
        """Return what the controller is given."""
        return replace(now, state=_added(now.state, self.by))


@dataclass(frozen=True)
class WrapYaw:
    """The measured yaw is wrapped to [-pi, pi): it jumps where the heading passes south."""

    def __call__(self, now: ControllerInput, _began: ControllerInput, _since: int) -> ControllerInput:
        """Return what the controller is given."""
        state = now.state.copy()
        state[6] = (state[6] + np.pi) % (2.0 * np.pi) - np.pi
        return replace(now, state=state)


@dataclass(frozen=True)
class ShiftTarget:
    """Six numbers are added to the target."""

    by: tuple[float, ...]

    def __call__(self, now: ControllerInput, _began: ControllerInput, _since: int) -> ControllerInput:
        """Return what the controller is given."""
        return replace(now, target=_added(now.target, self.by))


@dataclass(frozen=True)
class SetThrust:
    """The thrust acceleration is overwritten."""

    value_m_s2: float

    def __call__(self, now: ControllerInput, _began: ControllerInput, _since: int) -> ControllerInput:
        """Return what the controller is given."""
        return replace(now, thrust_acceleration_m_s2=self.value_m_s2)


Alteration = KeepInputs | FreezeState | SetState | ScaleState | ShiftState | WrapYaw | ShiftTarget | SetThrust
"""What happens to the inputs of a controller."""


def _added(values: FloatArray, by: tuple[float, ...]) -> FloatArray:
    """Return values to the first of which numbers are added."""
    return np.concatenate([values[: len(by)] + np.array(by), values[len(by) :]])


def shift_yaw(shift_rad: float) -> ShiftState:
    """Add `shift_rad` to the measured yaw."""
    return ShiftState((*[0.0] * 6, shift_rad))


def move_target(by_m: float) -> ShiftTarget:
    """Move the target along x."""
    return ShiftTarget((by_m, *[0.0] * 5))


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
    alter: Alteration = KeepInputs()
    drop_every: int = 0
    late_updates: int = 0

    def drops(self, since: int) -> bool:
        """Return whether the update `since` updates after the onset is dropped."""
        return self.drop_every > 0 and since % self.drop_every == 0
