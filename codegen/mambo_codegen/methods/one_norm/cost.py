"""Cost function: the Manhattan distance to the target and the change of the moves (eq 12)."""

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.one_norm.predictor import Prediction, Predictor
from mambo_codegen.methods.shared.math import Real, ordered_sum


def evaluate(
    predictor: Predictor,
    prediction: Prediction,
    weights: Real,
    moves_rad: Real,
    last_command_rad: Real,
) -> tuple[Real, Real]:
    """Return the cost (n,) and its subgradient (n, control, 2) at `moves_rad` (n, control, 2).

    weights is (n, 2): lambda_1 in 1/m, lambda_2 in 1/rad; last_command_rad (n, 2) precedes the first move.
    """
    arithmetic = predictor.arithmetic
    distance, subgradient = distance_subgradient(predictor, predictor.errors(prediction, moves_rad))
    by_move = np.repeat(subgradient, predictor.angles_per_response, axis=2).reshape(
        *subgradient.shape[:2], -1, 2
    )
    distance_gradient = arithmetic.distance_gradient(prediction.gain_m_step2_rad[:, :, None], by_move)

    change = moves_rad - np.concatenate([last_command_rad[:, None], moves_rad[:, :-1]], axis=1)
    variation = ordered_sum(np.abs(change).swapaxes(1, 2).reshape(len(change), -1), axis=1)
    slope = arithmetic.effort_gradient(weights[:, 1, None, None])
    effort = np.where(change > 0, slope, np.where(change < 0, -slope, np.zeros_like(slope)))

    cost = arithmetic.tracking_cost(weights[:, 0], distance) + arithmetic.effort_cost(
        weights[:, 1], variation
    )
    gradient = arithmetic.tracking_gradient(weights[:, 0, None, None], distance_gradient) + effort
    gradient[:, :-1] = gradient[:, :-1] - effort[:, 1:]
    return cost, gradient


def distance_subgradient(predictor: Predictor, errors_m: Real) -> tuple[Real, Real]:
    """Return the distance (n,) for errors (prediction, n, 2), and its subgradient (n, 2, responses).

    The subgradient with respect to the acceleration of a move is the sum over the horizon of the response to
    the move, each term with the sign of the error at that step. With S(i) the sum of the response of steps
    0..i, four errors with the signs + + - - give 2 S(1) - S(3); `response_sum` holds 2 S(i), and S in its
    last row. The loop goes from the last change of sign to the first, as if the first error were positive;
    then the result is multiplied by the sign of the first error. The sign of an error is its sign bit; if all
    errors are zero so is the subgradient.
    """
    scalar = errors_m.dtype.type
    distance = ordered_sum(np.abs(errors_m), axis=0)
    negative = _is_negative(errors_m)
    changes = negative[1:] != negative[:-1]
    subgradient = np.tile(predictor.response_sum[-1], (*distance.shape, 1))
    rows = subgradient.reshape(-1, subgradient.shape[-1])
    for step in np.flatnonzero(changes.any(axis=(1, 2)))[::-1]:
        changed = np.flatnonzero(changes[step])
        rows[changed] = predictor.response_sum[step] - rows[changed]
    first_sign = np.where(distance == 0, scalar(0), np.where(negative[0], scalar(-1), scalar(1)))
    return distance[:, 0] + distance[:, 1], first_sign[..., None] * subgradient


def rows_used(errors_m: Real) -> NDArray[np.bool_]:
    """Return of which rows of `response_sum` the subgradient for errors (prediction, n, 2) consists.

    The shape is (n, prediction).
    """
    negative = _is_negative(errors_m)
    last = np.ones_like(negative[:1])
    used = np.concatenate([negative[1:] != negative[:-1], last]) & np.any(errors_m != 0, axis=0)
    rows: NDArray[np.bool_] = np.any(used, axis=2).T
    return rows


def _is_negative(errors_m: Real) -> NDArray[np.bool_]:
    """Return the sign bits of errors."""
    return np.signbit(errors_m) if errors_m.dtype.kind == "f" else errors_m < 0
