"""Sine, cosine, sign and ordered sums, as in nmpc.c."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.numbers.fixed_point import SINE_BITS
from mambo_codegen.numbers.trigonometry import FixedTrigonometry, Trigonometry

Real = NDArray[Any]
"""An array of the controller's scalar type; of int64 for fixed point."""


def sine_cosine(angle_rad: Real, constants: Trigonometry) -> tuple[Real, Real]:
    """Return sine and cosine of `angle_rad`, of any shape and at most YAW_LIMIT_RAD in size."""
    scalar = angle_rad.dtype.type
    high, low = (scalar(part) for part in constants.quarter_turn_rad)
    rounding = scalar(constants.rounding)
    quadrant = ((angle_rad * scalar(constants.quarter_turns_per_rad)) + rounding) - rounding
    rest = (angle_rad - (quadrant * high)) - (quadrant * low)
    square = rest * rest
    sine = rest + (rest * (square * _polynomial(square, constants.sine)))
    cosine = scalar(1) + (square * _polynomial(square, constants.cosine))
    return _in_quadrant(quadrant.astype(np.int64), sine, cosine)


def _in_quadrant(quadrant: NDArray[np.int64], sine: Real, cosine: Real) -> tuple[Real, Real]:
    quadrants = [quadrant % 4 == count for count in (1, 2, 3)]
    return (
        np.select(quadrants, [cosine, -sine, -cosine], sine),
        np.select(quadrants, [-sine, -cosine, sine], cosine),
    )


def _polynomial(square: Real, coefficients: tuple[float, ...]) -> Real:
    scalar = square.dtype.type
    value = np.full_like(square, coefficients[-1])
    for coefficient in reversed(coefficients[:-1]):
        value = scalar(coefficient) + (square * value)
    return value


def fixed_sine_cosine(angle_rad: Real, constants: FixedTrigonometry) -> tuple[Real, Real]:
    """Return sine and cosine of `angle_rad`, numbers of the format of yaw, in the format SINE_BITS."""
    quadrant = rounded(angle_rad * constants.quarter_turns_per_rad, constants.quarter_turns_bits)
    fine = (angle_rad * 2**constants.finer_bits) - (quadrant * constants.quarter_turn)
    rest = rounded(fine, constants.fine_bits - SINE_BITS)
    square = rounded(rest * rest, SINE_BITS)
    sine = rest + rounded(
        rest * rounded(square * _fixed_polynomial(square, constants.sine), SINE_BITS), SINE_BITS
    )
    cosine = 2**SINE_BITS + rounded(square * _fixed_polynomial(square, constants.cosine), SINE_BITS)
    return _in_quadrant(quadrant, sine, cosine)


def _fixed_polynomial(square: Real, coefficients: tuple[int, ...]) -> Real:
    value: Real = np.full_like(square, coefficients[-1])
    for coefficient in reversed(coefficients[:-1]):
        value = coefficient + rounded(square * value, SINE_BITS)
    return value


def rounded(product: Real, bits: int) -> Real:
    """Shift right by `bits`, rounded to nearest, ties up."""
    nearest: Real = (product + 2 ** (bits - 1)) >> bits
    return nearest


def clamp(values: Real, limit: Any) -> Real:
    """Clamp `values` at plus or minus `limit`, with the comparisons of the C."""
    clamped: Real = np.where(values > limit, limit, np.where(values < -limit, -limit, values))
    return clamped


def confine(values: Real, low: Any, high: Any) -> Real:
    """Clamp `values` at `low` and `high`, with the comparisons of the C."""
    limited = np.where(values > high, high, values)
    confined: Real = np.where(limited < low, low, limited)
    return confined


def smaller(a: Real, b: Real) -> Real:
    """Return the smaller numbers, with the comparison of the C."""
    least: Real = np.where(a < b, a, b)
    return least


def larger(a: Real, b: Real) -> Real:
    """Return the larger numbers, with the comparison of the C."""
    most: Real = np.where(a > b, a, b)
    return most


def sign(value: Real) -> Real:
    """Return -1, 0 or 1 in the type of `value`; 0 for +0 and -0 (departure 14, docs/explanation/paper.md)."""
    scalar = value.dtype.type
    signs: Real = np.where(value > 0, scalar(1), np.where(value < 0, scalar(-1), scalar(0)))
    return signs


def ordered_sum(terms: Real, axis: int) -> Real:
    """Add along `axis`, first to last, starting from zero, as a C loop does."""
    total: Real = terms.dtype.type(0) + np.take(np.add.accumulate(terms, axis=axis), -1, axis=axis)
    return total
