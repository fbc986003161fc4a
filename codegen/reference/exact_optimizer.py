"""Optimizer of the quadratic cost: its exact minimum in a box, along both axes of the heading."""

import numpy as np

from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.reference.exact_arithmetic import ExactArithmetic
from mambo_nmpc.codegen.reference.math import Real, clamp


class ExactOptimizer:
    """The constants of the minimum, in the scalar type of the controller."""

    def __init__(self, design: Design, arithmetic: ExactArithmetic, limit: Real) -> None:
        numbers, law = arithmetic.numbers, design.law
        self._products = arithmetic
        self._limit = limit
        self._rows = numbers.row_constants(law.rows)
        self._ratios = np.array([[numbers.constant(ratio, "ratio") for ratio in axis] for axis in law.ratios])

    def minimize(self, state: Real) -> Real:
        """Return the first free move (n, 2), right and forward, from states (n, 2, 8)."""
        moves = [self._row_product(self._rows[:, move], state) for move in range(self._rows.shape[1])]
        first = moves[0]
        first_limited = clamp(first, self._limit)
        if len(moves) == 1:
            return first_limited
        second = moves[1]
        product = self._products.ratio_product
        first_change = first_limited - first
        second_limited = clamp(second, self._limit)
        second_change = second_limited - second
        beside = clamp(first - product(self._ratios[:, 0], second_change), self._limit)
        other = clamp(second - product(self._ratios[:, 1], first_change), self._limit)
        first_wins = self._excess(first_change, other - second) < self._excess(beside - first, second_change)
        both = (first_limited != first) & first_wins
        chosen: Real = np.where(
            second_limited != second, np.where(both, first_limited, beside), first_limited
        )
        return chosen

    def _row_product(self, rows: Real, state: Real) -> Real:
        total = rows[:, 0] * state[:, :, 0]
        for k in range(1, rows.shape[1]):
            total = total + (rows[:, k] * state[:, :, k])
        return self._products.row_sum(total)

    def _excess(self, first: Real, second: Real) -> Real:
        """Return the cost above the minimum without limits, of moves that differ from it by these."""
        cross = self._products.ratio_product(self._ratios[:, 0], second) * first
        square = self._products.ratio_product(self._ratios[:, 2], second) * second
        excess: Real = ((first * first) + (cross + cross)) + square
        return excess
