"""Products of a controller with the 1-norm, by the names that its templates have for them.

In fixed point the products of a roll-out, of the gradient of the distance and of a step of RPROP are rounded
down.
"""

from typing import Any

from mambo_codegen.methods.one_norm.constants import OneNormConstants
from mambo_codegen.methods.one_norm.formats import OneNormFormats
from mambo_codegen.methods.shared.arithmetic import Arithmetic
from mambo_codegen.methods.shared.math import Real


class OneNormArithmetic(Arithmetic):
    """The products of a control step and the representation of their numbers."""

    def __init__(self, constants: OneNormConstants) -> None:
        formats = constants.numbers.formats
        assert formats is None or isinstance(formats, OneNormFormats)
        super().__init__(constants, _shifts(formats) if formats else None)
        constant = self.numbers.constant
        self._step_s = constant(constants.settings.horizon.prediction_step_s, "step")
        self._step_squared_s2 = constant(constants.tables.step_squared_s2, "step_squared")
        self._error_limit = formats and formats.error_limit
        self._half_error = 2 ** (formats.acceleration - formats.error - 1) if formats else None

    def thrust_product(self, thrust_m_s2: Real) -> Real:
        """Return thrust acceleration * tau^2, m/step^2."""
        return self.nearest(thrust_m_s2 * self._step_squared_s2, "thrust_product")

    def velocity_product(self, velocity_m_s: Real) -> Real:
        """Return tau * velocity, m/step; in fixed point half an error more, so that `error_change` rounds."""
        product = self.nearest(self._step_s * velocity_m_s, "velocity_product")
        return product if self._half_error is None else product + self._half_error

    def gain_product(self, gain_m_step2_rad: Real, tilt_rad: Real) -> Real:
        """Return gain * tilt, m/step^2."""
        return self._down(gain_m_step2_rad * tilt_rad, "gain_product")

    def acceleration_product(self, share: Any, acceleration_m_step2: Real) -> Real:
        """Return share * acceleration."""
        return self._down(share * acceleration_m_step2, "acceleration_product")

    def initial_error(self, difference_m: Real) -> Real:
        """Return a difference of positions as a predicted error, clamped in fixed point."""
        return self._up(self._within(difference_m, self._error_limit), "initial_error")

    def error_change(self, displacement_m_step: Real) -> Real:
        """Return a displacement in the format of errors."""
        return self._down(displacement_m_step, "error_change")

    def distance_gradient(self, gain_m_step2_rad: Real, subgradient: Real) -> Real:
        """Return the gradient of the distance by the moves (n, moves, 2).

        Gains are (n, 2, 1, 2), subgradients by acceleration (n, 2, moves, 2).
        """
        products = gain_m_step2_rad * subgradient
        return self._down(products[:, 0] + products[:, 1], "distance_gradient")

    def tracking_cost(self, weight: Real, distance_m: Real) -> Real:
        """Return lambda_1 * distance."""
        return weight * distance_m

    def effort_cost(self, weight: Real, variation_rad: Real) -> Real:
        """Return lambda_2 * variation."""
        return self.nearest(weight * variation_rad, "effort_cost")

    def tracking_gradient(self, weight: Real, distance_gradient_m_rad: Real) -> Real:
        """Return lambda_1 * gradient of the distance."""
        return weight * distance_gradient_m_rad

    def effort_gradient(self, weight: Real) -> Real:
        """Return lambda_2 in the format of gradients."""
        return self._up(weight, "effort_gradient")

    def step_product(self, step_rad: Real, factor: Any) -> Real:
        """Return step size * eta."""
        return self._down(step_rad * factor, "step_product")


def _shifts(bits: OneNormFormats) -> dict[str, int]:
    """Return the shifts of the products in fixed point: the bits of both factors less the result's."""
    return {
        "thrust_product": bits.thrust + bits.step_squared - bits.gain,
        "velocity_product": bits.step + bits.velocity - bits.acceleration,
        "gain_product": bits.gain + bits.angle - bits.acceleration,
        "acceleration_product": bits.share,
        "initial_error": bits.error - bits.position,
        "error_change": bits.acceleration - bits.error,
        "distance_gradient": bits.gain + bits.response - bits.distance_gradient,
        "effort_cost": bits.effort + bits.angle - bits.cost,
        "effort_gradient": bits.gradient - bits.effort,
        "step_product": bits.factor,
        "target_product": bits.tracker + bits.velocity - bits.acceleration,
        "feedback_product": bits.feedback,
    }
