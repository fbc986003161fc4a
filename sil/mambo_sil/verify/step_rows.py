"""The inputs of a step as one row of numbers, as calls of the C interface have them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods import Method
from mambo_codegen.numbers.gravity import hover_thrust
from mambo_codegen.numbers.representation import STATE, TARGET, THRUST
from mambo_sil.verify.step_inputs import StepInputs

Rows = NDArray[np.float64]

POSITION = slice(0, 2)
VELOCITY = slice(2, 4)
TILT = slice(4, 6)
YAW = 6
"""Columns of the state; the target's come after it and begin with position and velocity too."""


class StepRows:
    """The columns of a row: state, target, thrust, and the accelerations of the target if they are given.

    With a height: state and target, and no thrust.

    quantities:   of all columns.
    target:       columns of the target's position and velocity.
    thrust:       columns of the thrust, none with a height.
    acceleration: columns of the target's acceleration, none if it is not given.
    """

    def __init__(self, method: Method) -> None:
        self._hover_m_s2 = hover_thrust(method.settings)
        first, is_given = len(method.state), len(method.level_target) > len(TARGET)
        after = first + len(TARGET)
        self.target, self.thrust = slice(first, after), slice(after, after + (not method.has_height))
        self.acceleration = slice(self.thrust.stop, self.thrust.stop + (2 * is_given))
        self.quantities: tuple[str, ...] = (
            (*method.state, *method.target)
            if method.has_height
            else (*STATE, *TARGET, *THRUST, *method.target[len(TARGET) :])
        )

    def hovering(self, n: int) -> Rows:
        """Return rows (n, k) of drones that hover in the origin, which is their target."""
        rows = np.zeros((n, len(self.quantities)))
        rows[:, self.thrust] = self._hover_m_s2
        return rows

    def join(self, inputs: StepInputs) -> Rows:
        """Return the rows (n, k) of inputs."""
        n, level, target = len(inputs.state), len(TARGET), inputs.target
        thrust = np.zeros((n, 0)) if inputs.thrust is None else inputs.thrust[:, None]
        return np.concatenate([inputs.state, target[:, :level], thrust, target[:, level:]], axis=1)

    def split(self, rows: NDArray[Any]) -> StepInputs:
        """Return the inputs of rows (n, k)."""
        target = np.concatenate([rows[:, self.target], rows[:, self.thrust.stop :]], axis=1)
        thrust = rows[:, self.thrust]
        return StepInputs(rows[:, : self.target.start], target, thrust[:, 0] if thrust.size else None)
