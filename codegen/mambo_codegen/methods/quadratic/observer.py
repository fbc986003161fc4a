"""Observer: position, velocity and disturbance, by a Kalman filter with fixed gains."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.quadratic.arithmetic import QuadraticArithmetic
from mambo_codegen.methods.quadratic.constants import QuadraticConstants
from mambo_codegen.methods.shared.inputs import FrameShift, Rows
from mambo_codegen.methods.shared.math import Real, clamp


@dataclass(frozen=True)
class Estimate:
    """What n controllers take for the states of their drones, (n, 2) along x and y each."""

    position_m: Real
    velocity_m_step: Real
    disturbance_m_step2: Real


class KalmanObserver:
    """The constants of the observer, in the scalar type of the controller."""

    def __init__(self, constants: QuadraticConstants, arithmetic: QuadraticArithmetic) -> None:
        constant, observer = arithmetic.numbers.constant, constants.observer
        self._products = arithmetic

        def numbers(gain: NDArray[np.float64]) -> list[list[Any]]:
            return [
                [
                    constant(value, f"{name}_by_{by}")
                    for value, by in zip(row, ("position", "velocity"), strict=True)
                ]
                for row, name in zip(gain, ("position", "velocity", "disturbance"), strict=True)
            ]

        self._gain = numbers(observer.gain)
        coarse = observer.coarse_gain
        self._coarse_gain = self._gain if coarse is None else numbers(coarse)
        self._position_limit = constant(constants.settings.ranges.position_m, "position")
        self._velocity_limit = constant(observer.velocity_limit_m_step, "speed")
        self._disturbance_limit = constant(observer.disturbance_limit_m_step2, "acceleration")
        self._drag = constant(observer.drag_1_step, "drag") if observer.drag_1_step else None
        self._age = constant(observer.age_steps, "age") if observer.age_steps else None

    def start(self, estimate: Estimate, state: Real) -> Estimate:
        """Set position and velocity to those of `state` (n, 7)."""
        return Estimate(
            position_m=state[:, 0:2],
            velocity_m_step=self._products.speed_product(state[:, 2:4]),
            disturbance_m_step2=estimate.disturbance_m_step2,
        )

    def disturbance(self, estimate: Estimate) -> Real:
        """Return the acceleration (n, 2) along x and y that the tilt does not explain."""
        if self._drag is None:
            return estimate.disturbance_m_step2
        drag = self._products.drag_product(self._drag, estimate.velocity_m_step)
        return np.asarray(estimate.disturbance_m_step2 - drag)

    def is_free(self, estimate: Estimate) -> Rows:
        """Return whether a disturbance along x or y is within its limit (n,)."""
        free: Rows = np.any(np.abs(estimate.disturbance_m_step2) < self._disturbance_limit, axis=1)
        return free

    def correct(self, estimate: Estimate, state: Real, tilt_m_step2: Real, is_coarse: Rows) -> Estimate:
        """Correct the estimate by `state` (n, 7), with the tilt's acceleration (n, 2) along x and y.

        is_coarse (n,): whether no position is measured, so that the coarse gains count.
        """
        products = self._products
        position, velocity = estimate.position_m, estimate.velocity_m_step
        measured = state[:, 0:2]
        measured_step = products.speed_product(state[:, 2:4])
        if self._age is not None:
            acceleration = tilt_m_step2 + self.disturbance(estimate)
            measured = measured + products.aged_position(self._age, velocity)
            measured_step = measured_step + products.aged_velocity(self._age, acceleration)
        by_position, by_velocity = measured - position, measured_step - velocity
        coarse = is_coarse[:, None]
        corrections = [
            product(
                np.where(coarse, other[0], gain[0]),
                by_position,
                np.where(coarse, other[1], gain[1]),
                by_velocity,
            )
            for product, gain, other in zip(
                (
                    products.position_correction,
                    products.velocity_correction,
                    products.disturbance_correction,
                ),
                self._gain,
                self._coarse_gain,
                strict=True,
            )
        ]
        return Estimate(
            position_m=position + corrections[0],
            velocity_m_step=velocity + corrections[1],
            disturbance_m_step2=clamp(estimate.disturbance_m_step2 + corrections[2], self._disturbance_limit),
        )

    def predict(self, estimate: Estimate, tilt_m_step2: Real) -> Estimate:
        """Predict the estimate at the next control step."""
        products = self._products
        acceleration = tilt_m_step2 + self.disturbance(estimate)
        mean = estimate.velocity_m_step + products.half_change(acceleration)
        return Estimate(
            position_m=clamp(estimate.position_m + products.position_change(mean), self._position_limit),
            velocity_m_step=clamp(
                estimate.velocity_m_step + products.velocity_change(acceleration), self._velocity_limit
            ),
            disturbance_m_step2=estimate.disturbance_m_step2,
        )

    def shift(self, estimate: Estimate, jump: FrameShift) -> Estimate:
        """Move the estimate with the frame; what the tilt does not explain of the acceleration stays."""
        change = self._products.speed_product(jump.velocity_m_s[:, 0:2])
        position, disturbance = jump.position_m[:, 0:2], estimate.disturbance_m_step2
        if self._age is not None:
            position = position + self._products.aged_position(self._age, change)
        if self._drag is not None:
            drag = self._products.drag_product(self._drag, change)
            disturbance = clamp(disturbance + drag, self._disturbance_limit)
        return Estimate(
            position_m=clamp(estimate.position_m + position, self._position_limit),
            velocity_m_step=clamp(estimate.velocity_m_step + change, self._velocity_limit),
            disturbance_m_step2=disturbance,
        )

    def turn(self, estimate: Estimate, sine: Real, cosine: Real) -> Estimate:
        """Turn what the tilt does not explain by the angles of sine and cosine (n,)."""
        rest = self.disturbance(estimate)
        disturbance = self._products.turn(rest, sine, cosine)
        if self._drag is not None:
            disturbance = estimate.disturbance_m_step2 + (disturbance - rest)
        return replace(estimate, disturbance_m_step2=clamp(disturbance, self._disturbance_limit))
