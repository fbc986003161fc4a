"""Optimizer: RPROP with a fixed number of iterations (Riedmiller and Braun 1993; Igel and Huesken 2000)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mambo_nmpc.codegen.reference.arithmetic import arithmetic
from mambo_nmpc.codegen.reference.math import Real, sign
from mambo_nmpc.codegen.settings.model import Settings

Evaluate = Callable[[Real], tuple[Real, Real]]
"""Moves (n, control, 2) -> cost (n,) and gradient (n, control, 2)."""


@dataclass(frozen=True)
class Search:
    """Where a search ended, for n controllers.

    moves_rad:   (n, control, 2) the plan.
    cost:        (n,) cost of the plan that the last iteration evaluated, before its own update.
    gradient:    (n, control, 2) gradient of that plan, per rad.
    iterations:  (n,) updates made before the search converged.
    converged:   (n,) whether the cost came to rest within the tolerance.
    """

    moves_rad: Real
    cost: Real
    gradient: Real
    iterations: NDArray[np.int64]
    converged: NDArray[np.bool_]


Minimize = Callable[[Settings, Evaluate, Real], Search]
"""The interface of `minimize`."""


def minimize(settings: Settings, evaluate: Evaluate, moves_rad: Real) -> Search:
    """Search from `moves_rad` for exactly `optimizer.iterations` evaluations.

    Once the cost changes by less than the tolerance the plan is frozen; the evaluations go on.
    """
    scalar, products = moves_rad.dtype.type, arithmetic(settings)
    optimizer, numbers = settings.optimizer, products.numbers
    step_max, step_min = (
        numbers.constant(step, "angle") for step in (optimizer.step_max_rad, optimizer.step_min_rad)
    )
    increase, decrease = (
        numbers.constant(factor, "factor") for factor in (optimizer.increase, optimizer.decrease)
    )
    tolerance = numbers.constant(optimizer.tolerance, "cost")
    limit = numbers.constant(settings.limits.tilt_rad, "angle")
    step = np.full_like(moves_rad, numbers.constant(optimizer.initial_step_rad, "angle"))
    direction = np.zeros_like(moves_rad)
    before = moves_rad
    cost = np.zeros(len(moves_rad), dtype=scalar)
    gradient = np.zeros_like(moves_rad)
    iterations = np.zeros(len(moves_rad), dtype=np.int64)
    converged = np.zeros(len(moves_rad), dtype=np.bool_)

    for iteration in range(optimizer.iterations):
        previous_cost = cost
        cost, gradient = evaluate(moves_rad)
        if iteration > 0:
            converged = converged | (np.abs(cost - previous_cost) < tolerance)
        iterations = iterations + ~converged

        slope = sign(gradient)
        active = ~converged[:, None, None]
        onward = active & ((slope * direction) > 0)
        across = active & ((slope * direction) < 0)
        ahead = active & ~across

        longer = np.minimum(products.scaled(step, increase), step_max)
        shorter = np.maximum(products.scaled(step, decrease), step_min)
        step = np.where(onward, longer, np.where(across, shorter, step))
        moved = np.minimum(np.maximum(moves_rad - (slope * step), -limit), limit)
        stepped_back = before if optimizer.variant == "rprop+" else moves_rad
        before = np.where(ahead, moves_rad, before)
        moves_rad = np.where(ahead, moved, np.where(across, stepped_back, moves_rad))
        direction = np.where(ahead, slope, np.where(across, scalar(0), direction))
    return Search(moves_rad, cost, gradient, iterations, converged)
