"""Products of a controller with a quadratic cost, by the names that its templates have for them.

In floating point a product is one multiplication, which the C writes as `a * b`. In fixed point it is a
multiplication to 64 bits and a shift to the format of the result, rounded to nearest, ties up.
"""

from typing import Any, Protocol

import numpy as np

from mambo_codegen.methods.quadratic.constants import QuadraticConstants
from mambo_codegen.methods.quadratic.formats import QuadraticFormats
from mambo_codegen.methods.quadratic.height_constants import STEEPEST_RAD
from mambo_codegen.methods.quadratic.height_formats import FACTOR_BITS, GAIN_CHANGE
from mambo_codegen.methods.shared.math import Real, clamp, fixed_sine_cosine, rounded, sine_cosine
from mambo_codegen.numbers.fixed_point import SINE_BITS
from mambo_codegen.numbers.representation import Representation
from mambo_codegen.numbers.trigonometry import FixedTrigonometry, Trigonometry


class QuadraticArithmetic(Protocol):
    """The products of a control step and the representation of their numbers."""

    numbers: Representation

    def sine_cosine(self, yaw_rad: Real) -> tuple[Real, Real]:
        """Return sine and cosine of a heading."""

    def sine_product(self, value: Real, sine: Real) -> Real:
        """Return value * sine, in the format of the value."""

    def sine_difference(self, a: Real, b: Real, c: Real, d: Real) -> Real:
        """Return a b - c d of sines and cosines."""

    def sine_sum(self, a: Real, b: Real, c: Real, d: Real) -> Real:
        """Return a b + c d of sines and cosines."""

    def target_product(self, factor: Any, value: Real) -> Real:
        """Return factor * change of a velocity, m/s, or given acceleration, m/s^2; in m/step^2."""

    def tracker_product(self, gain: Any, acceleration_m_step2: Real) -> Real:
        """Return gain * acceleration, m/step^2."""

    def speed_product(self, velocity_m_s: Real) -> Real:
        """Return T_s * velocity, m/step."""

    def drag_product(self, drag_1_step: Any, velocity_m_step: Real) -> Real:
        """Return drag * velocity, m/step^2."""

    def aged_position(self, age_steps: Any, velocity_m_step: Real) -> Real:
        """Return age * velocity, m."""

    def aged_velocity(self, age_steps: Any, acceleration_m_step2: Real) -> Real:
        """Return age * acceleration, m/step."""

    def position_correction(self, gain: Any, by_m: Real, other_gain: Any, by_m_step: Real) -> Real:
        """Return the correction of a position by both innovations, m."""

    def velocity_correction(self, gain: Any, by_m: Real, other_gain: Any, by_m_step: Real) -> Real:
        """Return the correction of a velocity, m/step."""

    def disturbance_correction(self, gain: Any, by_m: Real, other_gain: Any, by_m_step: Real) -> Real:
        """Return the correction of a disturbance, m/step^2."""

    def half_change(self, acceleration_m_step2: Real) -> Real:
        """Return acceleration / 2, m/step."""

    def position_change(self, velocity_m_step: Real) -> Real:
        """Return a velocity, m/step, as the change of a position, m."""

    def velocity_change(self, acceleration_m_step2: Real) -> Real:
        """Return an acceleration, m/step^2, as the change of a velocity, m/step."""

    def tilt_product(self, gain_m_step2_rad: Any, tilt_rad: Real) -> Real:
        """Return gain * tilt, m/step^2."""

    def command_product(self, rad_step2_m: Any, acceleration_m_step2: Real) -> Real:
        """Return the command that stands for an acceleration, rad."""

    def feedback_product(self, steps: Any, change_rad: Real) -> Real:
        """Return steps * change of an angle, rad."""

    def attitude_sum(self, products: Real) -> Real:
        """Return a sum of products of the attitude model as an acceleration."""

    def row_sum(self, products: Real) -> Real:
        """Return a sum of products of the optimizer's rows as a move, m/step^2."""

    def move_acceleration(self, move_m_step2: Real) -> Real:
        """Return a move in the format of accelerations."""

    def to_move(self, acceleration_m_step2: Real) -> Real:
        """Return an acceleration in the format of moves, rounded down."""

    def ratio_product(self, ratio: Any, move_m_step2: Real) -> Real:
        """Return ratio * move."""

    def gain_correction(self, gain: Any, by_m: Real, other_gain: Any, by_m_step: Real) -> Real:
        """Return the correction of the thrust gain by both innovations."""

    def reach_product(self, steps: Any, velocity_m_step: Real) -> Real:
        """Return steps * velocity, m."""

    def gravity_product(self, per_gravity: Any, acceleration_m_step2: Real) -> Real:
        """Return an acceleration in units of g."""

    def angle_square(self, angle_rad: Real) -> Real:
        """Return the square of an angle; in fixed point of at most STEEPEST_RAD."""

    def step2_product(self, s2: Any, thrust_m_s2: Real) -> Real:
        """Return T_s^2 * thrust over mass, m/step^2."""

    def thrust_product(self, per_s2: Any, thrust_m_step2: Real) -> Real:
        """Return thrust over mass / T_s^2, m/s^2."""

    def factor_product(self, value: Real, factor: Real) -> Real:
        """Return value * factor, in the format of the value."""

    def to_factor(self, cosine: Real) -> Real:
        """Return a cosine in the format of factors."""


class QuadraticFloatArithmetic:
    """Products in float32 or float64."""

    def __init__(self, constants: QuadraticConstants) -> None:
        self.numbers = constants.numbers
        self._trigonometry: Trigonometry = constants.trigonometry
        self._update_period_s = self.numbers.scalar(constants.settings.horizon.update_period_s)
        self._half = self.numbers.scalar(0.5)

    def sine_cosine(self, yaw_rad: Real) -> tuple[Real, Real]:
        return sine_cosine(yaw_rad, self._trigonometry)

    def speed_product(self, velocity_m_s: Real) -> Real:
        return self._update_period_s * velocity_m_s

    def half_change(self, acceleration_m_step2: Real) -> Real:
        return self._half * acceleration_m_step2

    def position_change(self, velocity_m_step: Real) -> Real:
        return velocity_m_step

    def velocity_change(self, acceleration_m_step2: Real) -> Real:
        return acceleration_m_step2

    def attitude_sum(self, products: Real) -> Real:
        return products

    def row_sum(self, products: Real) -> Real:
        return products

    def move_acceleration(self, move_m_step2: Real) -> Real:
        return move_m_step2

    def to_move(self, acceleration_m_step2: Real) -> Real:
        return acceleration_m_step2

    def sine_difference(self, a: Real, b: Real, c: Real, d: Real) -> Real:
        return (a * b) - (c * d)

    def sine_sum(self, a: Real, b: Real, c: Real, d: Real) -> Real:
        return (a * b) + (c * d)

    def angle_square(self, angle_rad: Real) -> Real:
        return angle_rad * angle_rad

    def to_factor(self, cosine: Real) -> Real:
        return cosine

    def _product(self, a: Any, b: Real) -> Real:
        return a * b

    def _correction(self, gain: Any, by_m: Real, other_gain: Any, by_m_step: Real) -> Real:
        return (gain * by_m) + (other_gain * by_m_step)

    sine_product = target_product = tracker_product = drag_product = aged_position = aged_velocity = _product
    tilt_product = command_product = feedback_product = ratio_product = _product
    gravity_product = factor_product = reach_product = step2_product = thrust_product = _product
    position_correction = velocity_correction = disturbance_correction = gain_correction = _correction


class QuadraticFixedArithmetic:
    """Products in fixed point."""

    def __init__(self, constants: QuadraticConstants, formats: QuadraticFormats) -> None:
        self.numbers = constants.numbers
        self._shifts = formats.shifts
        self._trigonometry: FixedTrigonometry = constants.trigonometry
        self._update_period_s = self.numbers.constant(constants.settings.horizon.update_period_s, "step")
        self._steepest = self.numbers.constant(STEEPEST_RAD, "angle")

    def sine_cosine(self, yaw_rad: Real) -> tuple[Real, Real]:
        return fixed_sine_cosine(yaw_rad, self._trigonometry)

    def sine_product(self, value: Real, sine: Real) -> Real:
        return rounded(value * sine, SINE_BITS)

    def sine_difference(self, a: Real, b: Real, c: Real, d: Real) -> Real:
        return np.clip(rounded((a * b) - (c * d), SINE_BITS), -(2**SINE_BITS), 2**SINE_BITS)

    def sine_sum(self, a: Real, b: Real, c: Real, d: Real) -> Real:
        return np.clip(rounded((a * b) + (c * d), SINE_BITS), -(2**SINE_BITS), 2**SINE_BITS)

    def target_product(self, factor: Any, value: Real) -> Real:
        return self._rounded(factor * value, "target_product")

    def tracker_product(self, gain: Any, acceleration_m_step2: Real) -> Real:
        return self._rounded(gain * acceleration_m_step2, "tracker_product")

    def speed_product(self, velocity_m_s: Real) -> Real:
        return self._rounded(self._update_period_s * velocity_m_s, "speed_product")

    def drag_product(self, drag_1_step: Any, velocity_m_step: Real) -> Real:
        return self._rounded(drag_1_step * velocity_m_step, "drag_product")

    def aged_position(self, age_steps: Any, velocity_m_step: Real) -> Real:
        return self._rounded(age_steps * velocity_m_step, "aged_position")

    def aged_velocity(self, age_steps: Any, acceleration_m_step2: Real) -> Real:
        return self._rounded(age_steps * acceleration_m_step2, "aged_velocity")

    def position_correction(self, gain: Any, by_m: Real, other_gain: Any, by_m_step: Real) -> Real:
        return self._rounded((gain * by_m) + (other_gain * by_m_step), "position_correction")

    def velocity_correction(self, gain: Any, by_m: Real, other_gain: Any, by_m_step: Real) -> Real:
        return self._rounded((gain * by_m) + (other_gain * by_m_step), "velocity_correction")

    def disturbance_correction(self, gain: Any, by_m: Real, other_gain: Any, by_m_step: Real) -> Real:
        return self._rounded((gain * by_m) + (other_gain * by_m_step), "disturbance_correction")

    def half_change(self, acceleration_m_step2: Real) -> Real:
        return self._rounded(acceleration_m_step2, "half_change")

    def position_change(self, velocity_m_step: Real) -> Real:
        return self._rounded(velocity_m_step, "position_change")

    def velocity_change(self, acceleration_m_step2: Real) -> Real:
        return self._rounded(acceleration_m_step2, "velocity_change")

    def tilt_product(self, gain_m_step2_rad: Any, tilt_rad: Real) -> Real:
        return self._rounded(gain_m_step2_rad * tilt_rad, "tilt_product")

    def command_product(self, rad_step2_m: Any, acceleration_m_step2: Real) -> Real:
        return self._rounded(rad_step2_m * acceleration_m_step2, "command_product")

    def feedback_product(self, steps: Any, change_rad: Real) -> Real:
        return self._rounded(steps * change_rad, "feedback_product")

    def attitude_sum(self, products: Real) -> Real:
        return self._rounded(products, "attitude")

    def row_sum(self, products: Real) -> Real:
        return self._rounded(products, "row")

    def move_acceleration(self, move_m_step2: Real) -> Real:
        return move_m_step2 * 2 ** self._shifts["move"]

    def to_move(self, acceleration_m_step2: Real) -> Real:
        return acceleration_m_step2 >> self._shifts["move"]

    def ratio_product(self, ratio: Any, move_m_step2: Real) -> Real:
        return self._rounded(ratio * move_m_step2, "ratio_product")

    def gain_correction(self, gain: Any, by_m: Real, other_gain: Any, by_m_step: Real) -> Real:
        change = self._rounded((gain * by_m) + (other_gain * by_m_step), "gain_correction")
        most = round(GAIN_CHANGE * 2**FACTOR_BITS)
        return np.clip(change, -most, most)

    def reach_product(self, steps: Any, velocity_m_step: Real) -> Real:
        return self._rounded(steps * velocity_m_step, "reach_product")

    def gravity_product(self, per_gravity: Any, acceleration_m_step2: Real) -> Real:
        return self._rounded(per_gravity * acceleration_m_step2, "gravity_product")

    def angle_square(self, angle_rad: Real) -> Real:
        limited = clamp(angle_rad, self._steepest)
        return self._rounded(limited * limited, "angle_square")

    def step2_product(self, s2: Any, thrust_m_s2: Real) -> Real:
        return self._rounded(s2 * thrust_m_s2, "step2_product")

    def thrust_product(self, per_s2: Any, thrust_m_step2: Real) -> Real:
        return self._rounded(per_s2 * thrust_m_step2, "thrust_product")

    def factor_product(self, value: Real, factor: Real) -> Real:
        return rounded(value * factor, FACTOR_BITS)

    def to_factor(self, cosine: Real) -> Real:
        return rounded(cosine, SINE_BITS - FACTOR_BITS)

    def _rounded(self, product: Real, name: str) -> Real:
        return rounded(product, self._shifts[name])


def arithmetic(constants: QuadraticConstants) -> QuadraticArithmetic:
    """Return the products of a controller with a quadratic cost."""
    formats = constants.numbers.formats
    if isinstance(formats, QuadraticFormats):
        return QuadraticFixedArithmetic(constants, formats)
    return QuadraticFloatArithmetic(constants)
