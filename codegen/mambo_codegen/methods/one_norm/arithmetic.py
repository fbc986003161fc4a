"""Products of the controller, by the names that `nmpc_products_fixed.h` has for them.

In floating point a product is one multiplication, which the C writes as `a * b`. In fixed point it is one
multiplication to 64 bits and one shift to the format of the result, rounded to nearest, ties up; the products
of a roll-out, of the gradient of the distance and of a step of RPROP are rounded down. Sums, differences and
comparisons are plain in both. The arrays of a fixed point reference are int64, in which none of its numbers
overflows.
"""

from typing import Any, Protocol

import numpy as np

from mambo_codegen.methods.one_norm.constants import OneNormConstants
from mambo_codegen.methods.one_norm.formats import OneNormFormats
from mambo_codegen.methods.shared.math import Real, fixed_sine_cosine, rounded, sine_cosine
from mambo_codegen.numbers.fixed_point import SINE_BITS
from mambo_codegen.numbers.representation import Representation
from mambo_codegen.numbers.trigonometry import FixedTrigonometry, Trigonometry


class OneNormArithmetic(Protocol):
    """The products of a control step and the representation of their numbers."""

    numbers: Representation

    def sine_cosine(self, yaw_rad: Real) -> tuple[Real, Real]:
        """Return sine and cosine of a heading."""

    def thrust_product(self, thrust_m_s2: Real) -> Real:
        """Return thrust acceleration * tau^2, m/step^2."""

    def sine_product(self, value: Real, sine: Real) -> Real:
        """Return value * sine."""

    def velocity_product(self, velocity_m_s: Real) -> Real:
        """Return tau * velocity, m/step."""

    def gain_product(self, gain_m_step2_rad: Real, tilt_rad: Real) -> Real:
        """Return gain * tilt, m/step^2."""

    def share_product(self, share: Any, acceleration_m_step2: Real) -> Real:
        """Return share * acceleration."""

    def initial_error(self, difference_m: Real) -> Real:
        """Return a difference of positions as a predicted error, clamped in fixed point."""

    def error_change(self, displacement_m_step: Real) -> Real:
        """Return a displacement in the format of errors."""

    def distance_gradient(self, gain_m_step2_rad: Real, subgradient: Real) -> Real:
        """Return the gradient of the distance by the moves (n, moves, 2).

        Gains are (n, 2, 1, 2), subgradients by acceleration (n, 2, moves, 2).
        """

    def tracking_cost(self, weight: Real, distance_m: Real) -> Real:
        """Return lambda_1 * distance."""

    def effort_cost(self, weight: Real, variation_rad: Real) -> Real:
        """Return lambda_2 * variation."""

    def tracking_gradient(self, weight: Real, distance_gradient_m_rad: Real) -> Real:
        """Return lambda_1 * gradient of the distance."""

    def effort_gradient(self, weight: Real) -> Real:
        """Return lambda_2 in the format of gradients."""

    def step_product(self, step_rad: Real, factor: Any) -> Real:
        """Return step size * eta."""

    def target_product(self, factor: Any, value: Real) -> Real:
        """Return factor * change of a velocity, m/s, or given acceleration, m/s^2; in m/step^2."""

    def tracker_product(self, gain: Any, acceleration_m_step2: Real) -> Real:
        """Return gain * acceleration, m/step^2."""

    def feedback_product(self, steps: Any, change_rad: Real) -> Real:
        """Return steps * change of an angle, rad."""


class OneNormFloatArithmetic:
    """Products in float32 or float64."""

    def __init__(self, constants: OneNormConstants) -> None:
        self.numbers = constants.numbers
        self._trigonometry: Trigonometry = constants.trigonometry
        self._step_s = self.numbers.scalar(constants.settings.horizon.prediction_step_s)
        self._step_squared_s2 = self.numbers.scalar(constants.tables.step_squared_s2)

    def sine_cosine(self, yaw_rad: Real) -> tuple[Real, Real]:
        return sine_cosine(yaw_rad, self._trigonometry)

    def thrust_product(self, thrust_m_s2: Real) -> Real:
        return thrust_m_s2 * self._step_squared_s2

    def sine_product(self, value: Real, sine: Real) -> Real:
        return value * sine

    def velocity_product(self, velocity_m_s: Real) -> Real:
        return self._step_s * velocity_m_s

    def gain_product(self, gain_m_step2_rad: Real, tilt_rad: Real) -> Real:
        return gain_m_step2_rad * tilt_rad

    def share_product(self, share: Any, acceleration_m_step2: Real) -> Real:
        return share * acceleration_m_step2

    def initial_error(self, difference_m: Real) -> Real:
        return difference_m

    def error_change(self, displacement_m_step: Real) -> Real:
        return displacement_m_step

    def distance_gradient(self, gain_m_step2_rad: Real, subgradient: Real) -> Real:
        products = gain_m_step2_rad * subgradient
        return products[:, 0] + products[:, 1]

    def tracking_cost(self, weight: Real, distance_m: Real) -> Real:
        return weight * distance_m

    def effort_cost(self, weight: Real, variation_rad: Real) -> Real:
        return weight * variation_rad

    def tracking_gradient(self, weight: Real, distance_gradient_m_rad: Real) -> Real:
        return weight * distance_gradient_m_rad

    def effort_gradient(self, weight: Real) -> Real:
        return weight

    def step_product(self, step_rad: Real, factor: Any) -> Real:
        return step_rad * factor

    def target_product(self, factor: Any, value: Real) -> Real:
        return factor * value

    def tracker_product(self, gain: Any, acceleration_m_step2: Real) -> Real:
        return gain * acceleration_m_step2

    def feedback_product(self, steps: Any, change_rad: Real) -> Real:
        return steps * change_rad


class OneNormFixedArithmetic:
    """Products in fixed point."""

    def __init__(self, constants: OneNormConstants, formats: OneNormFormats) -> None:
        self.numbers = constants.numbers
        self._formats = formats
        self._trigonometry: FixedTrigonometry = constants.trigonometry
        self._step_s = self.numbers.constant(constants.settings.horizon.prediction_step_s, "step")
        self._step_squared_s2 = self.numbers.constant(constants.tables.step_squared_s2, "step_squared")
        is_given = constants.tracker is not None and constants.tracker.is_given
        self._target_bits = formats.thrust if is_given else formats.velocity

    def sine_cosine(self, yaw_rad: Real) -> tuple[Real, Real]:
        return fixed_sine_cosine(yaw_rad, self._trigonometry)

    def thrust_product(self, thrust_m_s2: Real) -> Real:
        f = self._formats
        return rounded(thrust_m_s2 * self._step_squared_s2, f.thrust + f.step_squared - f.gain)

    def sine_product(self, value: Real, sine: Real) -> Real:
        return rounded(value * sine, SINE_BITS)

    def velocity_product(self, velocity_m_s: Real) -> Real:
        f = self._formats
        half = 2 ** (f.acceleration - f.error - 1)
        return rounded(self._step_s * velocity_m_s, f.step + f.velocity - f.acceleration) + half

    def gain_product(self, gain_m_step2_rad: Real, tilt_rad: Real) -> Real:
        f = self._formats
        return (gain_m_step2_rad * tilt_rad) >> (f.gain + f.angle - f.acceleration)

    def share_product(self, share: Any, acceleration_m_step2: Real) -> Real:
        return (share * acceleration_m_step2) >> self._formats.share

    def initial_error(self, difference_m: Real) -> Real:
        f = self._formats
        return np.clip(difference_m, -f.error_limit, f.error_limit) * 2 ** (f.error - f.position)

    def error_change(self, displacement_m_step: Real) -> Real:
        return displacement_m_step >> (self._formats.acceleration - self._formats.error)

    def distance_gradient(self, gain_m_step2_rad: Real, subgradient: Real) -> Real:
        f = self._formats
        products = gain_m_step2_rad * subgradient
        gradient: Real = (products[:, 0] + products[:, 1]) >> (f.gain + f.response - f.distance_gradient)
        return gradient

    def tracking_cost(self, weight: Real, distance_m: Real) -> Real:
        return weight * distance_m

    def effort_cost(self, weight: Real, variation_rad: Real) -> Real:
        f = self._formats
        return rounded(weight * variation_rad, f.effort + f.angle - f.cost)

    def tracking_gradient(self, weight: Real, distance_gradient_m_rad: Real) -> Real:
        return weight * distance_gradient_m_rad

    def effort_gradient(self, weight: Real) -> Real:
        return weight * 2 ** (self._formats.gradient - self._formats.effort)

    def step_product(self, step_rad: Real, factor: Any) -> Real:
        return (step_rad * factor) >> self._formats.factor

    def target_product(self, factor: Any, value: Real) -> Real:
        f = self._formats
        return rounded(factor * value, f.tracker + self._target_bits - f.acceleration)

    def tracker_product(self, gain: Any, acceleration_m_step2: Real) -> Real:
        return rounded(gain * acceleration_m_step2, SINE_BITS)

    def feedback_product(self, steps: Any, change_rad: Real) -> Real:
        return rounded(steps * change_rad, self._formats.feedback)


def arithmetic(constants: OneNormConstants) -> OneNormArithmetic:
    """Return the products of a controller."""
    formats = constants.numbers.formats
    return (
        OneNormFixedArithmetic(constants, formats)
        if isinstance(formats, OneNormFormats)
        else OneNormFloatArithmetic(constants)
    )
