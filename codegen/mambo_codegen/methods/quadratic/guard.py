"""Guard: budgets that bound how much the commands vary."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.quadratic.arithmetic import QuadraticArithmetic
from mambo_codegen.methods.shared.math import Real, clamp


class VariationBudget:
    """How much a command may vary at once, and how much more with each control step."""

    def __init__(self, arithmetic: QuadraticArithmetic, full: float, growth: float, quantity: str) -> None:
        self.full: Any = arithmetic.numbers.constant(full, quantity)
        self._growth = arithmetic.numbers.constant(growth, quantity)
        self.is_enough: NDArray[np.bool_] = np.ones(1, np.bool_)
        """Whether the last commands are those wanted."""

    def spend(self, budget: Real, before: Real, wanted: Real) -> tuple[Real, Real]:
        """Return the commands nearest to those wanted that the budgets allow, and what is left of these.

        `before` are the last commands; all have one shape.
        """
        allowed = np.minimum(budget + self._growth, self.full)
        change = clamp(wanted - before, allowed)
        self.is_enough = np.abs(wanted - before) <= allowed
        command = np.where(self.is_enough, wanted, before + change)
        return command, allowed - np.abs(change)
