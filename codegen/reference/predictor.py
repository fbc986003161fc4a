"""Predictor: how far robot and target will be apart, given the moves (eqs 8-11)."""

from dataclasses import dataclass

import numpy as np

from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.reference.arithmetic import Arithmetic
from mambo_nmpc.codegen.reference.math import Real


@dataclass(frozen=True)
class Prediction:
    """What a control step knows before it chooses moves, for n controllers.

    gain_m:     (n, 2, 2) bend along world x, y per radian of roll, pitch (eq 8 over a prediction step).
    tilt_rad:   (n, 2) the roll, pitch that the first move turns from: measured, or zero without lag.
    error_m:    (n, 2) position less target along x, y.
    advance_m:  (n, 2) what the first step adds to that, if tilt is held.
    bend_m:     (n, 2) what each step adds to the advance, if tilt is held.
    """

    gain_m: Real
    tilt_rad: Real
    error_m: Real
    advance_m: Real
    bend_m: Real


class Predictor:
    """The constants of the prediction, in the scalar type of the controller."""

    def __init__(self, design: Design, arithmetic: Arithmetic) -> None:
        settings, tables = design.settings, design.tables
        self._steps = settings.horizon.prediction
        self._moves = settings.horizon.control
        self._printed_yaw = settings.model.yaw_convention == "printed"
        self.arithmetic, numbers = arithmetic, arithmetic.numbers
        self._held = numbers.constant(tables.held, "share")
        self._has_lag = tables.has_lag
        self._axes = np.array(
            [
                [numbers.constant(share, "share") for share in (axis.at_once, axis.delayed, axis.decay)]
                for axis in tables.axes
            ]
        ).T
        self.axes_alike = tables.axes_alike
        self.response_sum = np.array(
            [[numbers.constant(value, "response") for value in row] for row in tables.response_sum]
        )

    def prepare(self, state: Real, target: Real, thrust_acceleration_m_s2: Real) -> Prediction:
        """Evaluate eq 8 at the present heading and thrust, and find where the walks start without moves.

        state is (n, 7), target (n, 4) and thrust_acceleration_m_s2 (n,).
        """
        arithmetic = self.arithmetic
        push = arithmetic.push(thrust_acceleration_m_s2)
        sine, cosine = arithmetic.sine_cosine(state[:, 6])
        across, along = arithmetic.component(push, sine), arithmetic.component(push, cosine)
        turned = across if self._printed_yaw else -across
        gain = np.stack([np.stack([turned, -along], 1), np.stack([along, turned], 1)], 1)
        advance = arithmetic.travel(state[:, 2:4] - target[:, 2:4])
        tilt, bend = np.zeros_like(advance), np.zeros_like(advance)
        if self._has_lag:
            tilt = state[:, 4:6]
            shares = arithmetic.bend(gain, tilt[:, None])
            bend = shares[:, :, 0] + shares[:, :, 1]
            advance = advance + arithmetic.part(self._held, bend)
        error = arithmetic.first_error(state[:, 0:2] - target[:, 0:2])
        return Prediction(gain, tilt, error, advance, bend)

    def errors(self, prediction: Prediction, moves_rad: Real) -> Real:
        """Predict position less target for `moves_rad` (n, control, 2): (prediction, n, 2), in m."""
        error, advance, bend = prediction.error_m, prediction.advance_m, prediction.bend_m
        (at_once, delayed, decay), arithmetic = self._axes, self.arithmetic
        to_come = np.zeros_like(prediction.gain_m)
        errors = np.empty((self._steps, *error.shape), error.dtype)
        before = prediction.tilt_rad
        for i in range(self._steps):
            if i < self._moves:
                shares = arithmetic.bend(prediction.gain_m, (moves_rad[:, i] - before)[:, None])
                before = moves_rad[:, i]
                both = shares[:, :, 0] + shares[:, :, 1]
                if self._has_lag:
                    sooner = arithmetic.part(at_once, shares)
                    advance = advance + (sooner[:, :, 0] + sooner[:, :, 1])
                    to_come = to_come - arithmetic.part(delayed, shares)
                else:
                    advance = advance + arithmetic.part(at_once[0], both)
                bend = bend + both
            error = error + arithmetic.step_of(advance)
            if self._has_lag:
                advance = advance + (bend + (to_come[:, :, 0] + to_come[:, :, 1]))
                to_come = arithmetic.part(decay, to_come)
            else:
                advance = advance + bend
            errors[i] = error
        return errors
