"""Products of a controller with a quadratic cost, by the names that its templates have for them.

In floating point a product is one multiplication, which the C writes as `a * b`. In fixed point it is a
multiplication to 64 bits and a shift to the format of the result, rounded to nearest, ties up.
"""

from typing import Any, Protocol

from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.reference.math import Real, sine_cosine
from mambo_nmpc.codegen.representation import Representation
from mambo_nmpc.codegen.trigonometry import Trigonometry


class ExactArithmetic(Protocol):
    """The products of a control step and the representation of their numbers."""

    numbers: Representation

    def sine_cosine(self, yaw_rad: Real) -> tuple[Real, Real]:
        """Return sine and cosine of a heading."""

    def sine_product(self, value: Real, sine: Real) -> Real:
        """Return value * sine, in the format of the value."""

    def change_product(self, factor_s: Any, change_m_s: Real) -> Real:
        """Return factor * change of a velocity, m/step^2."""

    def tracker_product(self, gain: Any, acceleration_m_step2: Real) -> Real:
        """Return gain * acceleration, m/step^2."""

    def estimated_position(self, position_m: Real) -> Real:
        """Return a measured position in the format of estimates."""

    def position_error(self, estimate_m: Real, position_m: Real) -> Real:
        """Return an estimated position less a target's."""

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

    def ratio_product(self, ratio: Any, acceleration_m_step2: Real) -> Real:
        """Return ratio * acceleration."""


class FloatExactArithmetic:
    """Products in float32 or float64."""

    def __init__(self, design: Design) -> None:
        self.numbers = design.numbers
        self._trigonometry: Trigonometry = design.trigonometry
        self._update_period_s = self.numbers.scalar(design.settings.horizon.update_period_s)
        self._half = self.numbers.scalar(0.5)

    def sine_cosine(self, yaw_rad: Real) -> tuple[Real, Real]:
        return sine_cosine(yaw_rad, self._trigonometry)

    def estimated_position(self, position_m: Real) -> Real:
        return position_m

    def position_error(self, estimate_m: Real, position_m: Real) -> Real:
        return estimate_m - position_m

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

    def _product(self, a: Any, b: Real) -> Real:
        return a * b

    def _correction(self, gain: Any, by_m: Real, other_gain: Any, by_m_step: Real) -> Real:
        return (gain * by_m) + (other_gain * by_m_step)

    sine_product = change_product = tracker_product = drag_product = aged_position = aged_velocity = _product
    tilt_product = command_product = feedback_product = ratio_product = _product
    position_correction = velocity_correction = disturbance_correction = _correction


def exact_arithmetic(design: Design) -> ExactArithmetic:
    """Return the products of a controller with a quadratic cost."""
    return FloatExactArithmetic(design)
