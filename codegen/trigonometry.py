"""Constants of the controller's own sine and cosine.

The C libraries of the world disagree on the last bit of `sinf`; a Taylor series with stated terms does
not. The argument is reduced by quarter turns, with pi/2 in three parts of which the first two have so few
bits that their product with the number of quarter turns is exact (Cody and Waite 1980).
"""

from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from math import factorial
from typing import Final

import numpy as np

from mambo_nmpc.codegen.fixed_point import SINE_BITS, WORD_BITS, Formats
from mambo_nmpc.codegen.literals import SCALARS

SINE_ERRORS: Final = {"float32": 1.2e-7, "float64": 2.3e-16, "fixed": 2e-9}
"""Largest absolute error of sine and cosine within YAW_LIMIT_RAD: about one ulp of 1; two in fixed point."""

_QUARTER_TURN: Final = Fraction(Decimal("3.14159265358979323846264338327950288419716939937510582")) / 2
_TURN_BITS: Final = 10
_FINE_BITS: Final = 40


@dataclass(frozen=True)
class Trigonometry:
    """What `nmpc_sine_cosine` computes with, each value exact in the scalar type.

    With r the angle less its quarter turns, |r| <= pi/4:
    sin r = r + r * r^2 * (sine[0] + r^2 * (sine[1] + ...)), cos r = 1 + r^2 * (cosine[0] + ...).
    """

    quarter_turns_per_rad: float
    quarter_turn_rad: tuple[float, float, float]
    sine: tuple[float, ...]
    cosine: tuple[float, ...]


@dataclass(frozen=True)
class FixedTrigonometry:
    """The same in whole numbers: coefficients and rest in the format SINE_BITS.

    quarter_turns_per_rad: 2/pi; an angle times that has `quarter_turns_bits` behind the point.
    quarter_turn:          pi/2 in the format `fine_bits`, which an angle times 2^`finer_bits` has too.
    """

    quarter_turns_per_rad: int
    quarter_turns_bits: int
    quarter_turn: int
    fine_bits: int
    finer_bits: int
    sine: tuple[int, ...]
    cosine: tuple[int, ...]


def fixed_trigonometry(formats: Formats) -> FixedTrigonometry:
    """Derive the constants for yaws of the format of `formats`."""
    return FixedTrigonometry(
        quarter_turns_per_rad=round(2**WORD_BITS / _QUARTER_TURN),
        quarter_turns_bits=WORD_BITS + formats.yaw,
        quarter_turn=round(2**_FINE_BITS * _QUARTER_TURN),
        fine_bits=_FINE_BITS,
        finer_bits=_FINE_BITS - formats.yaw,
        sine=_fixed_taylor(3),
        cosine=_fixed_taylor(2),
    )


def _fixed_taylor(first_power: int) -> tuple[int, ...]:
    """Collect coefficients until a term at pi/4 is below a quarter of the resolution."""
    coefficients: list[int] = []
    power, sign = first_power, -1
    while (_QUARTER_TURN / 2) ** power / factorial(power) > Fraction(1, 2 ** (SINE_BITS + 2)):
        coefficients.append(round(Fraction(sign * 2**SINE_BITS, factorial(power))))
        power, sign = power + 2, -sign
    return tuple(coefficients)


def trigonometry(scalar: str) -> Trigonometry:
    """Derive the constants for `scalar`: as many terms as its precision can show."""
    return Trigonometry(
        quarter_turns_per_rad=_rounded(1 / _QUARTER_TURN, scalar),
        quarter_turn_rad=_split(scalar),
        sine=_taylor(3, scalar),
        cosine=_taylor(2, scalar),
    )


def _rounded(value: Fraction, scalar: str) -> float:
    return float(SCALARS[scalar](float(value)))


def _split(scalar: str) -> tuple[float, float, float]:
    """Cut pi/2 into two short parts and the rest."""
    bits = np.finfo(SCALARS[scalar]).nmant + 1 - _TURN_BITS
    high = _chopped(_QUARTER_TURN, bits)
    middle = _chopped(_QUARTER_TURN - high, bits)
    return float(high), float(middle), _rounded(_QUARTER_TURN - high - middle, scalar)


def _chopped(value: Fraction, bits: int) -> Fraction:
    """Keep the leading `bits` bits of a positive value below 2."""
    unit = Fraction(1, 2**bits)
    while value / unit < 2 ** (bits - 1):
        unit /= 2
    return (value // unit) * unit


def _taylor(first_power: int, scalar: str) -> tuple[float, ...]:
    """Collect coefficients until a term at pi/4 is below a sixteenth of the precision."""
    smallest = Fraction(float(np.finfo(SCALARS[scalar]).eps)) / 16
    largest_angle = _QUARTER_TURN / 2
    coefficients: list[float] = []
    power, sign = first_power, -1
    while largest_angle**power / factorial(power) > smallest:
        coefficients.append(_rounded(Fraction(sign, factorial(power)), scalar))
        power, sign = power + 2, -sign
    return tuple(coefficients)
