"""Elementary functions: their errors, against 60 digits, and their special values."""

import math
from collections.abc import Callable
from decimal import Decimal, localcontext

import numpy as np
import pytest

from mambo_sil.drone.plant import elementary
from mambo_sil.drone.plant.arrays import FloatArray

DIGITS = 60
PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459230781640628620900")
ANGLES = np.random.default_rng(0)


def series(first: Decimal, factor: Callable[[int], Decimal]) -> Decimal:
    """Return first + first * factor(1) + first * factor(1) * factor(2) + ..."""
    total, term, count = Decimal(0), first, 0
    while total + term != total:
        total, count = total + term, count + 1
        term *= factor(count)
    return total


def exact_sine(x: Decimal) -> Decimal:
    """Return the sine, of an angle less its whole turns."""
    rest = x - 2 * PI * (x / (2 * PI)).to_integral_value()
    return series(rest, lambda n: -rest * rest / ((2 * n) * (2 * n + 1)))


def exact_cosine(x: Decimal) -> Decimal:
    """Return the cosine, as a sine."""
    return exact_sine(x + PI / 2)


def exact_arc_tangent(x: Decimal) -> Decimal:
    """Return the arc tangent; two half angles make the argument small."""
    for _ in range(2):
        x = x / (1 + (1 + x * x).sqrt())
    share = x * x / (1 + x * x)
    return 4 * series(x / (1 + x * x), lambda n: share * (2 * n) / (2 * n + 1))


def exact_arc_sine(x: Decimal) -> Decimal:
    """Return the arc sine, for magnitudes below 1."""
    return exact_arc_tangent(x / (1 - x * x).sqrt())


def sine(x: FloatArray) -> FloatArray:
    """Return the sine alone."""
    return elementary.sine_cosine(x)[0]


def cosine(x: FloatArray) -> FloatArray:
    """Return the cosine alone."""
    return elementary.sine_cosine(x)[1]


def spread(largest: float, count: int = 400) -> FloatArray:
    """Return random numbers within +/- `largest`, half of them far smaller."""
    numbers = ANGLES.uniform(-largest, largest, count)
    numbers[::2] *= 10.0 ** ANGLES.uniform(-8.0, 0.0, len(numbers[::2]))
    return numbers


QUADRANTS = np.concatenate(
    [
        np.nextafter(turns * np.pi / 4.0, side)
        for turns in range(-9, 10)
        for side in ([-np.inf], [0.0], [np.inf])
    ]
    + [np.arange(-9, 10) * np.pi / 4.0, np.array([355.0, 1e4, 573204.0])]
)
EDGES = np.array([0.1875, 0.375, 0.625, 0.875, 1.0, 1.0 / 0.1875])
BRANCHES = np.concatenate([EDGES, np.nextafter(EDGES, 0.0), np.nextafter(EDGES, 9.0)])
NEAR_1 = np.concatenate([1.0 - 2.0 ** -np.arange(1, 54), BRANCHES[BRANCHES < 1.0]])
POSITIVE = np.concatenate(
    [
        10.0 ** ANGLES.uniform(-300.0, 300.0, 200),
        ANGLES.uniform(0.0, 3.0, 200),
        [5e-324, 1e-310, math.sqrt(0.5)],
    ]
)

Function = Callable[[FloatArray], FloatArray]
CASES: dict[str, tuple[Function, Callable[[Decimal], Decimal], FloatArray, float]] = {
    "sine to 1000 rad": (sine, exact_sine, np.concatenate([spread(4.0), spread(1000.0)]), 1.5),
    "cosine to 1000 rad": (cosine, exact_cosine, np.concatenate([spread(4.0), spread(1000.0)]), 1.5),
    "sine beyond": (sine, exact_sine, np.concatenate([QUADRANTS, spread(1.6e6)]), 2.5),
    "cosine beyond": (cosine, exact_cosine, np.concatenate([QUADRANTS, spread(1.6e6)]), 2.5),
    "arc tangent": (
        elementary.arc_tangent,
        exact_arc_tangent,
        np.concatenate([spread(1.0), spread(50.0), spread(1e20), BRANCHES, -BRANCHES]),
        1.5,
    ),
    "arc sine": (elementary.arc_sine, exact_arc_sine, np.concatenate([spread(1.0), NEAR_1, -NEAR_1]), 2.5),
    "exponential": (
        elementary.exponential,
        Decimal.exp,
        np.concatenate([spread(1.0), spread(700.0), [-745.0, -744.0, -720.0, -708.5, 709.7]]),
        1.0,
    ),
    "logarithm": (
        elementary.logarithm,
        Decimal.ln,
        np.concatenate([POSITIVE, 1.0 + spread(1e-3)]),
        1.5,
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_the_error_is_as_stated(case: str) -> None:
    """In units in the last place of the result, at random arguments and where the branches change."""
    function, exact, arguments, largest = CASES[case]
    with localcontext() as context:
        context.prec = DIGITS
        for argument, value in zip(arguments.tolist(), function(arguments).tolist(), strict=True):
            error = abs(Decimal(value) - exact(Decimal(argument))) / Decimal(math.ulp(value))
            assert error <= Decimal(largest), f"{argument.hex()}: {value} is {error:.2f} ulp off"


def test_the_arc_cosine_is_within_two_and_a_half_ulp_of_1() -> None:
    """It is the complement of the arc sine, so its absolute error is bounded."""
    arguments = np.concatenate([spread(1.0), NEAR_1])
    with localcontext() as context:
        context.prec = DIGITS
        for argument, value in zip(
            arguments.tolist(), elementary.arc_cosine(arguments).tolist(), strict=True
        ):
            error = abs(Decimal(value) - (PI / 2 - exact_arc_sine(Decimal(argument))))
            assert error <= Decimal("2.5") * Decimal(2) ** -52


def test_the_hypotenuse_is_within_one_and_a_half_ulp() -> None:
    """The root halves the relative error of the sum of squares, and is rounded itself."""
    x, y = spread(3.0), spread(5.0)
    for one, other, value in zip(x.tolist(), y.tolist(), elementary.hypotenuse(x, y).tolist(), strict=True):
        with localcontext() as context:
            context.prec = DIGITS
            exact = (Decimal(one) ** 2 + Decimal(other) ** 2).sqrt()
            assert abs(Decimal(value) - exact) <= Decimal("1.5") * Decimal(math.ulp(value))


def bits(values: FloatArray | float) -> list[str]:
    """Return the bits of numbers, which tell -0 from 0."""
    return [value.hex() for value in np.atleast_1d(values).tolist()]


def test_special_values() -> None:
    """Zeros keep their sign, but for the sine; poles and limits are exact; what has no value is NaN."""
    inf, nan, half_pi = math.inf, math.nan, math.pi / 2.0
    beyond = [inf, -inf, nan, 1.7e6, -1e300]
    assert all(np.isnan(part).all() for part in elementary.sine_cosine(beyond))
    turned = sine(np.array([0.0, -0.0, 3.0]))
    assert bits(turned[:2]) == bits(sine(np.array([0.0, -0.0]))) == bits(np.zeros(2))
    assert bits(cosine(np.array([0.0, -0.0]))) == bits(np.ones(2))
    assert bits(elementary.arc_tangent([0.0, -0.0, inf, -inf, 1.0, nan])) == bits(
        np.array([0.0, -0.0, half_pi, -half_pi, math.pi / 4.0, nan])
    )
    assert bits(elementary.arc_sine([0.0, -0.0, 1.0, -1.0, 1.1, nan])) == bits(
        np.array([0.0, -0.0, half_pi, -half_pi, nan, nan])
    )
    assert bits(elementary.arc_cosine([1.0, -1.0, -1.1])) == bits(np.array([0.0, math.pi, nan]))
    assert bits(elementary.exponential([0.0, -0.0, -746.0, -inf, -1e300, nan])) == bits(
        np.array([1.0, 1.0, 0.0, 0.0, 0.0, nan])
    )
    with np.errstate(over="ignore"):
        assert bits(elementary.exponential([709.8, inf, 1e300])) == bits(np.array([inf, inf, inf]))
    assert bits(elementary.logarithm([0.0, -0.0, 1.0, inf, -1.0, -inf, nan])) == bits(
        np.array([-inf, -inf, 0.0, inf, nan, nan, nan])
    )


@pytest.mark.parametrize(
    "name", ["sine_cosine", "arc_tangent", "arc_sine", "arc_cosine", "exponential", "logarithm"]
)
def test_a_number_has_the_same_bits_alone_and_in_an_array(name: str) -> None:
    """Of any shape, whatever its neighbours: turned or not, large or not a number."""
    function = getattr(elementary, name)
    numbers = np.concatenate([spread(1.0, 10), spread(9.0, 8), [0.0, -0.0, 1.7e6, math.nan, 1.0, -1.0]])
    if name == "exponential":
        numbers[-4:-2] = -1e4, math.nan
    together = np.reshape(function(numbers.reshape(2, 3, 4)), (-1, 24))
    alone = np.reshape(np.stack([np.asarray(function(number)) for number in numbers], axis=-1), (-1, 24))
    assert together.tobytes() == alone.tobytes()
