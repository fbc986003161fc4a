"""Products of the numbers of a controller, by the names that its templates have for them.

In floating point a product is one multiplication, which the C writes as `a * b`. In fixed point it is a
multiplication to 64 bits and a shift to the format of the result, most often rounded to nearest, ties up.
Sums, differences and comparisons are plain in both. The arrays of a fixed point reference are int64, in which
none of its numbers overflows.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mambo_codegen.methods.shared.constants import Constants
from mambo_codegen.methods.shared.math import Real, fixed_sine_cosine, rounded, sine_cosine
from mambo_codegen.numbers.fixed_point import SINE_BITS


class Products:
    """The representation of a controller's numbers, and what takes a product to the format of its result."""

    def __init__(self, constants: Constants, shifts: Mapping[str, int] | None) -> None:
        """`shifts` are the right shifts of fixed point by name; None in floating point."""
        self.numbers, self._shifts = constants.numbers, shifts
        self._half: Any = self.numbers.scalar(0.5) if shifts is None else 1
        """A half; 1 in fixed point, where the shift halves too."""

    def nearest(self, product: Real, name: str) -> Real:
        """Return a product in the format of its result, rounded to nearest, ties up."""
        return product if self._shifts is None else rounded(product, self._shifts[name])

    def _down(self, product: Real, name: str) -> Real:
        """Return a product in the format of its result, rounded down."""
        if self._shifts is None:
            return product
        bits = self._shifts[name]
        return product >> bits if bits >= 0 else product << -bits

    def _up(self, number: Real, name: str) -> Real:
        """Return a number in a format with more bits."""
        return number if self._shifts is None else number * 2 ** self._shifts[name]

    def _at_most(self, value: Real, limit: Any) -> Real:
        """Return a value, in fixed point at most `limit`."""
        return value if self._shifts is None else np.minimum(value, limit)

    def _within(self, value: Real, limit: Any) -> Real:
        """Return a value, in fixed point within -limit..limit."""
        return value if self._shifts is None else np.clip(value, -limit, limit)


class Arithmetic(Products):
    """The products that the control steps of both methods have."""

    def __init__(self, constants: Constants, shifts: Mapping[str, int] | None) -> None:
        """`shifts` as in `Products`, of the products of the method."""
        super().__init__(constants, shifts and {"sine": SINE_BITS, **shifts})
        self._trigonometry = constants.trigonometry
        self._sine_cosine: Callable[[Real, Any], tuple[Real, Real]] = (
            sine_cosine if shifts is None else fixed_sine_cosine
        )

    def sine_cosine(self, yaw_rad: Real) -> tuple[Real, Real]:
        """Return sine and cosine of a heading."""
        return self._sine_cosine(yaw_rad, self._trigonometry)

    def sine_product(self, value: Real, sine: Real) -> Real:
        """Return value * sine, in the format of the value."""
        return self.nearest(value * sine, "sine")

    def turn(self, vector: Real, sine: Real, cosine: Real) -> Real:
        """Turn vectors (n, 2) by the angles of which sine and cosine (n,) are given."""
        product, one, other = self.sine_product, vector[:, 0], vector[:, 1]
        return np.stack(
            [product(one, cosine) - product(other, sine), product(other, cosine) + product(one, sine)], axis=1
        )

    def target_product(self, factor: Any, value: Real) -> Real:
        """Return factor * change of a velocity, m/s, or a derivative of it in steps; in m/step^2."""
        return self.nearest(factor * value, "target_product")

    def tracker_product(self, gain: Any, acceleration_m_step2: Real) -> Real:
        """Return gain * acceleration, m/step^2."""
        return self.nearest(gain * acceleration_m_step2, "sine")

    def factor_product(self, value: Real, factor: Real) -> Real:
        """Return value * factor, in the format of the value."""
        return self.nearest(value * factor, "factor_product")

    def noise_product(self, steps2_per_m: Any, acceleration_m_step2: Real) -> Real:
        """Return steps2_per_m * acceleration, a factor."""
        return self.nearest(steps2_per_m * acceleration_m_step2, "noise_product")

    def feedback_product(self, steps: Any, change_rad: Real) -> Real:
        """Return steps * change of an angle, rad."""
        return self.nearest(steps * change_rad, "feedback_product")
