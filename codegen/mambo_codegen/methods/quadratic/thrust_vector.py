"""Thrust vector: from roll and pitch to the direction of the thrust, and back."""

from typing import Any

import numpy as np

from mambo_codegen.methods.quadratic.arithmetic import QuadraticArithmetic
from mambo_codegen.methods.quadratic.attitude_constants import AttitudeConstants
from mambo_codegen.methods.quadratic.reciprocal import Reciprocal
from mambo_codegen.methods.quadratic.thrust_vector_constants import LEAST_SHARE, ThrustVectorConstants
from mambo_codegen.methods.shared.math import Real, confine


class ThrustVector:
    """The constants of the thrust vector, in the scalar type of the controller.

    A slope is the horizontal component of a thrust over its vertical one: (n, 2), right and forward.
    """

    def __init__(
        self, constants: ThrustVectorConstants, attitude: AttitudeConstants, products: QuadraticArithmetic
    ) -> None:
        constant = products.numbers.constant
        self._products = products
        self._one, self._least = constant(1.0, "sine"), constant(LEAST_SHARE, "sine")
        self._whole = constant(1.0, "factor")
        self._share_inverse = inverse_line(constants.share_inverse, products)
        self._steep_inverse = inverse_line(constants.steep_inverse, products)
        self._terms = constants.arc_tangent
        self._quarter_turn = constant(np.pi / 2, "sine")
        self._gains = np.array([constant(gain, "factor") for gain in constants.loop_gains])
        self._per_gain = np.array([constant(gain, "factor") for gain in constants.per_loop_gain])
        self._per_acceleration = constant(constants.slope_step2_m, "command")
        self._trim = np.array([constant(trim, "angle") for trim in attitude.trim_rad])
        self._trim_command = np.array([constant(trim, "angle") for trim in attitude.trim_command_rad])

    def of_measured(self, tilt_rad: Real) -> tuple[Real, Real]:
        """Return the vertical share (n,) of the thrust and the slopes at measured roll and pitch (n, 2)."""
        return self._of(tilt_rad - self._trim)

    def of_command(self, command_rad: Real) -> tuple[Real, Real]:
        """Return the same for the attitude that commands (n, 2) lead to."""
        return self._of(self._products.angle_product(self._gains, command_rad - self._trim_command))

    def command_rad(self, command: Real) -> Real:
        """Return roll and pitch commands (n, 2) for accelerations (n, 2) over their weights."""
        products = self._products
        slope = products.slope_product(self._per_acceleration, command)
        pitch = -self.arc_tangent(slope[:, 1])
        _, cosine = products.sine_cosine(products.angle_to_yaw(pitch))
        roll = self.arc_tangent(products.sine_product(slope[:, 0], cosine))
        found = products.angle_product(self._per_gain, np.stack([roll, pitch], axis=1))
        return np.where(self._trim_command == 0, found, found + self._trim_command)

    def arc_tangent(self, slope: Real) -> Real:
        """Return the arc tangent of slopes (n,), rad."""
        products, size = self._products, np.where(slope < 0, -slope, slope)
        steep = size > self._whole
        small = np.where(steep, inverse(products, self._steep_inverse, np.maximum(size, self._whole)), size)
        x = products.factor_to_sine(small)
        square = products.sine_product(x, x)
        value = np.full_like(square, self._terms[-1])
        for term in reversed(self._terms[:-1]):
            value = term + products.sine_product(square, value)
        angle = products.sine_product(x, value)
        angle = np.where(steep, self._quarter_turn - angle, angle)
        return products.sine_to_angle(np.where(slope < 0, -angle, angle))

    def largest(self, tilt_rad: Real) -> Real:
        """Return the slopes (n, 2), right and forward, of the largest roll and pitch (n, 2), either way."""
        tilt = self._products.angle_product(self._gains, tilt_rad)
        level = np.zeros_like(tilt[:, 0])
        _, right = self._of(np.stack([tilt[:, 0], level], axis=1))
        _, forward = self._of(np.stack([level, -tilt[:, 1]], axis=1))
        return np.stack([right[:, 0], forward[:, 1]], axis=1)

    def _of(self, tilt_rad: Real) -> tuple[Real, Real]:
        products = self._products
        sine, cosine = products.sine_cosine(products.angle_to_yaw(tilt_rad))
        share = products.sine_product(cosine[:, 0], cosine[:, 1])
        factor = products.to_factor(confine(share, self._least, self._one))
        by_share = inverse(products, self._share_inverse, factor)
        forward = products.sine_product(sine[:, 1], cosine[:, 0])
        right = products.sine_product(by_share, sine[:, 0])
        return factor, np.stack([right, -products.sine_product(by_share, forward)], axis=1)


def inverse_line(found: Reciprocal, products: QuadraticArithmetic) -> tuple[Any, ...]:
    """Return the constants of a `Reciprocal` as numbers, for `inverse`."""
    constant = products.numbers.constant
    values = (found.start, found.slope, found.two, 2.0)
    return (*(constant(value, "factor") for value in values), found.steps)


def inverse(products: QuadraticArithmetic, line: tuple[Any, ...], value: Any) -> Real:
    """Return 1/value from products, by the line of a `Reciprocal`."""
    product, (start, slope, two_last, two, steps) = products.factor_product, line
    found: Real = start - product(slope, value)
    for step in range(steps):
        found = product(found, (two_last if step == steps - 1 else two) - product(found, value))
    return found
