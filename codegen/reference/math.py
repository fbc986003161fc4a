"""Sine, cosine, sign and ordered sums, as `nmpc_math.h` has them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from codegen.trigonometry import Trigonometry

Real = NDArray[np.floating[Any]]
"""An array of the controller's scalar type."""


def sine_cosine(angle_rad: Real, constants: Trigonometry) -> tuple[Real, Real]:
    """Return sine and cosine of `angle_rad`, of any shape and at most YAW_LIMIT_RAD in size."""
    scalar = angle_rad.dtype.type
    high, middle, low = (scalar(part) for part in constants.quarter_turn_rad)
    turns = angle_rad * scalar(constants.quarter_turns_per_rad)
    quadrant = np.trunc(turns + np.where(turns < 0, scalar(-0.5), scalar(0.5)))
    rest = ((angle_rad - (quadrant * high)) - (quadrant * middle)) - (quadrant * low)
    square = rest * rest
    sine = rest + (rest * (square * _polynomial(square, constants.sine)))
    cosine = scalar(1) + (square * _polynomial(square, constants.cosine))
    turned = [quadrant.astype(np.int64) % 4 == count for count in (1, 2, 3)]
    return (
        np.select(turned, [cosine, -sine, -cosine], sine),
        np.select(turned, [-sine, -cosine, sine], cosine),
    )


def _polynomial(square: Real, coefficients: tuple[float, ...]) -> Real:
    scalar = square.dtype.type
    value = np.full_like(square, coefficients[-1])
    for coefficient in reversed(coefficients[:-1]):
        value = scalar(coefficient) + (square * value)
    return value


def sign(value: Real) -> Real:
    """Return -1, 0 or 1 in the type of `value`; the sign of zero, of either sign, is 0 (decision 14)."""
    scalar = value.dtype.type
    return np.where(value > 0, scalar(1), np.where(value < 0, scalar(-1), scalar(0)))


def ordered_sum(terms: Real, axis: int) -> Real:
    """Add along `axis`, first to last, starting from zero, as a C loop does."""
    total: Real = terms.dtype.type(0) + np.take(np.add.accumulate(terms, axis=axis), -1, axis=axis)
    return total
