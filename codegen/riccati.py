"""Matrix equations of optimal control and estimation, to 40 digits.

Gains become constants of the generated C, which is the same text on every machine. LAPACK rounds differently
from processor to processor; 40 digits, rounded to float64 once at the end, do not.
"""

from typing import Any, Final

import mpmath

DIGITS: Final = 40
mp: Final = mpmath.MPContext()
mp.dps = DIGITS

Matrix = Any
"""A matrix of `mp`, which has no types."""

_DOUBLINGS: Final = 60
_CONVERGED: Final = mp.mpf(10) ** (12 - DIGITS)


def hold(rates: Matrix, inputs: Matrix, period_s: Any) -> tuple[Matrix, Matrix]:
    """Discretise x' = rates x + inputs u for an input that is held for `period_s`.

    rates is (n, n) and inputs (n, m). Returns the transition (n, n) and the input matrix (n, m).
    """
    n, m = inputs.rows, inputs.cols
    joint = mp.zeros(n + m)
    joint[:n, :n] = rates * period_s
    joint[:n, n:] = inputs * period_s
    exponential = mp.expm(joint)
    return exponential[:n, :n], exponential[:n, n:]


def solve_riccati(transition: Matrix, inputs: Matrix, state_cost: Matrix, input_cost: Matrix) -> Matrix:
    """Solve the discrete algebraic Riccati equation by structure-preserving doubling.

    The cost is the sum of x^T state_cost x + u^T input_cost u; the solution P gives the cost to go x^T P x
    (E. K.-W. Chu et al., International Journal of Control 77(8), 2004). It ends when inputs^T P, from which
    gains follow, has converged; what no input moves may converge later. Raises ValueError if that takes too
    long, as when a mode that costs cannot be stabilised.
    """
    a, g, h = transition, inputs * mp.inverse(input_cost) * inputs.T, state_cost
    identity = mp.eye(a.rows)
    for _ in range(_DOUBLINGS):
        try:
            solved = mp.inverse(identity + (g * h))
        except ZeroDivisionError:
            break
        grown = a.T * h * solved * a
        a, g, h = a * solved * a, g + (a * solved * g * a.T), h + grown
        if mp.mnorm(inputs.T * grown, "f") <= _CONVERGED * mp.mnorm(inputs.T * h, "f"):
            return (h + h.T) / 2
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
    power, total = transition, state_cost
    for digit in f"{steps:b}"[1:]:
        total, power = total + (power.T * total * power), power * power
        if digit == "1":
            total, power = state_cost + (transition.T * total * transition), transition * power
    return total + (power.T * to_go * power)
