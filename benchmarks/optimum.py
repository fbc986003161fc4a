"""Quality of a plan: its cost relative to the optimum for the same input, computed by SciPy.

An input (6,) is the error x, vx, y, vy and the last command, which is also the initial tilt of a lag, at
heading 0 and a thrust of 9.81 m/s2. With `ours.PEERS_MODEL` this is `benchmarks.problem`.
"""

from typing import Any

import numpy as np
from scipy.optimize import lsq_linear

from benchmarks.problem import GRAVITY_M_S2
from benchmarks.programs import Cost
from benchmarks.searches import Array, CostModel, Problems
from mambo_codegen.settings.model import Settings


def problems(settings: Settings, inputs: Array) -> Problems:
    """Return the optimisation problems of the controller of `settings` for `inputs` (n, 6)."""
    x, vx, y, vy, roll, pitch = inputs.T
    level = np.zeros(len(inputs))
    return CostModel(settings).problems(
        np.column_stack([x, y, vx, vy, roll, pitch, level]),
        np.zeros((len(inputs), 4)),
        level + GRAVITY_M_S2,
        inputs[:, 4:],
    )


def costs(kind: Cost, settings: Settings, inputs: Array, moves: Array) -> Array:
    """Return the cost (n,) of plans `moves` (n, 4) for `inputs` (n, 6)."""
    found = problems(settings, inputs)
    if kind == "1-norm":
        return found.cost(moves)
    squares: Array = (found.rows(moves) ** 2 / _weights(settings)).sum(axis=1)
    return squares


def solve(kind: Cost, settings: Settings, inputs: Array) -> Array:
    """Return the optimal plans (n, 4) within the tilt limit for `inputs` (n, 6)."""
    found = problems(settings, inputs)
    if kind == "1-norm":
        return found.optima().reshape(len(inputs), -1)
    root, limit_rad = np.sqrt(_weights(settings)), found.limit_rad
    plans: list[Any] = [
        lsq_linear(slope / root[:, None], -offset / root, (-limit_rad, limit_rad), method="bvls", tol=1e-14).x
        for slope, offset in zip(found.slope, found.offset, strict=True)
    ]
    return np.array(plans)


def excess(kind: Cost, settings: Settings, inputs: Array, plans: Array) -> Array:
    """Return the excess (n,) of the cost of `plans` (n, 4), clipped to the tilt limit, over the optimum."""
    inputs, plans = inputs.astype(np.float64), plans.astype(np.float64)
    limit_rad = settings.limits.tilt_rad
    least = costs(kind, settings, inputs, solve(kind, settings, inputs))
    found: Array = costs(kind, settings, inputs, np.clip(plans, -limit_rad, limit_rad)) / least - 1
    return found


def _weights(settings: Settings) -> Array:
    """Return the weight of every row; a weighted square is (w e)^2 / w."""
    horizon, cost = settings.horizon, settings.cost
    errors = np.full(2 * horizon.prediction, cost.tracking_weight)
    return np.concatenate([errors, np.full(2 * horizon.control, cost.effort_weight)])
