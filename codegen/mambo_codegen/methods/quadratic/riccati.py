"""Matrix equations of optimal control and estimation, to 40 digits.

Gains become constants of the generated C, which is the same text on every machine. LAPACK rounds differently
from processor to processor; 40 digits, rounded to float64 once at the end, do not. Doublings and exponentials
compute with integers of 384 fractional bits, a resolution of 1e-115, a seventh of the time or less.
"""

from typing import Any, Final

import mpmath
import numpy as np
from numpy.typing import NDArray

DIGITS: Final = 40
mp: Final = mpmath.MPContext()
mp.dps = DIGITS

Matrix = Any
"""A matrix of `mp`, which has no types."""

Integers = NDArray[np.object_]
"""A matrix of Python's integers: values times 2^384."""

_DOUBLINGS: Final = 60
_CONVERGED: Final = 10 ** (DIGITS - 12)
_BITS: Final = 384
_HALVINGS: Final = 32
"""Of the exponent, so that its Taylor series takes about a dozen terms."""
_DIVERGED: Final = 1 << (_BITS + 64)
"""No power of a transition whose mode can be stabilised has an element of 2^64."""


def hold(rates: Matrix, inputs: Matrix, period_s: Any) -> tuple[Matrix, Matrix]:
    """Discretise x' = rates x + inputs u for an input that is held for `period_s`.

    rates is (n, n) and inputs (n, m). Returns the transition (n, n) and the input matrix (n, m).
    """
    n, m = inputs.rows, inputs.cols
    joint = mp.zeros(n + m)
    joint[:n, :n] = rates * period_s
    joint[:n, n:] = inputs * period_s
    exponential = _exponential(joint)
    return exponential[:n, :n], exponential[:n, n:]


def solve_riccati(transition: Matrix, inputs: Matrix, state_cost: Matrix, input_cost: Matrix) -> Matrix:
    """Solve the discrete algebraic Riccati equation by structure-preserving doubling.

    The cost is the sum of x^T state_cost x + u^T input_cost u; the solution P gives the cost to go x^T P x
    (E. K.-W. Chu et al., International Journal of Control 77(8), 2004). It ends when inputs^T P, from which
    gains follow, has converged; what no input moves may converge later. Raises ValueError if that takes too
    long, as when a mode that costs cannot be stabilised.
    """
    b = _integers(inputs)
    a, h = _integers(transition), _integers(state_cost)
    g = _product(b, _integers(mp.inverse(input_cost)), b.T)
    identity = _integers(mp.eye(transition.rows))
    for _ in range(_DOUBLINGS):
        if np.max(np.abs(a)) > _DIVERGED:
            break
        try:
            solved = _inverse(identity + _product(g, h))
        except ZeroDivisionError:
            break
        grown = _product(a.T, h, solved, a)
        stepped = _product(a, solved)
        a, g, h = _product(stepped, a), g + _product(stepped, g, a.T), h + grown
        if _CONVERGED * np.max(np.abs(b.T @ grown)) <= np.max(np.abs(b.T @ h)):
            return _matrix((h + h.T) // 2)
    raise ValueError("the Riccati equation has no stabilising solution")


def feedback_gain(transition: Matrix, inputs: Matrix, input_cost: Matrix, to_go: Matrix) -> Matrix:
    """Return the gain K (m, n) of the optimal feedback u = -K x for the cost to go `to_go`."""
    weighted = inputs.T * to_go
    return mp.inverse(input_cost + (weighted * inputs)) * weighted * transition


def sum_costs(transition: Matrix, state_cost: Matrix, to_go: Matrix, steps: int) -> Matrix:
    """Return M for which x^T M x sums x^T state_cost x over `steps` steps of x+ = transition x, from x on.

    The state behind them costs x^T to_go x. Doubles the number of steps, for there may be thousands.
    """
    if steps == 0:
        return to_go
    one, cost, last = _integers(transition), _integers(state_cost), _integers(to_go)
    power, total = one, cost
    for digit in f"{steps:b}"[1:]:
        total, power = total + _product(power.T, total, power), _product(power, power)
        if digit == "1":
            total, power = cost + _product(one.T, total, one), _product(one, power)
    return _matrix(total + _product(power.T, last, power))


def _exponential(matrix: Matrix) -> Matrix:
    """Return the exponential of a matrix (n, n), by scaling and squaring."""
    scaled, k = _integers(mp.ldexp(1, -_HALVINGS) * matrix), 1
    total = _integers(mp.eye(matrix.rows)) + scaled
    term = scaled
    while np.max(np.abs(term)) > 1:  # a product rounds down, so -1 stays -1
        k += 1
        term = _product(term, scaled) // k
        total = total + term
    for _ in range(_HALVINGS):
        total = _product(total, total)
    return _matrix(total)


def _integers(matrix: Matrix) -> Integers:
    """Return the matrix in integers, rounded towards 0."""
    return np.array([[int(mp.ldexp(value, _BITS)) for value in row] for row in matrix.tolist()], object)


def _matrix(integers: Integers) -> Matrix:
    """Return the matrix of `mp`, to its 40 digits."""
    return mp.matrix([[mp.ldexp(mp.mpf(value), -_BITS) for value in row] for row in integers.tolist()])


def _product(first: Integers, *others: Integers) -> Integers:
    """Multiply from left to right."""
    for other in others:
        first = (first @ other) >> _BITS
    return first


def _inverse(matrix: Integers) -> Integers:
    """Invert by Gauss-Jordan elimination with pivots; raises ZeroDivisionError."""
    n = len(matrix)
    rows = np.hstack([matrix, _integers(mp.eye(n))])
    for k in range(n):
        pivot = k + int(np.argmax(np.abs(rows[k:, k])))
        rows[[k, pivot]] = rows[[pivot, k]]
        rows[k] = (rows[k] << _BITS) // rows[k, k]
        others = np.arange(n) != k
        rows[others] -= np.outer(rows[others, k], rows[k]) >> _BITS
    return rows[:, n:]
