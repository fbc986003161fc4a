"""Products and constants of the controller, by what they mean: `nmpc_math.h` has the same, by the same names.

In floating point a product is one multiplication. In fixed point it is one multiplication to 64 bits and one
shift to the format of the result, rounded to nearest, ties up; the products of a walk, of a slope of the
distance and of a step of the optimizer are rounded down. Sums, differences and comparisons are plain in
both. The arrays of a fixed point reference are int64, and none of their numbers needs more.
"""

from typing import Any, Protocol

import numpy as np

from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.fixed_point import SINE_BITS, Formats
from mambo_nmpc.codegen.reference.math import Real, fixed_sine_cosine, rounded, sine_cosine
from mambo_nmpc.codegen.representation import Representation
from mambo_nmpc.codegen.trigonometry import FixedTrigonometry, Trigonometry


class Arithmetic(Protocol):
    """The products of a control step, and the numbers that they are of."""

    numbers: Representation

    def sine_cosine(self, yaw_rad: Real) -> tuple[Real, Real]:
        """Return sine and cosine of a heading."""

    def push(self, thrust_acceleration_m_s2: Real) -> Real:
        """Return the bend of a unit of tilt, sideways."""

    def component(self, push_m: Real, sine: Real) -> Real:
        """Return what of a push falls to an axis."""

    def travel(self, velocity_m_s: Real) -> Real:
        """Return the advance of a velocity."""

    def bend(self, gain_m: Real, turn_rad: Real) -> Real:
        """Return the bend of a turn."""

    def part(self, share: Any, bend_m: Real) -> Real:
        """Return a share of a bend."""

    def first_error(self, difference_m: Real) -> Real:
        """Return the start of an error."""

    def step_of(self, advance_m: Real) -> Real:
        """Return what an advance adds to an error."""

    def distance_slope(self, gain_m: Real, slopes: Real) -> Real:
        """Return the slope of the distance (n, moves, 2); gains (n, 2, 1, 2), responses (n, 2, moves, 2)."""

    def tracking_cost(self, weight: Real, distance_m: Real) -> Real:
        """Return the cost of a distance."""

    def effort_cost(self, weight: Real, variation_rad: Real) -> Real:
        """Return the cost of a variation."""

    def tracking_slope(self, weight: Real, slope_m: Real) -> Real:
        """Return the slope of the cost of a distance."""

    def effort_slope(self, weight: Real) -> Real:
        """Return the slope of the cost of a variation."""

    def scaled(self, step_rad: Real, factor: Any) -> Real:
        """Return a step grown or shrunk."""


class FloatArithmetic:
    """Products in float32 or float64."""

    def __init__(self, design: Design) -> None:
        self.numbers = design.numbers
        self._trigonometry: Trigonometry = design.trigonometry
        self._step_s = self.numbers.scalar(design.settings.horizon.prediction_step_s)
        self._step_squared_s2 = self.numbers.scalar(design.tables.step_squared_s2)

    def sine_cosine(self, yaw_rad: Real) -> tuple[Real, Real]:
        return sine_cosine(yaw_rad, self._trigonometry)

    def push(self, thrust_acceleration_m_s2: Real) -> Real:
        return thrust_acceleration_m_s2 * self._step_squared_s2

    def component(self, push_m: Real, sine: Real) -> Real:
        return push_m * sine

    def travel(self, velocity_m_s: Real) -> Real:
        return self._step_s * velocity_m_s

    def bend(self, gain_m: Real, turn_rad: Real) -> Real:
        return gain_m * turn_rad

    def part(self, share: Any, bend_m: Real) -> Real:
        return share * bend_m

    def first_error(self, difference_m: Real) -> Real:
        return difference_m

    def step_of(self, advance_m: Real) -> Real:
        return advance_m

    def distance_slope(self, gain_m: Real, slopes: Real) -> Real:
        shares = gain_m * slopes
        return shares[:, 0] + shares[:, 1]

    def tracking_cost(self, weight: Real, distance_m: Real) -> Real:
        return weight * distance_m

    def effort_cost(self, weight: Real, variation_rad: Real) -> Real:
        return weight * variation_rad

    def tracking_slope(self, weight: Real, slope_m: Real) -> Real:
        return weight * slope_m

    def effort_slope(self, weight: Real) -> Real:
        return weight

    def scaled(self, step_rad: Real, factor: Any) -> Real:
        return step_rad * factor


class FixedArithmetic:
    """Products in fixed point."""

    def __init__(self, design: Design, formats: Formats) -> None:
        self.numbers = design.numbers
        self._formats = formats
        self._trigonometry: FixedTrigonometry = design.trigonometry
        self._step_s = self.numbers.constant(design.settings.horizon.prediction_step_s, "step")
        self._step_squared_s2 = self.numbers.constant(design.tables.step_squared_s2, "step_squared")

    def sine_cosine(self, yaw_rad: Real) -> tuple[Real, Real]:
        return fixed_sine_cosine(yaw_rad, self._trigonometry)

    def push(self, thrust_acceleration_m_s2: Real) -> Real:
        f = self._formats
        return rounded(thrust_acceleration_m_s2 * self._step_squared_s2, f.thrust + f.step_squared - f.gain)

    def component(self, push_m: Real, sine: Real) -> Real:
        return rounded(push_m * sine, SINE_BITS)

    def travel(self, velocity_m_s: Real) -> Real:
        f = self._formats
        half = 2 ** (f.bend - f.error - 1)
        return rounded(self._step_s * velocity_m_s, f.step + f.velocity - f.bend) + half

    def bend(self, gain_m: Real, turn_rad: Real) -> Real:
        f = self._formats
        return (gain_m * turn_rad) >> (f.gain + f.angle - f.bend)

    def part(self, share: Any, bend_m: Real) -> Real:
        return (share * bend_m) >> self._formats.share

    def first_error(self, difference_m: Real) -> Real:
        f = self._formats
        return np.clip(difference_m, -f.error_limit, f.error_limit) * 2 ** (f.error - f.position)

    def step_of(self, advance_m: Real) -> Real:
        return advance_m >> (self._formats.bend - self._formats.error)

    def distance_slope(self, gain_m: Real, slopes: Real) -> Real:
        f = self._formats
        shares = gain_m * slopes
        slope: Real = (shares[:, 0] + shares[:, 1]) >> (f.gain + f.response - f.slope)
        return slope

    def tracking_cost(self, weight: Real, distance_m: Real) -> Real:
        return weight * distance_m

    def effort_cost(self, weight: Real, variation_rad: Real) -> Real:
        f = self._formats
        return rounded(weight * variation_rad, f.effort + f.angle - f.cost)

    def tracking_slope(self, weight: Real, slope_m: Real) -> Real:
        return weight * slope_m

    def effort_slope(self, weight: Real) -> Real:
        return weight * 2 ** (self._formats.gradient - self._formats.effort)

    def scaled(self, step_rad: Real, factor: Any) -> Real:
        return (step_rad * factor) >> self._formats.factor


def arithmetic(design: Design) -> Arithmetic:
    """Return the products of a controller."""
    formats = design.numbers.formats
    return FloatArithmetic(design) if formats is None else FixedArithmetic(design, formats)
