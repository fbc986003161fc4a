"""Constants of the controller's own sine and cosine.

C libraries differ in the last bit of `sinf`, so the controller has polynomials of its own. First it subtracts
whole quarter turns from the angle. For that pi/2 is split into two parts; the first has so few bits that its
product with the number of quarter turns is exact (Cody and Waite 1980).

In float64 the polynomials are Taylor series. In float32 and fixed point they have the least largest error up
to pi/4, found by the exchange algorithm of Remez with 40 digits: 1.8e-9 for sine with three terms, and for
cosine 3.2e-8 with three terms and 5.4e-11 with four.
"""

from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from math import factorial
from typing import Any, Final

import numpy as np

from mambo_codegen.numbers.fixed_point import SINE_BITS, WORD_BITS
from mambo_codegen.numbers.literals import SCALARS

SINE_ERRORS: Final = {"float32": 1.21e-7, "float64": 2.3e-16, "fixed": 4e-9}
"""Largest absolute error of sine and cosine within YAW_LIMIT_RAD: about one ulp of 1; four in fixed point."""

MINIMAX_SINE: Final = ("-0.166666506214451442", "0.0083319759667953695745", "-0.00019495293348716036728")
"""sin r = r + r^3 (c0 + c1 r^2 + c2 r^4)."""

MINIMAX_COSINE: Final = {
    3: ("-0.49999894466955950206", "0.041656273956804937631", "-0.0013597534796045871899"),
    4: (
        "-0.49999999724010270356",
        "0.041666623194668040744",
        "-0.0013886759563035188923",
        "0.000024390042622448859052",
    ),
}
"""cos r = 1 + r^2 (c0 + c1 r^2 + ...), by the number of terms."""

ARC_TANGENT_ERROR: Final = {"float32": 2.1e-7, "float64": 3.9e-8, "fixed": 5e-8}
"""Largest absolute error of the arc tangent, rad, for tangents of at most 4; in fixed point with half a unit
of the angle's format on top."""

MINIMAX_ARC_TANGENT: Final = (
    "0.9999993355783404881",
    "-0.33329860784334521815",
    "0.1994656565133223257",
    "-0.13908629550156132947",
    "0.096421973285621306206",
    "-0.055912326777386903373",
    "0.021862957881095706547",
    "-0.004054567215229052131",
)
"""arctan x = x (c0 + c1 x^2 + ...) for |x| <= 1, with the least largest error, 3.75e-8."""

_QUARTER_TURN: Final = Fraction(Decimal("3.14159265358979323846264338327950288419716939937510582")) / 2
_TURN_BITS: Final = 10
_FINE_BITS: Final = 40


@dataclass(frozen=True)
class Trigonometry:
    """Constants of `sine_cosine`, each exact in the scalar type.

    A number plus `rounding`, 1.5 times the inverse of the precision, is rounded to a whole number.
    Let r be the angle minus its whole quarter turns, |r| <= pi/4:
    sin r = r + r * r^2 * (sine[0] + r^2 * (sine[1] + ...)), cos r = 1 + r^2 * (cosine[0] + ...).
    """

    quarter_turns_per_rad: float
    rounding: float
    quarter_turn_rad: tuple[float, float]
    sine: tuple[float, ...]
    cosine: tuple[float, ...]


@dataclass(frozen=True)
class FixedTrigonometry:
    """The same as integers; coefficients and r have the format SINE_BITS.

    quarter_turns_per_rad: 2/pi; its product with an angle has the format `quarter_turns_bits`.
    quarter_turn:          pi/2 in the format `fine_bits`; an angle times 2^`finer_bits` has that format too.
    """

    quarter_turns_per_rad: int
    quarter_turns_bits: int
    quarter_turn: int
    fine_bits: int
    finer_bits: int
    sine: tuple[int, ...]
    cosine: tuple[int, ...]


def fixed_trigonometry(yaw_bits: int) -> FixedTrigonometry:
    """Derive the constants for a heading with `yaw_bits` fractional bits."""
    return FixedTrigonometry(
        quarter_turns_per_rad=round(2**WORD_BITS / _QUARTER_TURN),
        quarter_turns_bits=WORD_BITS + yaw_bits,
        quarter_turn=round(2**_FINE_BITS * _QUARTER_TURN),
        fine_bits=_FINE_BITS,
        finer_bits=_FINE_BITS - yaw_bits,
        sine=_fixed(MINIMAX_SINE),
        cosine=_fixed(MINIMAX_COSINE[4]),
    )


def _fixed(coefficients: tuple[str, ...]) -> tuple[int, ...]:
    return tuple(round(2**SINE_BITS * Fraction(coefficient)) for coefficient in coefficients)


def arc_tangent(scalar: str) -> tuple[Any, ...]:
    """Return the coefficients of the arc tangent as numbers of `scalar`; in fixed point of SINE_BITS."""
    if scalar == "fixed":
        return _fixed(MINIMAX_ARC_TANGENT)
    return tuple(SCALARS[scalar](value) for value in _rounded(MINIMAX_ARC_TANGENT, scalar))


def trigonometry(scalar: str) -> Trigonometry:
    """Derive the constants for `scalar`, "float32" or "float64"."""
    is_short = scalar == "float32"
    high, middle, low = split_quarter_turn(scalar, _TURN_BITS)
    return Trigonometry(
        quarter_turns_per_rad=_round(1 / _QUARTER_TURN, scalar),
        rounding=1.5 / float(np.finfo(SCALARS[scalar]).eps),
        quarter_turn_rad=(high, _round(Fraction(middle) + Fraction(low), scalar)),
        sine=_rounded(MINIMAX_SINE, scalar) if is_short else _taylor(3, scalar),
        cosine=_rounded(MINIMAX_COSINE[3], scalar) if is_short else _taylor(2, scalar),
    )


def _rounded(coefficients: tuple[str, ...], scalar: str) -> tuple[float, ...]:
    return tuple(_round(Fraction(coefficient), scalar) for coefficient in coefficients)


def _round(value: Fraction, scalar: str) -> float:
    return float(SCALARS[scalar](float(value)))


def split_quarter_turn(scalar: str, turn_bits: int) -> tuple[float, float, float]:
    """Split pi/2 into a remainder and two parts whose products with integers of `turn_bits` are exact."""
    bits = np.finfo(SCALARS[scalar]).nmant + 1 - turn_bits
    high = _truncate(_QUARTER_TURN, bits)
    middle = _truncate(_QUARTER_TURN - high, bits)
    return float(high), float(middle), _round(_QUARTER_TURN - high - middle, scalar)


def _truncate(value: Fraction, bits: int) -> Fraction:
    """Truncate a positive value below 2 to its leading `bits` bits."""
    unit = Fraction(1, 2**bits)
    while value / unit < 2 ** (bits - 1):
        unit /= 2
    return (value // unit) * unit


def _taylor(first_power: int, scalar: str) -> tuple[float, ...]:
    """Return the coefficients of all terms that exceed a sixteenth of the precision at pi/4."""
    smallest = Fraction(float(np.finfo(SCALARS[scalar]).eps)) / 16
    largest_angle = _QUARTER_TURN / 2
    coefficients: list[float] = []
    power, sign = first_power, -1
    while largest_angle**power / factorial(power) > smallest:
        coefficients.append(_round(Fraction(sign, factorial(power)), scalar))
        power, sign = power + 2, -sign
    return tuple(coefficients)
