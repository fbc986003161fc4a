"""Optimizer of the quadratic cost: its minimum in a box, along both axes of the heading."""

from typing import Final

import numpy as np

from mambo_codegen.methods.quadratic.arithmetic import QuadraticArithmetic
from mambo_codegen.methods.quadratic.axis import row_product
from mambo_codegen.methods.quadratic.constants import QuadraticConstants
from mambo_codegen.methods.quadratic.law import STATES
from mambo_codegen.methods.shared.inputs import Rows
from mambo_codegen.methods.shared.math import Real, clamp

ROW_QUANTITIES: Final = tuple(f"row_{state}" for state in STATES)
"""The quantity of each gain of a row."""


class QuadraticOptimizer:
    """The constants of the minimum, in the scalar type of the controller."""

    def __init__(self, constants: QuadraticConstants, arithmetic: QuadraticArithmetic, limit: Real) -> None:
        numbers, law, quantities = arithmetic.numbers, constants.law, ROW_QUANTITIES
        self._products = arithmetic
        self._limit = limit
        self._rows = np.array(
            [
                [
                    [numbers.constant(value, name) for value, name in zip(row, quantities, strict=True)]
                    for row in axis
                ]
                for axis in law.rows
            ]
        )
        self._ratios = np.array([numbers.constant(ratio, "ratio") for ratio in law.ratios])
        self.deciding: Rows = np.zeros((0, 8), np.bool_)
        """Of the last moves (n, 8): whether no limit decided each, whether the second row did; the same where
        no state was 0."""

    def minimize(self, state: Real, limit: Real | None = None) -> Real:
        """Return the first free move (n, 2), right and forward, from states (n, 2, k) of `STATES`.

        limit, (2,) or (n, 2), is that of the moves; None for that of the settings.
        """
        limit = self._limit if limit is None else limit
        moves = [
            row_product(self._products, list(self._rows[:, move].T), list(np.moveaxis(state, 2, 0)))
            for move in range(self._rows.shape[1])
        ]
        first, limited = moves[0], moves[-1]
        best = first
        if len(moves) > 1:
            limited = clamp(moves[1], limit)
            best = first - self._products.ratio_product(self._ratios, limited - moves[1])
            best = np.where(limited == moves[1], first, best)
        move = clamp(best, limit)
        decided, whole = move == best, np.all(state != 0, axis=2)
        used = np.concatenate([decided, decided & (limited != moves[-1])], axis=1)
        self.deciding = np.concatenate([used, used & np.tile(whole, 2)], axis=1)
        return move
