"""Predictor: how far robot and target will be apart, given the moves (eqs 8-11)."""

from dataclasses import dataclass

import numpy as np

from codegen.horizon import HorizonTables
from codegen.reference.math import Real, ordered_sum, sine_cosine
from codegen.settings import Settings
from codegen.trigonometry import trigonometry


@dataclass(frozen=True)
class Prediction:
    """What a control step knows before it chooses moves, for n controllers.

    gain_m_s2:     (n, 2, 2) acceleration along world x, y per radian of roll, pitch (eq 8).
    free_error_m:  (n, 2, prediction) position less target along x, y if all moves were zero.
    """

    gain_m_s2: Real
    free_error_m: Real


class Predictor:
    """The prediction tables of one set of settings, in its scalar type."""

    def __init__(self, settings: Settings, tables: HorizonTables, scalar: type[np.floating]) -> None:
        self._time_s = tables.time_s.astype(scalar)
        self._free_s2 = tables.free_s2.T.astype(scalar)
        self._response_s2 = np.moveaxis(tables.response_s2, 2, 0).astype(scalar)
        self._has_lag = tables.has_lag
        self._printed_yaw = settings.model.yaw_convention == "printed"
        self._trigonometry = trigonometry(settings.code.scalar)

    def prepare(self, state: Real, target: Real, thrust_acceleration_m_s2: Real) -> Prediction:
        """Evaluate eq 8 at the present heading and thrust, and roll robot and target out without moves.

        state is (n, 7), target (n, 4) and thrust_acceleration_m_s2 (n,).
        """
        sine, cosine = sine_cosine(state[:, 6], self._trigonometry)
        across = thrust_acceleration_m_s2 * sine
        along = thrust_acceleration_m_s2 * cosine
        turned = across if self._printed_yaw else -across
        gain = np.stack([np.stack([turned, -along], 1), np.stack([along, turned], 1)], 1)
        position_error = state[:, 0:2] - target[:, 0:2]
        velocity_error = state[:, 2:4] - target[:, 2:4]
        free = position_error[:, :, None] + (self._time_s * velocity_error[:, :, None])
        if self._has_lag:
            push = gain * state[:, None, 4:6]
            free = free + _world(push, np.broadcast_to(self._free_s2, (len(push), *self._free_s2.shape)))
        return Prediction(gain_m_s2=gain, free_error_m=free)

    def error(self, prediction: Prediction, moves_rad: Real) -> Real:
        """Predict position less target for `moves_rad` (n, control, 2): (n, 2, prediction), in m."""
        reach = self._response_s2 * np.swapaxes(moves_rad, 1, 2)[:, :, None, :]
        tilt = np.take(np.add.accumulate(reach, axis=3), -1, axis=3)
        return prediction.free_error_m + _world(prediction.gain_m_s2, tilt)

    def gradient(self, prediction: Prediction, slope: Real) -> Real:
        """Carry `slope`, the signs of the errors (n, 2, prediction), to the moves: (n, control, 2), in m."""
        sums = ordered_sum(slope[:, :, None, :, None] * self._response_s2, axis=3)
        gain = prediction.gain_m_s2[..., None]
        return np.swapaxes((gain[:, 0] * sums[:, 0]) + (gain[:, 1] * sums[:, 1]), 1, 2)


def _world(gain: Real, tilt: Real) -> Real:
    """Turn double integrals of roll and pitch (n, 2, prediction) into displacements along x and y."""
    return (gain[:, :, 0, None] * tilt[:, None, 0]) + (gain[:, :, 1, None] * tilt[:, None, 1])
