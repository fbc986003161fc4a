"""Arithmetic of the limits: products and inverse square roots, in floating and in fixed point.

A step has no division and calls no function of the C library: an inverse square root is Newton's iteration,
products alone, from a start that a shift of the bits gives.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.shared.arithmetic import Products
from mambo_codegen.methods.shared.constants import Constants
from mambo_codegen.methods.shared.limits_constants import ROOT_BITS, SHARE_BITS, LimitsConstants
from mambo_codegen.methods.shared.math import Real, smaller

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


def limits_shifts(bits: Mapping[str, int]) -> dict[str, int]:
    """Return the right shifts of the products of the limits in fixed point, by their names in the templates.

    odd and braking_odd: whether an argument of a root needs one more bit, so that their number is even.
    """
    position, velocity, braking = bits["position"], bits["velocity"], bits["braking"]
    square = braking + position
    odd, braking_odd = square % 2, braking % 2
    return {
        "approach": bits["approach"] + position - velocity,
        "ratio": SHARE_BITS + velocity - position - bits["approach"],
        "knee": bits["knee"] + braking - position,
        "odd": odd,
        "speed": ((square + odd) // 2) - velocity,
        "least": bits["approach"] + velocity - braking - 1,
        "braking_odd": braking_odd,
        "quotient": velocity + SHARE_BITS - ((braking + braking_odd) // 2) - ROOT_BITS,
        "stopping": (2 * ROOT_BITS) - position,
        "tilt": bits["slope"] + bits["angle"] - braking,
        "turn": bits["slope"] + bits["angle"] - velocity,
        "mean_turn": TURN_BITS,
        "velocity": velocity,
        "share": SHARE_BITS,
        "half": 1,
    }


class LimitsArithmetic(Products):
    """The products of the limits; a root is what `inverse_root` returns."""

    def __init__(self, constants: Constants, limits: LimitsConstants) -> None:
        bits = constants.numbers.bits
        super().__init__(constants, bits and limits_shifts(bits))
        constant, ranges = self.numbers.constant, constants.settings.ranges
        self.approach = constant(limits.approach_1_s, "approach")
        """k, 1/s."""
        self._steepest = constant(limits.steepest_1_s, "approach")
        self._knee_s2, self._near_s2 = constant(limits.knee_s2, "knee"), constant(limits.near_s2, "knee")
        self._fastest = constant(ranges.velocity_m_s, "velocity")
        self._farthest = 2 * constant(ranges.position_m, "position")
        turns = 2**TURN_BITS
        if bits is None:
            factors = 2 * limits.approach_1_s, 1 / turns, 1 - 1 / turns
            self._twice_approach, self._turn_gain, self._turn_rest = map(self.numbers.scalar, factors)
        else:  # the shifts double and divide
            self._twice_approach, self._turn_gain, self._turn_rest = self.approach, 1, turns - 1

    def half(self, value: Real) -> Real:
        """Return half of a number."""
        return self._down(self._half * value, "half")

    def square(self, value: Real) -> Real:
        """Return the square of a number."""
        return value * value

    def square_sum(self, values: Real) -> Real:
        """Return the sum of the squares (n,) of vectors (n, 2)."""
        return (values[:, 0] * values[:, 0]) + (values[:, 1] * values[:, 1])

    def inverse_root(self, square: Real) -> Any:
        """Return the roots of positive squares: `FixedRoot` in fixed point, else numbers."""
        return _float_root(square) if self._shifts is None else _fixed_root(square)

    def knee(self, braking: Real) -> Real:
        """Return the distance up to which the approach speed is linear, m, for twice the braking."""
        return self._down(self._knee_s2 * braking, "knee")

    def near(self, braking: Real) -> Real:
        """Return the distance from the target at which braking ends, m."""
        return self._down(self._near_s2 * braking, "knee")

    def approach_speed(self, ratio: Any, distance_m: Real) -> Real:
        """Return ratio * distance, m/s, with a ratio in 1/s."""
        return self._within(self.nearest(ratio * distance_m, "approach"), self._fastest)

    def braking_square(self, braking: Real, distance_m: Real) -> Real:
        """Return twice the braking times a distance, the square of a speed."""
        return self._up(braking * distance_m, "odd")

    def braking_speed(self, square: Real) -> Real:
        """Return the root of such a square, m/s."""
        return self._at_most(
            self._down(self._root(square, self.inverse_root(square)), "speed"), self._fastest
        )

    def length(self, square: Real, root: Any) -> Real:
        """Return the root of a sum of squares of distances, m, given its inverse; at most twice the range."""
        return self._at_most(self._root(square, root), self._farthest)

    def ratio(self, speed_m_s: Real, root: Any) -> Real:
        """Return speed over distance, 1/s, at most k / NEAR_SHARE, given the inverse of the distance."""
        return self._at_most(self._down(self._root_product(speed_m_s, root), "ratio"), self._steepest)

    def share(self, part: Real, root: Any) -> Real:
        """Return a length over a length, in fixed point at most 1, given the inverse of the second."""
        return self._at_most(self._root_product(part, root), 2**SHARE_BITS)

    def share_product(self, value: Real, share: Real) -> Real:
        """Return value * share."""
        return self.nearest(value * share, "share")

    def least_braking(self, braking: Real, speed_m_s: Real) -> Real:
        """Return twice the braking, at most what the approach rate asks for at a speed."""
        return smaller(braking, self._down(self._twice_approach * speed_m_s, "least"))

    def margin(self, braking: Real, speed_m_s: Real) -> Real:
        """Return the distance from which on a wall allows a speed, m, for twice the braking."""
        root = self.inverse_root(self._up(braking, "braking_odd"))
        quotient = self._down(self._root_product(speed_m_s, root), "quotient")
        stopping = self._down(quotient * quotient, "stopping")
        return self._at_most(stopping + self.half(self.knee(braking)), self._farthest)

    def tilt_product(self, slope: Any, tilt_rad: Real) -> Real:
        """Return slope * tilt, the acceleration of a tilt, m/s^2."""
        return self.nearest(slope * tilt_rad, "tilt")

    def mean_turn(self, turn_m2_s2: Real, before_m_s: Real, velocity_m_s: Real) -> Real:
        """Return a mean (n,) with the vector product of two velocities (n, 2) taken in."""
        cross = (before_m_s[:, 0] * velocity_m_s[:, 1]) - (before_m_s[:, 1] * velocity_m_s[:, 0])
        mean = (self._turn_rest * turn_m2_s2) + (self._turn_gain * self.nearest(cross, "velocity"))
        return self.nearest(mean, "mean_turn")

    def speed(self, square: Real) -> Real:
        """Return the root of a positive sum of squares of speeds, m/s."""
        return self._at_most(self._root(square, self.inverse_root(square)), 2 * self._fastest)

    def turn_product(self, turn: Any, tilt_rad: Real) -> Real:
        """Return turn * tilt, the change of velocity that a tilt gives in an update period, m/s."""
        return self._at_most(self.nearest(turn * tilt_rad, "turn"), 2 * self._fastest)

    def turn_most(self, change_m_s: Real, speed_m_s: Real) -> Real:
        """Return change * speed, m^2/s^2."""
        return self._down(change_m_s * speed_m_s, "velocity")

    def _root(self, square: Real, root: Any) -> Real:
        """Return the root of a square, given its inverse."""
        if self._shifts is None:
            return square * root
        return (root.scaled * root.mantissa) >> (62 - root.half)

    def _root_product(self, number: Real, root: Any) -> Real:
        """Return a number times an inverse root, in fixed point with SHARE_BITS more than the number."""
        if self._shifts is None:
            return number * root
        return (number * root.mantissa) >> root.half


def _float_root(square: Real) -> Real:
    scalar = square.dtype.type
    bits, start = STARTS[scalar]
    half = scalar(0.5) * square
    root: Real = (bits(start) - (square.view(bits) >> bits(1))).view(scalar)
    for term in TERMS[scalar]:
        root = root * (scalar(term) - ((half * root) * root))
    return root


def _fixed_root(square: Real) -> FixedRoot:
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


def _upper(a: Any, b: Any) -> Any:
    """Return the upper one of the two words of 32 bits of a product, whose factors have one each."""
    product = np.asarray(a, np.uint64) * np.asarray(b, np.uint64)
    return (product >> np.uint64(32)).astype(np.int64)
