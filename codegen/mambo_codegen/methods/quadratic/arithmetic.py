"""Products of a controller with a quadratic cost, by the names that its templates have for them."""

from typing import Any, Final

from mambo_codegen.methods.quadratic.constants import QuadraticConstants
from mambo_codegen.methods.quadratic.formats import QuadraticFormats
from mambo_codegen.methods.quadratic.height_constants import STEEPEST_RAD
from mambo_codegen.methods.quadratic.height_formats import GAIN_CHANGE
from mambo_codegen.methods.quadratic.thrust_vector_constants import MOST_SLOPE
from mambo_codegen.methods.shared.arithmetic import Arithmetic
from mambo_codegen.methods.shared.math import Real, clamp
from mambo_codegen.numbers.fixed_point import FACTOR_BITS, SINE_BITS

_ONE: Final = 2**SINE_BITS
_MOST_GAIN_CHANGE: Final = round(GAIN_CHANGE * 2**FACTOR_BITS)


class QuadraticArithmetic(Arithmetic):
    """The products of a control step and the representation of their numbers."""

    def __init__(self, constants: QuadraticConstants) -> None:
        formats = constants.numbers.formats
        super().__init__(constants, formats.shifts if isinstance(formats, QuadraticFormats) else None)
        constant, period_s = self.numbers.constant, constants.settings.horizon.update_period_s
        self._update_period_s, self._steepest = constant(period_s, "step"), constant(STEEPEST_RAD, "angle")
        self._most_slope = constant(MOST_SLOPE, "factor")
        self._steps_per_s = constant(constants.observer.steps_per_s, "per_step")
        self._steps2_per_s2 = constant(constants.observer.steps2_per_s2, "per_step2")

    def sine_difference(self, a: Real, b: Real, c: Real, d: Real) -> Real:
        """Return a b - c d of sines and cosines."""
        return self._within(self.nearest((a * b) - (c * d), "sine"), _ONE)

    def sine_sum(self, a: Real, b: Real, c: Real, d: Real) -> Real:
        """Return a b + c d of sines and cosines."""
        return self._within(self.nearest((a * b) + (c * d), "sine"), _ONE)

    def speed_product(self, velocity_m_s: Real) -> Real:
        """Return T_s * velocity, m/step."""
        return self.nearest(self._update_period_s * velocity_m_s, "speed_product")

    def per_step_product(self, velocity_m_step: Real) -> Real:
        """Return velocity / T_s, m/s."""
        return self.nearest(self._steps_per_s * velocity_m_step, "per_step_product")

    def per_step2_product(self, acceleration_m_step2: Real) -> Real:
        """Return acceleration / T_s^2, m/s^2."""
        return self.nearest(self._steps2_per_s2 * acceleration_m_step2, "per_step2_product")

    def drag_product(self, drag_1_step: Any, velocity_m_step: Real) -> Real:
        """Return drag * velocity, m/step^2."""
        return self.nearest(drag_1_step * velocity_m_step, "drag_product")

    def aged_position(self, age_steps: Any, velocity_m_step: Real) -> Real:
        """Return age * velocity, m."""
        return self.nearest(age_steps * velocity_m_step, "aged_position")

    def aged_velocity(self, age_steps: Any, acceleration_m_step2: Real) -> Real:
        """Return age * acceleration, m/step."""
        return self.nearest(age_steps * acceleration_m_step2, "aged_velocity")

    def position_correction(self, gain: Any, by_m: Real, other_gain: Any, by_m_step: Real) -> Real:
        """Return the correction of a position by both innovations, m."""
        return self.nearest((gain * by_m) + (other_gain * by_m_step), "position_correction")

    def velocity_correction(self, gain: Any, by_m: Real, other_gain: Any, by_m_step: Real) -> Real:
        """Return the correction of a velocity, m/step."""
        return self.nearest((gain * by_m) + (other_gain * by_m_step), "velocity_correction")

    def disturbance_correction(self, gain: Any, by_m: Real, other_gain: Any, by_m_step: Real) -> Real:
        """Return the correction of a disturbance, m/step^2."""
        return self.nearest((gain * by_m) + (other_gain * by_m_step), "disturbance_correction")

    def half_change(self, acceleration_m_step2: Real) -> Real:
        """Return acceleration / 2, m/step."""
        return self.nearest(self._half * acceleration_m_step2, "half_change")

    def position_change(self, velocity_m_step: Real) -> Real:
        """Return a velocity, m/step, as the change of a position, m."""
        return self.nearest(velocity_m_step, "position_change")

    def velocity_change(self, acceleration_m_step2: Real) -> Real:
        """Return an acceleration, m/step^2, as the change of a velocity, m/step."""
        return self.nearest(acceleration_m_step2, "velocity_change")

    def tilt_product(self, gain_m_step2_rad: Any, tilt_rad: Real) -> Real:
        """Return gain * tilt, m/step^2."""
        return self.nearest(gain_m_step2_rad * tilt_rad, "tilt_product")

    def command_product(self, rad_step2_m: Any, acceleration_m_step2: Real) -> Real:
        """Return the command that stands for an acceleration, rad."""
        return self.nearest(rad_step2_m * acceleration_m_step2, "command_product")

    def attitude_sum(self, products: Real) -> Real:
        """Return a sum of products of the attitude model as an acceleration."""
        return self.nearest(products, "attitude")

    def row_sum(self, products: Real) -> Real:
        """Return a sum of products of the optimizer's rows as a move, m/step^2."""
        return self.nearest(products, "row")

    def move_acceleration(self, move_m_step2: Real) -> Real:
        """Return a move in the format of accelerations."""
        return self._up(move_m_step2, "move")

    def to_move(self, acceleration_m_step2: Real) -> Real:
        """Return an acceleration in the format of moves, rounded down."""
        return self._down(acceleration_m_step2, "move")

    def ratio_product(self, ratio: Any, move_m_step2: Real) -> Real:
        """Return ratio * move."""
        return self.nearest(ratio * move_m_step2, "ratio_product")

    def gain_correction(self, gain: Any, by_m: Real, other_gain: Any, by_m_step: Real) -> Real:
        """Return the correction of the thrust gain by both innovations."""
        change = self.nearest((gain * by_m) + (other_gain * by_m_step), "gain_correction")
        return self._within(change, _MOST_GAIN_CHANGE)

    def change_product(self, step_s: Any, acceleration_m_s2: Real) -> Real:
        """Return T_s * acceleration, m/s in a step."""
        return self.nearest(step_s * acceleration_m_s2, "change_product")

    def count_product(self, per_m_s: Any, velocity_m_s: Real) -> Real:
        """Return per_m_s * velocity, a number of set-points; in fixed point a whole one."""
        return self.nearest(per_m_s * velocity_m_s, "count_product")

    def reach_product(self, steps: Any, velocity_m_step: Real) -> Real:
        """Return steps * velocity, m."""
        return self.nearest(steps * velocity_m_step, "reach_product")

    def gravity_product(self, per_gravity: Any, acceleration_m_step2: Real) -> Real:
        """Return an acceleration in units of g."""
        return self.nearest(per_gravity * acceleration_m_step2, "gravity_product")

    def angle_square(self, angle_rad: Real) -> Real:
        """Return the square of an angle; in fixed point of at most STEEPEST_RAD."""
        limited = self._within(angle_rad, self._steepest)
        return self.nearest(limited * limited, "angle_square")

    def step2_product(self, s2: Any, thrust_m_s2: Real) -> Real:
        """Return T_s^2 * thrust over mass, m/step^2."""
        return self.nearest(s2 * thrust_m_s2, "step2_product")

    def thrust_product(self, per_s2: Any, thrust_m_step2: Real) -> Real:
        """Return thrust over mass / T_s^2, m/s^2."""
        return self.nearest(per_s2 * thrust_m_step2, "thrust_product")

    def slope_product(self, per_acceleration: Any, acceleration_m_step2: Real) -> Real:
        """Return per_acceleration * acceleration, a slope of at most MOST_SLOPE."""
        product = self.nearest(per_acceleration * acceleration_m_step2, "slope_product")
        return clamp(product, self._most_slope)

    def slope_acceleration(self, gain_m_step2: Any, slope: Real) -> Real:
        """Return gain * slope, m/step^2."""
        return self.nearest(gain_m_step2 * slope, "slope_acceleration")

    def angle_product(self, factor: Any, angle_rad: Real) -> Real:
        """Return factor * angle, rad."""
        return self.nearest(angle_rad * factor, "factor_product")

    def angle_to_yaw(self, angle_rad: Real) -> Real:
        """Return an angle in the format of headings."""
        return self.nearest(angle_rad, "angle_to_yaw")

    def sine_to_angle(self, angle_rad: Real) -> Real:
        """Return an angle in the format of sines as one of tilts."""
        return self.nearest(angle_rad, "sine_to_angle")

    def factor_to_sine(self, factor: Real) -> Real:
        """Return a factor of at most 1 in the format of sines."""
        return self._up(factor, "to_factor")

    def to_factor(self, cosine: Real) -> Real:
        """Return a cosine in the format of factors."""
        return self.nearest(cosine, "to_factor")
