"""Optimizer: RPROP with a fixed number of iterations (Riedmiller and Braun 1993; Igel and Huesken 2000)."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.one_norm.arithmetic import OneNormArithmetic
from mambo_codegen.methods.shared.math import Real, sign
from mambo_codegen.settings.sections import Sections

Evaluate = Callable[[Real], tuple[Real, Real]]
"""Moves (n, control, 2) -> cost (n,) and gradient (n, control, 2)."""


@dataclass(frozen=True)
class Search:
    """Result of a search, for n controllers.

    moves_rad:   (n, control, 2) the plan.
    cost:        (n,) cost of the plan that the last iteration evaluated, before its update.
    gradient:    (n, control, 2) gradient of that plan, per rad.
    iterations:  (n,) updates made before the search converged.
    converged:   (n,) whether the cost changed by less than the tolerance between two iterations.
    """

    moves_rad: Real
    cost: Real
    gradient: Real
    iterations: NDArray[np.int64]
    converged: NDArray[np.bool_]


class Rprop:
    """The search of one controller; its constants are numbers of that controller."""

    def __init__(self, settings: Sections, arithmetic: OneNormArithmetic) -> None:
        optimizer, constant = settings.optimizer, arithmetic.numbers.constant
        self._arithmetic = arithmetic
        self._backtracking = optimizer.variant == "rprop+"
        self._iterations = optimizer.iterations
        self._increase, self._decrease = (
            constant(factor, "factor") for factor in (optimizer.increase, optimizer.decrease)
        )
        self.initial_step, self._step_max, self._step_min = (
            constant(step, "angle")
            for step in (optimizer.initial_step_rad, optimizer.step_max_rad, optimizer.step_min_rad)
        )
        self.tolerance = constant(optimizer.tolerance, "cost")
        self.limit: Any = constant(settings.limits.tilt_rad, "angle")
        """The tilt limit, or the limits of controllers (n, 1, 1)."""

    def next_step(self, step: Real, agreement: Real) -> Real:
        """Return the next step sizes: grown where the gradient keeps its sign, shrunk where the sign changes.

        agreement, of the shape of `step`, is this sign times the previous one; where it is 0 the size stays.
        """
        longer = np.minimum(self._arithmetic.step_product(step, self._increase), self._step_max)
        shorter = np.maximum(self._arithmetic.step_product(step, self._decrease), self._step_min)
        return np.where(agreement > 0, longer, np.where(agreement < 0, shorter, step))

    def minimize(self, evaluate: Evaluate, moves_rad: Real) -> Search:
        """Search from `moves_rad` for exactly `optimizer.iterations` evaluations.

        Once the cost changes by less than the tolerance, the signs of the gradient are taken as 0: the plan
        is frozen, the remaining iterations still run (constant time).
        """
        scalar = moves_rad.dtype.type
        step = np.full_like(moves_rad, self.initial_step)
        previous_sign = np.zeros_like(moves_rad)
        previous = moves_rad
        cost = np.zeros(len(moves_rad), dtype=scalar)
        gradient = np.zeros_like(moves_rad)
        iterations = np.zeros(len(moves_rad), dtype=np.int64)
        converged = np.zeros(len(moves_rad), dtype=np.bool_)

        for iteration in range(self._iterations):
            previous_cost = cost
            cost, gradient = evaluate(moves_rad)
            if iteration > 0:
                converged = converged | (np.abs(cost - previous_cost) < self.tolerance)
            iterations = iterations + ~converged

            signs = np.where(converged[:, None, None], scalar(0), sign(gradient))
            agreement = signs * previous_sign
            step = self.next_step(step, agreement)
            moving = agreement >= 0
            moved = np.minimum(np.maximum(moves_rad - (signs * step), -self.limit), self.limit)
            stepped_back = previous if self._backtracking else moves_rad
            previous = np.where(moving, moves_rad, previous)
            moves_rad = np.where(moving, moved, stepped_back)
            previous_sign = np.where(moving, signs, scalar(0))
        return Search(moves_rad, cost, gradient, iterations, converged)


Minimize = Callable[[Rprop, Evaluate, Real], Search]
"""The interface of `Rprop.minimize`."""
