"""Axis: what x, y and the height have in common."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.quadratic.arithmetic import QuadraticArithmetic
from mambo_codegen.methods.quadratic.constants import QuadraticConstants
from mambo_codegen.methods.shared.math import Real, clamp

Motion = tuple[Real, Real]
"""Positions, m, and velocities, m/step, along one axis or two, of one shape; or their innovations."""


class AxisMotion:
    """How positions and velocities are corrected and predicted, in the scalar type of the controller."""

    def __init__(self, constants: QuadraticConstants, products: QuadraticArithmetic) -> None:
        constant, observer = products.numbers.constant, constants.observer
        self._products = products
        self._position_limit = constant(constants.settings.ranges.position_m, "position")
        self._velocity_limit = constant(observer.velocity_limit_m_step, "speed")
        self._age = constant(observer.age_steps, "age") if observer.age_steps else None

    def innovate(self, motion: Motion, measured: Motion, acceleration: Real) -> Motion:
        """Return the innovations of measured positions and velocities."""
        (position, velocity), (measured_m, measured_step) = motion, measured
        if self._age is not None:
            measured_m = measured_m + self._products.aged_position(self._age, velocity)
            measured_step = measured_step + self._products.aged_velocity(self._age, acceleration)
        return measured_m - position, measured_step - velocity

    def correct(self, motion: Motion, gains: Sequence[Sequence[Any]], innovation: Motion) -> Motion:
        """Return positions and velocities, corrected with the first two rows of gains."""
        (position, velocity), (by_position, by_velocity) = motion, innovation
        products = self._products
        position = position + products.position_correction(gains[0][0], by_position, gains[0][1], by_velocity)
        velocity = velocity + products.velocity_correction(gains[1][0], by_position, gains[1][1], by_velocity)
        return position, velocity

    def predict(self, motion: Motion, acceleration: Real) -> Motion:
        """Return positions and velocities at the next control step."""
        (position, velocity), products = motion, self._products
        mean = velocity + products.half_change(acceleration)
        return (
            clamp(position + products.position_change(mean), self._position_limit),
            clamp(velocity + products.velocity_change(acceleration), self._velocity_limit),
        )

    def shift(self, motion: Motion, change_m: Real, change_m_step: Real) -> Motion:
        """Return positions and velocities after jumps of the frame."""
        position, velocity = motion
        if self._age is not None:
            change_m = change_m + self._products.aged_position(self._age, change_m_step)
        return (
            clamp(position + change_m, self._position_limit),
            clamp(velocity + change_m_step, self._velocity_limit),
        )


def row_product(products: QuadraticArithmetic, row: Sequence[Any], state: Sequence[Any]) -> Real:
    """Return a row of the law times a state, number by number."""
    total = row[0] * state[0]
    for gain, value in zip(row[1:], state[1:], strict=True):
        total = total + (gain * value)
    return products.row_sum(total)


def gains_of(constant: Any, gain: NDArray[np.float64], names: Sequence[str]) -> list[list[Any]]:
    """Return gains of innovations as numbers of the C, a row for each of `names`."""
    return [
        [constant(value, f"{name}_by_{by}") for value, by in zip(row, ("position", "velocity"), strict=True)]
        for row, name in zip(gain, names, strict=True)
    ]
