"""Elementary functions that have the same bits on every processor.

The commands run its equal in C, `flight/engine/elementary.h`, which has the same bits.

NumPy and the C libraries choose their sine, exponential and so on by the processor, and the choices differ
in the last bit. The functions here consist of +, -, *, /, square root, rounding to an integer, comparison,
and integer arithmetic on the bits of a number. IEEE 754 defines each of these exactly, so C with the same
brackets, compiled with `-ffp-contract=off`, has the same bits. The brackets are part of the interface.

Every function takes float64 of any shape and returns that shape. NaN, or an argument outside the range, gives
NaN. Largest errors, in units in the last place (ulp) of the result:

| function | range | error |
|---|---|---|
| `sine_cosine` | magnitude below 1.6e6 rad | 1.5 to 1000 rad, 2.5 beyond |
| `arc_tangent` | all | 1.5 |
| `arc_sine` | -1 to 1 | 2.5 |
| `arc_cosine` | -1 to 1 | 2.5 ulp of 1 |
| `exponential` | all; 0 and infinity beyond the range of float64 | 1 |
| `logarithm` | 0 and above; of 0 it is minus infinity | 1.5 |

The polynomials are Taylor series. All constants are derived here and rounded once.
"""

from collections.abc import Iterable, Sequence
from decimal import Decimal, localcontext
from math import factorial, inf, nan
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from mambo_codegen.numbers.trigonometry import split_quarter_turn, trigonometry
from mambo_sil.drone.plant.arrays import FloatArray, IntArray


def _constants(values: Iterable[float]) -> tuple[FloatArray, ...]:
    """Return numbers as arrays without axes, with which NumPy computes faster than with Python's floats."""
    return tuple(np.array(value) for value in values)


def _pair(value: Decimal) -> tuple[float, float]:
    """Return a value as a float64 and the remainder."""
    high = float(value)
    return high, float(value - Decimal(high))


def _arc(quarters: int) -> Decimal:
    """Return the arc tangent of `quarters`/4 by Euler's series, whose terms have the same sign."""
    ratio = Decimal(quarters) / 4
    term = ratio / (1 + ratio * ratio)
    total, count = Decimal(0), 0
    while total + term != total:
        total, count = total + term, count + 1
        term = term * ratio * ratio / (1 + ratio * ratio) * (2 * count) / (2 * count + 1)
    return total


_TURN_BITS: Final = 20
MOST_TURNS: Final = np.array(2.0**_TURN_BITS)
"""Quarter turns that `sine_cosine` can subtract."""
TURN_HIGH, TURN_MIDDLE, TURN_LOW = _constants(split_quarter_turn("float64", _TURN_BITS))
_TURN_SINES, _TURN_COSINES = np.array([0.0, 1.0, 0.0, -1.0]), np.array([1.0, 0.0, -1.0, 0.0])
_LAST_QUADRANT: Final = np.array(3)
TURNS_PER_RAD: Final = np.array(trigonometry("float64").quarter_turns_per_rad)
SINE, COSINE = _constants(trigonometry("float64").sine), _constants(trigonometry("float64").cosine)
_ONE: Final = np.array(1.0)

_LN2_BITS: Final = 32
_EXPONENT_BIAS, _MANTISSA_BITS = 1023, 52
_LEAST_EXPONENT, _LARGEST_EXPONENT = -746.0, 710.0
"""Arguments of `exponential` beyond which the result is 0 or infinity."""
_SMALLEST_NORMAL: Final = 2.2250738585072014e-308

with localcontext() as _context:
    _context.prec = 50
    _LN2 = Decimal(2).ln()
    _PER_LN2 = float(1 / _LN2)
    _LN2_HIGH = int(_LN2 * 2**_LN2_BITS) / 2**_LN2_BITS
    _LN2_LOW = float(_LN2 - Decimal(_LN2_HIGH))
    _ROOT_HALF_BITS = int(np.float64(Decimal("0.5").sqrt()).view(np.int64))
    HALF_PI_HIGH, HALF_PI_LOW = _pair(2 * _arc(4))
    ARC_HIGH, ARC_LOW = np.array([_pair(_arc(quarters)) for quarters in range(5)]).T

ARC_EDGES: Final = np.array([0.1875, 0.375, 0.625, 0.875])
ARC_TANGENT: Final = _constants((1 - 2 * (n % 2)) / (2 * n + 1) for n in range(1, 11))
_EXPONENTIAL: Final = _constants(1.0 / factorial(n) for n in range(2, 14))
_LOGARITHM: Final = _constants(2.0 / (2 * n + 1) for n in range(1, 11))


def _polynomial(x: FloatArray, coefficients: Sequence[FloatArray]) -> FloatArray:
    """Return c0 + (x * (c1 + (x * (c2 + ...)))) of the shape of x."""
    value = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        value = coefficient + (x * value)
    return value


def sine_cosine(angle_rad: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return sine and cosine, each (...), of angles (...).

    Let n be the nearest integer to angle * 2/pi, and pi/2 = h + m + l; n times h and m are exact:

        r = ((angle - (n * h)) - (n * m)) - (n * l),    z = r * r
        sin r = r + (r * (z * (s0 + (z * (s1 + ...))))),    cos r = 1 + (z * (c0 + (z * (c1 + ...))))

    An odd n exchanges sine and cosine; bit 1 of n negates the sine, bit 1 of n + 1 the cosine. The sine of -0
    is +0. Sums of products with 0 and +/- 1 select here: NumPy is faster with them than with `where`.
    """
    angle = np.asarray(angle_rad, np.float64)
    turns = np.rint(angle * TURNS_PER_RAD)
    if not np.count_nonzero(turns):  # then r is the angle
        return _series(angle)
    inside = np.abs(turns) <= MOST_TURNS
    if np.count_nonzero(inside) != inside.size:
        angle, turns = np.where(inside, angle, nan), np.where(inside, turns, 0.0)
    rest = ((angle - (turns * TURN_HIGH)) - (turns * TURN_MIDDLE)) - (turns * TURN_LOW)
    sine, cosine = _series(rest)
    quadrant = turns.astype(np.int64) & _LAST_QUADRANT
    turn_sine, turn_cosine = _TURN_SINES.take(quadrant), _TURN_COSINES.take(quadrant)
    return (sine * turn_cosine) + (cosine * turn_sine), (cosine * turn_cosine) - (sine * turn_sine)


def _series(rest: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return sine and cosine of angles within +/- pi/4."""
    square = rest * rest
    sine = rest + (rest * (square * _polynomial(square, SINE)))
    return sine, _ONE + (square * _polynomial(square, COSINE))


def arc_tangent(x: ArrayLike) -> FloatArray:
    """Return the arc tangent (...) of x (...), in [-pi/2, pi/2].

    Let a = |x|, b = a or, where a > 1, 1 / a, and c the last of 0, 1/4, 1/2, 3/4, 1 with b >= 0, 3/16, 3/8,
    5/8, 7/8. With arctan c = h + l and pi/2 = H + L:

        t = (b - c) / (1 + (b * c)),    z = t * t
        y = h + (l + (t + (t * (z * (k0 + (z * (k1 + ...)))))))

    The result is y or, where a > 1, H - (y - L), with the sign of x.
    """
    number = np.asarray(x, np.float64)
    size = np.abs(number)
    steep = size > 1.0
    b = np.where(steep, 1.0 / np.where(steep, size, 1.0), size)
    nearest = np.searchsorted(ARC_EDGES, b, side="right")
    c = 0.25 * nearest
    t = (b - c) / (1.0 + (b * c))
    z = t * t
    y = ARC_HIGH[nearest] + (ARC_LOW[nearest] + (t + (t * (z * _polynomial(z, ARC_TANGENT)))))
    value: FloatArray = np.copysign(np.where(steep, HALF_PI_HIGH - (y - HALF_PI_LOW), y), number)
    return value


def arc_sine(x: ArrayLike) -> FloatArray:
    """Return the arc sine (...) of x (...): arctan(x / sqrt((1 - x) * (1 + x))), which is infinite at 1."""
    number = np.asarray(x, np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        return arc_tangent(number / np.sqrt((1.0 - number) * (1.0 + number)))


def arc_cosine(x: ArrayLike) -> FloatArray:
    """Return the arc cosine (...) of x (...): pi/2 as a float64, minus arcsin x."""
    return HALF_PI_HIGH - arc_sine(x)


def exponential(x: ArrayLike) -> FloatArray:
    """Return e to the power of x (...).

    Let k be the nearest integer to x / ln 2, and ln 2 = h + l. The product k * h is exact:

        r = (x - (k * h)) - (k * l),    e^r = 1 + (r + ((r * r) * (1/2 + (r * (1/6 + ...)))))

    The result is (e^r * 2^j) * 2^(k - j), j being k / 2 rounded down: each factor is a normal number, so that
    results below the smallest normal number are rounded once. The bits of 2^j are (j + 1023) << 52.
    """
    number = np.clip(np.asarray(x, np.float64), _LEAST_EXPONENT, _LARGEST_EXPONENT)
    doublings = np.rint(np.where(np.isnan(number), 0.0, number) * _PER_LN2)
    rest = (number - (doublings * _LN2_HIGH)) - (doublings * _LN2_LOW)
    value: FloatArray = 1.0 + (rest + ((rest * rest) * _polynomial(rest, _EXPONENTIAL)))
    exponent = doublings.astype(np.int64)
    half = exponent >> 1
    return (value * _power_of_two(half)) * _power_of_two(exponent - half)


def _power_of_two(exponent: IntArray) -> FloatArray:
    return np.asarray((exponent + _EXPONENT_BIAS) << _MANTISSA_BITS).view(np.float64)


def logarithm(x: ArrayLike) -> FloatArray:
    """Return the natural logarithm (...) of x (...).

    Let x = 2^k * m with m from sqrt(1/2) to sqrt(2), taken from the bits of x, and ln 2 = h + l:

        f = m - 1,    s = f / (2 + f),    z = s * s,    R = z * (2/3 + (z * (2/5 + ...)))
        ln x = (k * h) + ((f - (s * (f - R))) + (k * l))

    A number below the smallest normal one is multiplied by 2^54 first.
    """
    number = np.asarray(x, np.float64)
    small = number < _SMALLEST_NORMAL
    regular = (number > 0.0) & (number < inf)
    scaled = np.where(regular, number * np.where(small, 2.0**54, 1.0), 1.0)
    bits = scaled.view(np.int64)
    exponent = (bits - _ROOT_HALF_BITS) >> _MANTISSA_BITS
    f = np.asarray(bits - (exponent << _MANTISSA_BITS)).view(np.float64) - 1.0
    k = exponent - np.where(small, 54.0, 0.0)
    s = f / (2.0 + f)
    z = s * s
    value = (k * _LN2_HIGH) + ((f - (s * (f - (z * _polynomial(z, _LOGARITHM))))) + (k * _LN2_LOW))
    limit = np.where(number == 0.0, -inf, np.where(number > 0.0, inf, nan))
    return np.where(regular, value, limit)


def hypotenuse(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return sqrt((x * x) + (y * y)) (...) of x and y (...), within 1.5 ulp if the squares are normal."""
    return np.sqrt((x * x) + (y * y))
