"""Cost function: the Manhattan distance to the target and the variation of the moves (eq 12)."""

import numpy as np

from codegen.reference.math import Real, ordered_sum, sign
from codegen.reference.predictor import Prediction, Predictor


def evaluate(
    predictor: Predictor, prediction: Prediction, weights: Real, moves_rad: Real, last_command_rad: Real
) -> tuple[Real, Real]:
    """Return the cost (n,) and its subgradient (n, control, 2) at `moves_rad` (n, control, 2).

    weights is (n, 2): lambda1 in 1/m, lambda2 in 1/rad; last_command_rad (n, 2) precedes the first move.
    """
    error = predictor.error(prediction, moves_rad)
    distance = ordered_sum(np.abs(error[:, 0]) + np.abs(error[:, 1]), axis=1)
    tracking = predictor.gradient(prediction, sign(error))

    change = moves_rad - np.concatenate([last_command_rad[:, None], moves_rad[:, :-1]], axis=1)
    variation = ordered_sum(np.abs(change).reshape(len(change), -1), axis=1)
    effort = weights[:, 1, None, None] * sign(change)

    cost = (weights[:, 0] * distance) + (weights[:, 1] * variation)
    gradient = (weights[:, 0, None, None] * tracking) + effort
    gradient[:, :-1] = gradient[:, :-1] - effort[:, 1:]
    return cost, gradient
