"""Fixed point numbers: a number of format b is a 32-bit integer that stands for integer / 2^b."""

import math
from collections.abc import Mapping
from typing import Final, Protocol

WORD_BITS: Final = 31
"""Bits of a number without its sign."""

LARGEST: Final = 2**WORD_BITS - 1
"""Saturation value of an input: outside every input range, so the step refuses it."""

SINE_BITS: Final = 30
"""Format of sine and cosine, which are at most 1."""

FACTOR_BITS: Final = 26
"""Format of factors, which are less than 32, intermediate results too."""

PRODUCT_BITS: Final = 62
"""Most bits of a product without its sign: one less than the type has, because rounding adds half a unit."""

MARGIN: Final = 1.01
"""Every bound is enlarged by 1 %, a thousand times more than all roundings over a horizon add."""


class Formats(Protocol):
    """The formats of a controller."""

    @property
    def bits(self) -> Mapping[str, int]:
        """Fractional bits by quantity."""


def raw(value: float, bits: int) -> int:
    """Return the integer of format `bits` nearest to `value`, ties away from zero, at most 2^62.

    Only a tolerance can exceed 2^62; no cost does.
    """
    size: int = min(math.floor(math.ldexp(abs(value), bits) + 0.5), 2**PRODUCT_BITS)
    return -size if value < 0 else size


def fractional_bits(*sizes: float) -> int:
    """Return the most fractional bits with which values of these sizes fit in a word."""
    return WORD_BITS - integer_bits(max(sizes), 1.0)


def integer_bits(a: float, b: float) -> int:
    """Return the integer bits that the product of two bounds needs."""
    return math.frexp(a * b * MARGIN)[1]
