"""Arithmetic of the limits: products and inverse square roots, in floating and in fixed point.

A step has no division and calls no function of the C library: an inverse square root is Newton's iteration,
products alone, from a start that a shift of the bits gives.
"""

from dataclasses import dataclass
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.shared.constants import Constants
from mambo_codegen.methods.shared.limits_constants import ROOT_BITS, SHARE_BITS, LimitsConstants
from mambo_codegen.methods.shared.math import Real, rounded, smaller
from mambo_codegen.numbers.representation import Representation

TERMS: Final[dict[Any, tuple[float, ...]]] = {
    np.float32: (1.50087896, 1.50000058),
    np.float64: (1.50087896, 1.50000058, 1.5),
}
"""What stands for 1.5 in each of Newton's iterations, which square the error; it is 0.035 at the start.

Newton's results are too small: a little more than 1.5 makes the error symmetric, and half as large.
"""

STARTS: Final[dict[Any, tuple[Any, int]]] = {
    np.float32: (np.uint32, 0x5F376908),
    np.float64: (np.uint64, 0x5FE6ED2102DCBFDA),
}
"""Type of the bits, and the number from which half of them is taken for the start."""

ROOT_ERROR: Final = {"float32": 8e-7, "float64": 7e-13, "fixed": 1.2e-6}
"""Largest relative error of an inverse square root."""

FIXED_ITERATIONS: Final = 2
FIXED_START: Final = (2867787557, 3527627035, 1759398805)
"""The parabola 2.6708 - (3.2854 - 1.6386 m) m, with SHARE_BITS: within 0.024 of 1/sqrt(m) for m in 1/4..1."""


TURN_BITS: Final = 4
"""A target's turn is a mean in which each step has the share 1/2^4."""


@dataclass(frozen=True)
class FixedRoot:
    """Inverse square roots in fixed point: mantissa / 2^(SHARE_BITS + half), the mantissa in 2^30..2^31.

    scaled: the argument in 2^30..2^32, less 2 half - 32 powers of two.
    """

    mantissa: NDArray[np.int64]
    half: NDArray[np.int64]
    scaled: NDArray[np.int64]


class LimitsArithmetic(Protocol):
    """The products of the limits; a root is what `inverse_root` returns."""

    numbers: Representation
    approach: Any
    """k, 1/s."""

    def half(self, value: Real) -> Real:
        """Return half of a number."""

    def square(self, value: Real) -> Real:
        """Return the square of a number."""

    def square_sum(self, values: Real) -> Real:
        """Return the sum of the squares (n,) of vectors (n, 2)."""

    def inverse_root(self, square: Real) -> Any:
        """Return the roots of positive squares."""

    def knee(self, braking: Real) -> Real:
        """Return the distance up to which the approach speed is linear, m, for twice the braking."""

    def near(self, braking: Real) -> Real:
        """Return the distance from the target at which braking ends, m."""

    def approach_speed(self, ratio: Any, distance_m: Real) -> Real:
        """Return ratio * distance, m/s, with a ratio in 1/s."""

    def braking_square(self, braking: Real, distance_m: Real) -> Real:
        """Return twice the braking times a distance, the square of a speed."""

    def braking_speed(self, square: Real) -> Real:
        """Return the root of such a square, m/s."""

    def length(self, square: Real, root: Any) -> Real:
        """Return the root of a sum of squares of distances, m, given its inverse; at most twice the range."""

    def ratio(self, speed_m_s: Real, root: Any) -> Real:
        """Return speed over distance, 1/s, at most k / NEAR_SHARE, given the inverse of the distance."""

    def share(self, speed_m_s: Real, root: Any) -> Real:
        """Return speed over speed, given the inverse of the second."""

    def share_product(self, velocity_m_s: Real, share: Real) -> Real:
        """Return velocity * share."""

    def least_braking(self, braking: Real, speed_m_s: Real) -> Real:
        """Return twice the braking, at most what the approach rate asks for at a speed."""

    def margin(self, braking: Real, speed_m_s: Real) -> Real:
        """Return the distance from which on a wall allows a speed, m, for twice the braking."""

    def rate_product(self, change_m_s: Real) -> Real:
        """Return the change of a velocity in an update period as an acceleration, m/s^2."""

    def tilt_product(self, slope: Any, tilt_rad: Real) -> Real:
        """Return slope * tilt, the acceleration of a tilt, m/s^2."""

    def mean_turn(self, turn_m2_s2: Real, before_m_s: Real, velocity_m_s: Real) -> Real:
        """Return a mean (n,) with the vector product of two velocities (n, 2) taken in."""

    def speed(self, square: Real) -> Real:
        """Return the root of a positive sum of squares of speeds, m/s."""

    def turn_product(self, turn: Any, tilt_rad: Real) -> Real:
        """Return turn * tilt, the change of velocity that a tilt gives in an update period, m/s."""

    def turn_most(self, change_m_s: Real, speed_m_s: Real) -> Real:
        """Return change * speed, m^2/s^2."""


class LimitsFloatArithmetic:
    """Products in float32 or float64."""

    def __init__(self, constants: Constants, limits: LimitsConstants) -> None:
        self.numbers = constants.numbers
        scalar = self._scalar = self.numbers.scalar
        self.approach = scalar(limits.approach_1_s)
        self._knee_s2, self._near_s2 = scalar(limits.knee_s2), scalar(limits.near_s2)
        self._twice_approach = scalar(2 * limits.approach_1_s)
        self._steps_per_s = scalar(limits.steps_per_s)

    def half(self, value: Real) -> Real:
        return self._scalar(0.5) * value

    def square(self, value: Real) -> Real:
        return value * value

    def square_sum(self, values: Real) -> Real:
        return (values[:, 0] * values[:, 0]) + (values[:, 1] * values[:, 1])

    def inverse_root(self, square: Real) -> Real:
        scalar, (bits, start) = self._scalar, STARTS[self._scalar]
        half = scalar(0.5) * square
        root: Real = (bits(start) - (square.view(bits) >> bits(1))).view(scalar)
        for term in TERMS[scalar]:
            root = root * (scalar(term) - ((half * root) * root))
        return root

    def knee(self, braking: Real) -> Real:
        return self._knee_s2 * braking

    def near(self, braking: Real) -> Real:
        return self._near_s2 * braking

    def approach_speed(self, ratio: Any, distance_m: Real) -> Real:
        return ratio * distance_m

    def braking_square(self, braking: Real, distance_m: Real) -> Real:
        return braking * distance_m

    def braking_speed(self, square: Real) -> Real:
        return square * self.inverse_root(square)

    def length(self, square: Real, root: Real) -> Real:
        return square * root

    def ratio(self, speed_m_s: Real, root: Real) -> Real:
        return speed_m_s * root

    def share(self, speed_m_s: Real, root: Real) -> Real:
        return speed_m_s * root

    def share_product(self, velocity_m_s: Real, share: Real) -> Real:
        return velocity_m_s * share

    def least_braking(self, braking: Real, speed_m_s: Real) -> Real:
        return smaller(braking, self._twice_approach * speed_m_s)

    def margin(self, braking: Real, speed_m_s: Real) -> Real:
        root = self.inverse_root(braking)
        stopping = (speed_m_s * root) * (speed_m_s * root)
        return stopping + self.half(self.knee(braking))

    def rate_product(self, change_m_s: Real) -> Real:
        return self._steps_per_s * change_m_s

    def tilt_product(self, slope: Any, tilt_rad: Real) -> Real:
        return slope * tilt_rad

    def mean_turn(self, turn_m2_s2: Real, before_m_s: Real, velocity_m_s: Real) -> Real:
        cross = (before_m_s[:, 0] * velocity_m_s[:, 1]) - (before_m_s[:, 1] * velocity_m_s[:, 0])
        gain = self._scalar(1 / 2**TURN_BITS)
        return ((self._scalar(1) - gain) * turn_m2_s2) + (gain * cross)

    def speed(self, square: Real) -> Real:
        return square * self.inverse_root(square)

    def turn_product(self, turn: Any, tilt_rad: Real) -> Real:
        return turn * tilt_rad

    def turn_most(self, change_m_s: Real, speed_m_s: Real) -> Real:
        return change_m_s * speed_m_s


class LimitsFixedArithmetic:
    """Products in fixed point: to 64 bits, shifted to the format of the result."""

    def __init__(self, constants: Constants, limits: LimitsConstants) -> None:
        numbers = self.numbers = constants.numbers
        bits = numbers.bits or {}
        self._position, self._velocity = bits["position"], bits["velocity"]
        self._braking, self._approach, self._knee = bits["braking"], bits["approach"], bits["knee"]
        self._thrust, self._angle = bits["thrust"], bits["angle"]
        self._slope, self._rate = bits["slope"], bits["rate"]
        self.approach = numbers.constant(limits.approach_1_s, "approach")
        self._steepest = numbers.constant(limits.steepest_1_s, "approach")
        self._knee_s2 = numbers.constant(limits.knee_s2, "knee")
        self._near_s2 = numbers.constant(limits.near_s2, "knee")
        self._fastest = numbers.constant(constants.settings.ranges.velocity_m_s, "velocity")
        self._farthest = 2 * numbers.constant(constants.settings.ranges.position_m, "position")
        self._steps_per_s = numbers.constant(limits.steps_per_s, "rate")
        square_bits = self._braking + self._position
        self._odd = square_bits % 2
        self._square_bits = square_bits + self._odd

    def half(self, value: Real) -> Real:
        return value >> 1

    def square(self, value: Real) -> Real:
        return value * value

    def square_sum(self, values: Real) -> Real:
        return (values[:, 0] * values[:, 0]) + (values[:, 1] * values[:, 1])

    def inverse_root(self, square: Real) -> FixedRoot:
        scaled, half = np.maximum(square, 1).astype(np.uint64), np.full(square.shape, 32)
        for bits, shifts in ((64, (32, 16, 8)), (32, (4, 2))):
            for shift in shifts:
                small = scaled < np.uint64(2 ** (bits - shift))
                scaled = np.where(small, scaled << np.uint64(shift), scaled)
                half = half - np.where(small, shift // 2, 0)
            scaled = scaled >> np.uint64(bits - 32)
        top = scaled.astype(np.int64)
        mantissa = FIXED_START[0] - _upper(FIXED_START[1] - _upper(FIXED_START[2], top), top)
        for _ in range(FIXED_ITERATIONS):
            product = _upper(_upper(mantissa, mantissa), top)
            mantissa = _upper(mantissa, (3 << 28) - product) << 3
        return FixedRoot(mantissa, half, top)

    def knee(self, braking: Real) -> Real:
        return self._distance(self._knee_s2, braking)

    def near(self, braking: Real) -> Real:
        return self._distance(self._near_s2, braking)

    def approach_speed(self, ratio: Any, distance_m: Real) -> Real:
        product = rounded(ratio * distance_m, self._approach + self._position - self._velocity)
        return np.clip(product, -self._fastest, self._fastest)

    def braking_square(self, braking: Real, distance_m: Real) -> Real:
        return (braking * distance_m) << self._odd

    def braking_speed(self, square: Real) -> Real:
        root = self._root(square)
        speed = _shifted(root, (self._square_bits // 2) - self._velocity)
        return np.minimum(speed, self._fastest)

    def length(self, square: Real, root: FixedRoot) -> Real:
        del square
        return np.minimum((root.scaled * root.mantissa) >> (62 - root.half), self._farthest)

    def ratio(self, speed_m_s: Real, root: FixedRoot) -> Real:
        shift = SHARE_BITS + root.half + (self._velocity - self._position - self._approach)
        return np.minimum((speed_m_s * root.mantissa) >> shift, self._steepest)

    def share(self, speed_m_s: Real, root: FixedRoot) -> Real:
        return np.minimum((speed_m_s * root.mantissa) >> root.half, 2**SHARE_BITS)

    def share_product(self, velocity_m_s: Real, share: Real) -> Real:
        return rounded(velocity_m_s * share, SHARE_BITS)

    def least_braking(self, braking: Real, speed_m_s: Real) -> Real:
        most = (self.approach * speed_m_s) >> (self._approach + self._velocity - self._braking - 1)
        return np.minimum(braking, most)

    def margin(self, braking: Real, speed_m_s: Real) -> Real:
        odd = self._braking % 2
        root = self.inverse_root(braking << odd)
        shift = self._velocity + SHARE_BITS + root.half - ((self._braking + odd) // 2) - ROOT_BITS
        quotient = (speed_m_s * root.mantissa) >> shift
        stopping = (quotient * quotient) >> ((2 * ROOT_BITS) - self._position)
        return np.minimum(stopping + self.half(self.knee(braking)), self._farthest)

    def _distance(self, knee_s2: Any, braking: Real) -> Real:
        return _shifted(knee_s2 * braking, self._knee + self._braking - self._position)

    def rate_product(self, change_m_s: Real) -> Real:
        return rounded(self._steps_per_s * change_m_s, self._rate + self._velocity - self._thrust)

    def tilt_product(self, slope: Any, tilt_rad: Real) -> Real:
        return rounded(slope * tilt_rad, self._slope + self._angle - self._braking)

    def mean_turn(self, turn_m2_s2: Real, before_m_s: Real, velocity_m_s: Real) -> Real:
        cross = (before_m_s[:, 0] * velocity_m_s[:, 1]) - (before_m_s[:, 1] * velocity_m_s[:, 0])
        rest = 2**TURN_BITS - 1
        return rounded((rest * turn_m2_s2) + rounded(cross, self._velocity), TURN_BITS)

    def speed(self, square: Real) -> Real:
        return np.minimum(self._root(square), 2 * self._fastest)

    def turn_product(self, turn: Any, tilt_rad: Real) -> Real:
        change = rounded(turn * tilt_rad, self._slope + self._angle - self._velocity)
        return np.minimum(change, 2 * self._fastest)

    def turn_most(self, change_m_s: Real, speed_m_s: Real) -> Real:
        return (change_m_s * speed_m_s) >> self._velocity

    def _root(self, square: Real) -> Real:
        root = self.inverse_root(square)
        return (root.scaled * root.mantissa) >> (62 - root.half)


def limits_arithmetic(constants: Constants, limits: LimitsConstants) -> LimitsArithmetic:
    """Return the products of the limits of a controller."""
    if constants.numbers.formats is None:
        return LimitsFloatArithmetic(constants, limits)
    return LimitsFixedArithmetic(constants, limits)


def _upper(a: Any, b: Any) -> Any:
    """Return the upper one of the two words of 32 bits of a product, whose factors have one each."""
    product = np.asarray(a, np.uint64) * np.asarray(b, np.uint64)
    return (product >> np.uint64(32)).astype(np.int64)


def _shifted(value: Real, bits: int) -> Real:
    """Shift right by `bits`, rounded down, or left by as many as are negative."""
    return value >> bits if bits >= 0 else value << -bits
