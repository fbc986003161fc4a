"""Cost function: the Manhattan distance to the target and the variation of the moves (eq 12)."""

import numpy as np

from mambo_nmpc.codegen.reference.math import Real, ordered_sum, sign
from mambo_nmpc.codegen.reference.predictor import Prediction, Predictor


def evaluate(
    predictor: Predictor,
    prediction: Prediction,
    weights: Real,
    moves_rad: Real,
    last_command_rad: Real,
) -> tuple[Real, Real]:
    """Return the cost (n,) and its subgradient (n, control, 2) at `moves_rad` (n, control, 2).

    weights is (n, 2): lambda1 in 1/m, lambda2 in 1/rad; last_command_rad (n, 2) precedes the first move.
    """
    arithmetic = predictor.arithmetic
    distance, slopes = _distance(predictor, predictor.errors(prediction, moves_rad))
    by_move = np.repeat(slopes, predictor.axes_alike, axis=2).reshape(*slopes.shape[:2], -1, 2)
    tracking = arithmetic.distance_slope(prediction.gain_m[:, :, None], by_move)

    change = moves_rad - np.concatenate([last_command_rad[:, None], moves_rad[:, :-1]], axis=1)
    variation = ordered_sum(np.abs(change).swapaxes(1, 2).reshape(len(change), -1), axis=1)
    effort = arithmetic.effort_slope(weights[:, 1, None, None]) * sign(change)

    cost = arithmetic.tracking_cost(weights[:, 0], distance) + arithmetic.effort_cost(
        weights[:, 1], variation
    )
    gradient = arithmetic.tracking_slope(weights[:, 0, None, None], tracking) + effort
    gradient[:, :-1] = gradient[:, :-1] - effort[:, 1:]
    return cost, gradient


def _distance(predictor: Predictor, errors_m: Real) -> tuple[Real, Real]:
    """Add up the sizes of the errors (prediction, n, 2): (n,), and their slopes (n, 2, responses).

    A slope, by the bend of a move, is the sum of the responses of all steps, each with the sign of its error.
    It is summed by parts, from the last part to the first: with S(i) the sum of responses of steps 0..i,
    signs + + - - give 2 S(1) - S(3); `response_sum` holds 2 S(i), in its last row S. The sign of an error is
    its sign bit; errors that are all zero have no slope.
    """
    scalar = errors_m.dtype.type
    distance = ordered_sum(np.abs(errors_m), axis=0)
    below = np.signbit(errors_m) if errors_m.dtype.kind == "f" else errors_m < 0
    changes = below[1:] != below[:-1]
    slopes = np.broadcast_to(predictor.response_sum[-1], (*distance.shape, predictor.response_sum.shape[1]))
    for change, responses in zip(changes[::-1], predictor.response_sum[-2::-1], strict=True):
        slopes = np.where(change[..., None], responses - slopes, slopes)
    sign_of_first = np.where(distance == 0, scalar(0), np.where(below[0], scalar(-1), scalar(1)))
    return distance[:, 0] + distance[:, 1], sign_of_first[..., None] * slopes
