"""Constants of the prediction: eqs 8-11 of the paper, solved for steps of the horizon.

For a given heading and thrust the predicted error is affine in the moves, and along each axis of the world
it has few differences: a step adds the advance to the error and the bend to the advance. The bend is
acceleration times the squared prediction step, less what an attitude with lag has yet to come. So the C rolls
the model out with two additions a step, two more and two multiplications with lag, and reads from a table
only what the slope of the distance needs.

All arithmetic is float64 in a fixed order; the exponential of the lag comes from `decimal`, which rounds
alike on every machine. Constants are rounded to the scalar type once, where they are spelled or loaded.
"""

from dataclasses import dataclass
from decimal import Decimal, localcontext

import numpy as np
from numpy.typing import NDArray

from mambo_nmpc.codegen.settings.sections import Horizon, Sections


@dataclass(frozen=True)
class AxisConstants:
    """How roll or pitch settles after a turn; shares of the bend that the turn ends in.

    at_once: what the turn adds to the next step's advance.
    delayed: what the bend lacks in the step of the turn.
    decay:   what of that remains a step later.
    """

    at_once: float
    delayed: float
    decay: float


@dataclass(frozen=True)
class HorizonTables:
    """Prediction constants of one controller, float64.

    step_squared_s2: square of the prediction step, in s^2: a tilt's bend per acceleration.
    held:            share of the bend that a tilt held before the first step adds to its advance.
    axes:            roll and pitch.
    has_lag:         whether the measured attitude enters the prediction.
    axes_alike:      axes that share a response, 2 if both lags are equal, else 1.
    response_sum:    (prediction, responses) sum, over all steps to each, of how far a unit of bend of each
                     move has carried the error; twice that, but for the last step. Moves are ordered roll,
                     pitch of the first, and so on; where both axes settle alike, each pair of moves shares
                     one response. The last move is held to the end.
    """

    step_squared_s2: float
    held: float
    axes: tuple[AxisConstants, AxisConstants]
    has_lag: bool
    axes_alike: int
    response_sum: NDArray[np.float64]

    @property
    def halves(self) -> bool:
        """Whether every turn adds half of its bend to the next advance: no lag, and exact positions."""
        return not self.has_lag and self.held == 0.5


def horizon_tables(settings: Sections) -> HorizonTables:
    """Derive the prediction constants from the horizon and the model of `settings`."""
    model, period_s = settings.model, settings.horizon.prediction_step_s
    step_squared_s2 = period_s * period_s
    held = 0.5 if model.position_update == "exact" else 0.5 / period_s
    roll, pitch = (_axis(period_s, lag_s, held) for lag_s in (model.roll_lag_s, model.pitch_lag_s))
    alike = model.roll_lag_s == model.pitch_lag_s
    return HorizonTables(
        step_squared_s2=step_squared_s2,
        held=held,
        axes=(roll, pitch),
        has_lag=model.roll_lag_s > 0 or model.pitch_lag_s > 0,
        axes_alike=2 if alike else 1,
        response_sum=_response_sum(settings.horizon, (roll,) if alike else (roll, pitch)),
    )


def _axis(period_s: float, lag_s: float, held: float) -> AxisConstants:
    """Discretise one axis exactly, an angle that settles on its command with a first-order lag.

    With the lag as unit of time, a step d and what settles in it, e = 1 - exp(-d), position lacks d - e after
    a step and velocity e, so that the second difference lacks (d * e) - (e * (d - e)) = e^2.
    """
    if lag_s == 0:
        return AxisConstants(at_once=held, delayed=0.0, decay=0.0)
    with localcontext() as context:
        context.prec = 50
        step = Decimal(period_s) / Decimal(lag_s)
        decay = (-step).exp()
        settled = 1 - decay
        return AxisConstants(
            at_once=held - float((step - settled) / (step * step)),
            delayed=float((settled * settled) / (step * step)),
            decay=float(decay),
        )


def _response_sum(horizon: Horizon, axes: tuple[AxisConstants, ...]) -> NDArray[np.float64]:
    """Walk with a unit of bend of each move, taken back by the next, and add up the errors twice."""
    sums = np.zeros((horizon.prediction, horizon.control, len(axes)))
    for axis, constants in enumerate(axes):
        for move in range(horizon.control):
            total = error = advance = bend = to_come = 0.0
            for step in range(horizon.prediction):
                turn = float(step == move) - float(step == move + 1 < horizon.control)
                advance = advance + (constants.at_once * turn)
                bend = bend + turn
                to_come = to_come - (constants.delayed * turn)
                error = error + advance
                advance = advance + (bend + to_come)
                to_come = to_come * constants.decay
                total = total + error
                sums[step, move, axis] = total
    sums[:-1] *= 2
    return sums.reshape(horizon.prediction, -1)
