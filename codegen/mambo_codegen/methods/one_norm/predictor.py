"""Predictor: the error between drone and target over the horizon, for given moves (eqs 8-11)."""

from dataclasses import astuple, dataclass

import numpy as np

from mambo_codegen.methods.one_norm.arithmetic import OneNormArithmetic
from mambo_codegen.methods.one_norm.constants import OneNormConstants
from mambo_codegen.methods.shared.math import Real


@dataclass(frozen=True)
class Prediction:
    """What does not change while the plan of a control step is optimized, for n controllers.

    gain_m_step2_rad:     (n, 2, 2) tau^2 times eq 8: acceleration along x, y per radian of roll, pitch.
    tilt_rad:             (n, 2) roll, pitch before the first move: measured, or zero without lag.
    error_m:              (n, 2) position less target along x, y.
    displacement_m_step:  (n, 2) change of the error over the first step at constant tilt.
    acceleration_m_step2: (n, 2) tau^2 times eq 8 at that tilt, less the target's acceleration.
    """

    gain_m_step2_rad: Real
    tilt_rad: Real
    error_m: Real
    displacement_m_step: Real
    acceleration_m_step2: Real


class Predictor:
    """The constants of the prediction, in the scalar type of the controller."""

    def __init__(self, constants: OneNormConstants, arithmetic: OneNormArithmetic) -> None:
        settings, tables = constants.settings, constants.tables
        self._steps = settings.horizon.prediction
        self._moves = settings.horizon.control
        self._printed_yaw = settings.model.yaw_convention == "printed"
        self.arithmetic, numbers = arithmetic, arithmetic.numbers
        self._displacement_share = numbers.constant(tables.displacement_share, "share")
        self._has_lag = tables.has_lag
        self._angles = np.array(
            [[numbers.constant(share, "share") for share in astuple(angle)] for angle in tables.angles]
        ).T
        self.angles_per_response = tables.angles_per_response
        self.response_sum = np.array(
            [[numbers.constant(value, "response") for value in row] for row in tables.response_sum]
        )

    def prepare(
        self,
        state: Real,
        target: Real,
        thrust_acceleration_m_s2: Real,
        target_acceleration_m_step2: Real | None = None,
    ) -> Prediction:
        """Evaluate eq 8 at the present yaw and thrust, and start the roll-out along each axis of the world.

        state is (n, 7), target (n, 4), thrust_acceleration_m_s2 (n,), and target_acceleration_m_step2 (n, 2)
        or None for a target of constant velocity.
        """
        arithmetic = self.arithmetic
        thrust = arithmetic.thrust_product(thrust_acceleration_m_s2)
        sine, cosine = (
            arithmetic.sine_product(thrust, value) for value in arithmetic.sine_cosine(state[:, 6])
        )
        signed_sine = sine if self._printed_yaw else -sine
        gain = np.stack([np.stack([signed_sine, -cosine], 1), np.stack([cosine, signed_sine], 1)], 1)
        displacement = arithmetic.velocity_product(state[:, 2:4] - target[:, 2:4])
        tilt, acceleration = np.zeros_like(displacement), np.zeros_like(displacement)
        if self._has_lag:
            tilt = state[:, 4:6]
            by_angle = arithmetic.gain_product(gain, tilt[:, None])
            acceleration = by_angle[:, :, 0] + by_angle[:, :, 1]
            displacement = displacement + arithmetic.acceleration_product(
                self._displacement_share, acceleration
            )
        if target_acceleration_m_step2 is not None:
            by_target = target_acceleration_m_step2
            acceleration = acceleration - by_target if self._has_lag else -by_target
            displacement = displacement - arithmetic.acceleration_product(self._displacement_share, by_target)
        error = arithmetic.initial_error(state[:, 0:2] - target[:, 0:2])
        return Prediction(gain, tilt, error, displacement, acceleration)

    def errors(self, prediction: Prediction, moves_rad: Real) -> Real:
        """Predict position less target for `moves_rad` (n, control, 2): (prediction, n, 2), in m."""
        error, displacement = prediction.error_m, prediction.displacement_m_step
        acceleration = prediction.acceleration_m_step2
        (displacement_share, deficit_share, deficit_decay), arithmetic = self._angles, self.arithmetic
        deficit = np.zeros_like(prediction.gain_m_step2_rad)
        errors = np.empty((self._steps, *error.shape), error.dtype)
        previous = prediction.tilt_rad
        for i in range(self._steps):
            if i < self._moves:
                tilt_change = (moves_rad[:, i] - previous)[:, None]
                previous = moves_rad[:, i]
                by_angle = arithmetic.gain_product(prediction.gain_m_step2_rad, tilt_change)
                change = by_angle[:, :, 0] + by_angle[:, :, 1]
                if self._has_lag:
                    displaced = arithmetic.acceleration_product(displacement_share, by_angle)
                    displacement = displacement + (displaced[:, :, 0] + displaced[:, :, 1])
                    deficit = deficit - arithmetic.acceleration_product(deficit_share, by_angle)
                else:
                    displacement = displacement + arithmetic.acceleration_product(
                        displacement_share[0], change
                    )
                acceleration = acceleration + change
            error = error + arithmetic.error_change(displacement)
            if self._has_lag:
                displacement = displacement + (acceleration + (deficit[:, :, 0] + deficit[:, :, 1]))
                deficit = arithmetic.acceleration_product(deficit_decay, deficit)
            else:
                displacement = displacement + acceleration
            errors[i] = error
        return errors
