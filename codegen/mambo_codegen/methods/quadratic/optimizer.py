"""Optimizer of the quadratic cost: its minimum in a box, along both axes of the heading."""

from typing import Final

import numpy as np

from mambo_codegen.methods.quadratic.arithmetic import QuadraticArithmetic
from mambo_codegen.methods.quadratic.constants import QuadraticConstants
from mambo_codegen.methods.quadratic.law import STATES
from mambo_codegen.methods.shared.math import Real, clamp

ROW: Final = tuple(f"row_{state}" for state in STATES)
"""The quantity of each gain of a row."""


class QuadraticOptimizer:
    """The constants of the minimum, in the scalar type of the controller."""

    def __init__(self, constants: QuadraticConstants, arithmetic: QuadraticArithmetic, limit: Real) -> None:
        numbers, law = arithmetic.numbers, constants.law
        self._products = arithmetic
        self._limit = limit
        self._rows = np.array(
            [
                [
                    [numbers.constant(value, name) for value, name in zip(row, ROW, strict=True)]
                    for row in axis
                ]
                for axis in law.rows
            ]
        )
        self._ratios = np.array([numbers.constant(ratio, "ratio") for ratio in law.ratios])

    def minimize(self, state: Real, limit: Real | None = None) -> Real:
        """Return the first free move (n, 2), right and forward, from states (n, 2, 8).

        limit, (2,) or (n, 2), is that of the moves; None for that of the settings.
        """
        limit = self._limit if limit is None else limit
        moves = [self._row_product(self._rows[:, move], state) for move in range(self._rows.shape[1])]
        if len(moves) == 1:
            return clamp(moves[0], limit)
        first, second = moves
        limited = clamp(second, limit)
        best = first - self._products.ratio_product(self._ratios, limited - second)
        return clamp(np.where(limited == second, first, best), limit)

    def _row_product(self, rows: Real, state: Real) -> Real:
        total = rows[:, 0] * state[:, :, 0]
        for k in range(1, rows.shape[1]):
            total = total + (rows[:, k] * state[:, :, k])
        return self._products.row_sum(total)
