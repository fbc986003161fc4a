"""Constants of the prediction: eqs 8-11 of the paper, discretised for the steps of the horizon.

Along each axis of the world the predicted error follows a recurrence that nmpc.c derives: a step
adds the displacement to the error, and the acceleration, in metres per squared prediction step, to the
displacement. The acceleration changes only where a move changes the tilt. With attitude lag a correction, the
deficit, is added to the acceleration; it decays from step to step. So the roll-out takes two additions a
step, and two more and two products with lag; only the gradient of the distance needs a table.

All arithmetic is float64 in a fixed order; the exponential of the lag comes from `decimal`, because
`math.exp` rounds differently between machines. Constants are rounded to the scalar type once, when they are
spelled as C or loaded by the reference.
"""

from dataclasses import dataclass
from decimal import Decimal, localcontext

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.settings.sections import Horizon, Sections


@dataclass(frozen=True)
class AngleConstants:
    """How the recurrence answers a change of acceleration that roll or pitch follows with its lag.

    With h = step / lag and c = 1 - exp(-h):

    displacement_share: share of the change in the displacement of the same step, 1/2 - (h - c)/h^2.
    deficit_share:      share of the change that the deficit takes, (c/h)^2.
    deficit_decay:      factor of the deficit from one step to the next, exp(-h).
    """

    displacement_share: float
    deficit_share: float
    deficit_decay: float


@dataclass(frozen=True)
class HorizonTables:
    """Prediction constants of one controller, float64.

    step_squared_s2:    tau^2, square of the prediction step, in s^2.
    displacement_share: share of a constant acceleration that displaces the drone within the same step:
                        1/2, from tau^2/2 in eq 9, or 1/(2 tau) as printed.
    angles:             roll and pitch.
    has_lag:            whether the measured attitude enters the prediction.
    angles_per_response: angles that share a response: 2 if both lags are equal, else 1.
    response_sum:       (prediction, responses). The response R(i) of a move is the change of the error at the
                        end of step i per unit of its acceleration, the last move being held. With S(i) =
                        R(0) + ... + R(i), row i holds 2 S(i), and the last row S. Columns: roll, pitch of
                        step 0 of the control horizon, then of step 1 ...; one a step if the lags are equal.
    """

    step_squared_s2: float
    displacement_share: float
    angles: tuple[AngleConstants, AngleConstants]
    has_lag: bool
    angles_per_response: int
    response_sum: NDArray[np.float64]

    @property
    def halves(self) -> bool:
        """Whether every displacement share is 1/2: no lag, and tau^2/2 in eq 9."""
        return not self.has_lag and self.displacement_share == 0.5


def horizon_tables(settings: Sections) -> HorizonTables:
    """Derive the prediction constants from the horizon and the model of `settings`."""
    model, period_s = settings.model, settings.horizon.prediction_step_s
    step_squared_s2 = period_s * period_s
    share = 0.5 if model.position_update == "exact" else 0.5 / period_s
    lags_s = roll_lag_s, pitch_lag_s = shortened_lags_s(settings)
    roll, pitch = (_angle(period_s, lag_s, share) for lag_s in lags_s)
    same_lag = roll_lag_s == pitch_lag_s
    return HorizonTables(
        step_squared_s2=step_squared_s2,
        displacement_share=share,
        angles=(roll, pitch),
        has_lag=max(lags_s) > 0,
        angles_per_response=2 if same_lag else 1,
        response_sum=_response_sum(settings.horizon, (roll,) if same_lag else (roll, pitch)),
    )


def shortened_lags_s(settings: Sections) -> tuple[float, float]:
    """Return the attitude lags of roll and pitch, which the feedback of their rates shortens; 0 for none."""
    model, damping = settings.model, settings.damping
    return (
        model.roll_lag_s and model.roll_lag_s - damping.roll_rate_feedback_s,
        model.pitch_lag_s and model.pitch_lag_s - damping.pitch_rate_feedback_s,
    )


def _angle(period_s: float, lag_s: float, share: float) -> AngleConstants:
    """Discretise exactly an angle that follows its command with a first-order lag.

    Let h = step / lag and c = 1 - exp(-h). One prediction step after a unit step of the command, the lag has
    withheld h - c of the position and c of the velocity, in units of the lag. So it withholds
    (h * c) - (c * (h - c)) = c^2 of the second difference of the position.
    """
    if lag_s == 0:
        return AngleConstants(displacement_share=share, deficit_share=0.0, deficit_decay=0.0)
    with localcontext() as context:
        context.prec = 50
        h = Decimal(period_s) / Decimal(lag_s)
        decay = (-h).exp()
        c = 1 - decay
        return AngleConstants(
            displacement_share=share - float((h - c) / (h * h)),
            deficit_share=float((c * c) / (h * h)),
            deficit_decay=float(decay),
        )


def _response_sum(horizon: Horizon, angles: tuple[AngleConstants, ...]) -> NDArray[np.float64]:
    """Roll out a unit of acceleration of each move, which ends at the next move, and sum the errors."""
    sums = np.zeros((horizon.prediction, horizon.control, len(angles)))
    for angle, constants in enumerate(angles):
        for move in range(horizon.control):
            total = error = displacement = acceleration = deficit = 0.0
            for step in range(horizon.prediction):
                change = float(step == move) - float(step == move + 1 < horizon.control)
                displacement = displacement + (constants.displacement_share * change)
                acceleration = acceleration + change
                deficit = deficit - (constants.deficit_share * change)
                error = error + displacement
                displacement = displacement + (acceleration + deficit)
                deficit = deficit * constants.deficit_decay
                total = total + error
                sums[step, move, angle] = total
    sums[:-1] *= 2
    return sums.reshape(horizon.prediction, -1)
