"""Cost function: the Manhattan distance to the target and the variation of the moves (eq 12)."""

import numpy as np

from codegen.reference.math import Real, ordered_sum, sign
from codegen.reference.predictor import Prediction, Predictor


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

    Errors of one sign follow each other in runs, and the slope is summed by parts: where a run ends, the
    responses of all steps so far count with its sign, twice if another run follows, which takes them back.
    """
    scalar = errors_m.dtype.type
    run, distance = np.zeros_like(errors_m[0]), np.zeros_like(errors_m[0])
    slopes = np.zeros((*run.shape, predictor.response_sum.shape[1]), scalar)
    for error, responses in zip(errors_m, predictor.response_sum[:-1], strict=True):
        ends = np.where(error > 0, run < 0, (error < 0) & (run > 0))
        if np.any(ends):
            ended = np.where(ends, run, scalar(0))
            distance = distance + np.abs(ended)
            slopes = slopes + (sign(ended)[..., None] * responses)
            run = run - ended
        run = run + error
    distance = distance + np.abs(run)
    slopes = slopes + (sign(run)[..., None] * predictor.response_sum[-1])
    return distance[:, 0] + distance[:, 1], slopes
