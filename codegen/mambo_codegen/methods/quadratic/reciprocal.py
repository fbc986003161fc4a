"""Reciprocals from products: a line, and then steps of Newton's."""

from dataclasses import dataclass, replace
from typing import Final

RECIPROCAL_ERROR: Final = 3e-4
"""Largest relative error of a reciprocal."""


@dataclass(frozen=True)
class Reciprocal:
    """1/x from products: y = start - slope x, and `steps` of y (2 - x y), of which the last has `two` for 2.

    The relative error of each step is the square of that before: at most `error` in the end, and of one sign.
    `most` is more than any y.
    """

    start: float
    slope: float
    steps: int
    two: float
    error: float
    most: float


def reciprocal(low: float, high: float, largest_error: float = RECIPROCAL_ERROR) -> Reciprocal:
    """Return the reciprocal of numbers from `low` to `high` with the fewest steps.

    Its line has the same error, 1 - x y, at both ends, and the opposite one in the middle.
    """
    middle = low + high
    start = 2 / (((low * high) / middle) + (middle / 4))
    error, steps = (start * middle / 4) - 1, 0
    while error > largest_error:
        error, steps = error * error, steps + 1
    return Reciprocal(start, start / middle, steps, 2.0, error, 1.01 / low)


def never_too_small(found: Reciprocal) -> Reciprocal:
    """Return the reciprocal that errs upwards: the last step rounds up by more than the error."""
    margin = found.error + 1e-5
    return replace(found, two=2 + margin, error=margin)
