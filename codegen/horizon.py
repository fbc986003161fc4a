"""Constant prediction tables: eqs 8-11 of the paper, solved over the horizon for a unit of tilt.

For a given heading and thrust the predicted position is affine in the moves,

    error(i) = free error(i) + gain * sum_j response[i, j] * move[j],

so the C never rolls the model out. All arithmetic is float64 in a fixed order; the exponential of the
attitude lag comes from `decimal`, which rounds alike on every machine. The tables are rounded to the
scalar type once, where they are spelled or loaded.
"""

from dataclasses import dataclass
from decimal import Decimal, localcontext

import numpy as np
from numpy.typing import NDArray

from codegen.settings import Settings


@dataclass(frozen=True)
class HorizonTables:
    """Prediction tables of one controller, float64; axes are ordered roll, pitch; row i is step i + 1.

    time_s:       (prediction,) time from now to each predicted step, in s.
    free_s2:      (prediction, 2) double time integral of a unit measured angle that decays to zero, in s^2;
                  all zero without attitude lag.
    response_s2:  (prediction, control, 2) double time integral of the angle that a unit move makes, in s^2;
                  the last move is held to the end of the horizon.
    """

    time_s: NDArray[np.float64]
    free_s2: NDArray[np.float64]
    response_s2: NDArray[np.float64]

    @property
    def has_lag(self) -> bool:
        """Tell whether the measured attitude enters the prediction."""
        return bool(np.any(self.free_s2))


@dataclass(frozen=True)
class _AxisStep:
    """One prediction step of an axis whose angle settles on its command with a first-order lag."""

    period_s: float
    decay: float
    velocity_s: float
    position_s2: float
    held_position_s2: float

    def advance(
        self, position: float, velocity: float, angle: float, command: float
    ) -> tuple[float, float, float]:
        deviation = angle - command
        return (
            ((position + (self.period_s * velocity)) + (self.held_position_s2 * command))
            + (self.position_s2 * deviation),
            (velocity + (self.period_s * command)) + (self.velocity_s * deviation),
            command + (self.decay * deviation),
        )


def horizon_tables(settings: Settings) -> HorizonTables:
    """Derive the prediction tables from the horizon and the model of `settings`."""
    prediction, control = settings.horizon.prediction, settings.horizon.control
    period_s = settings.horizon.prediction_step_s
    axes = [
        _axis_step(period_s, lag_s, printed=settings.model.position_update == "printed")
        for lag_s in (settings.model.roll_lag_s, settings.model.pitch_lag_s)
    ]
    response = np.empty((prediction, control, 2))
    free = np.empty((prediction, 2))
    for axis, step in enumerate(axes):
        free[:, axis] = _positions(step, 1.0, [0.0] * prediction)
        for move in range(control):
            last = prediction if move == control - 1 else move + 1
            commands = [1.0 if move <= i < last else 0.0 for i in range(prediction)]
            response[:, move, axis] = _positions(step, 0.0, commands)
    time_s = np.array([(i + 1) * period_s for i in range(prediction)])
    return HorizonTables(time_s=time_s, free_s2=free, response_s2=response)


def _axis_step(period_s: float, lag_s: float, *, printed: bool) -> _AxisStep:
    """Discretise one axis exactly; without lag this is eq 9 with its missing velocity update.

    `printed` takes the factor tau/2 of eq 9 as it stands in the paper.
    """
    held_position_s2 = period_s / 2 if printed else (period_s * period_s) / 2
    if lag_s == 0:
        return _AxisStep(period_s, 0.0, 0.0, 0.0, held_position_s2)
    with localcontext() as context:
        context.prec = 50
        period, lag = Decimal(period_s), Decimal(lag_s)
        decay = (-period / lag).exp()
        velocity = lag * (1 - decay)
        position = lag * (period - velocity)
        return _AxisStep(period_s, float(decay), float(velocity), float(position), held_position_s2)


def _positions(step: _AxisStep, angle: float, commands: list[float]) -> list[float]:
    position = velocity = 0.0
    positions = []
    for command in commands:
        position, velocity, angle = step.advance(position, velocity, angle, command)
        positions.append(position)
    return positions
