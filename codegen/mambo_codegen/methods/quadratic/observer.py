"""Observer: position, velocity and disturbance, by a Kalman filter with fixed gains."""

from dataclasses import dataclass, replace

import numpy as np

from mambo_codegen.methods.quadratic.arithmetic import QuadraticArithmetic
from mambo_codegen.methods.quadratic.axis import AxisMotion, gains_of
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
        self._products, self._axis = arithmetic, AxisMotion(constants, arithmetic)
        names = ("position", "velocity", "disturbance")
        self._gains = gains_of(constant, observer.gain, names)
        coarse = observer.coarse_gain
        self._coarse_gains = self._gains if coarse is None else gains_of(constant, coarse, names)
        self._disturbance_limit = constant(observer.disturbance_limit_m_step2, "acceleration")
        self._drag = constant(observer.drag_1_step, "drag") if observer.drag_1_step else None

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

    def estimate(self, estimate: Estimate) -> list[Real]:
        """Return the columns (n, 2) of nmpc_estimate_t: position, velocity and disturbance."""
        products = self._products
        return [
            estimate.position_m,
            products.per_step_product(estimate.velocity_m_step),
            products.per_step2_product(estimate.disturbance_m_step2),
        ]

    def is_free(self, estimate: Estimate) -> Rows:
        """Return whether a disturbance along x or y is within its limit (n,)."""
        free: Rows = np.any(np.abs(estimate.disturbance_m_step2) < self._disturbance_limit, axis=1)
        return free

    def correct(self, estimate: Estimate, state: Real, tilt_m_step2: Real, is_coarse: Rows) -> Estimate:
        """Correct the estimate by `state` (n, 7), with the tilt's acceleration (n, 2) along x and y.

        is_coarse (n,): whether no position is measured, so that the coarse gains count.
        """
        motion, coarse = (estimate.position_m, estimate.velocity_m_step), is_coarse[:, None]
        measured = state[:, 0:2], self._products.speed_product(state[:, 2:4])
        innovation = self._axis.innovate(motion, measured, tilt_m_step2 + self.disturbance(estimate))
        gains = [
            [np.where(coarse, other, gain) for gain, other in zip(row, others, strict=True)]
            for row, others in zip(self._gains, self._coarse_gains, strict=True)
        ]
        change = self._products.disturbance_correction(gains[2][0], innovation[0], gains[2][1], innovation[1])
        return Estimate(
            *self._axis.correct(motion, gains, innovation),
            disturbance_m_step2=clamp(estimate.disturbance_m_step2 + change, self._disturbance_limit),
        )

    def predict(self, estimate: Estimate, tilt_m_step2: Real) -> Estimate:
        """Predict the estimate at the next control step."""
        motion = estimate.position_m, estimate.velocity_m_step
        predicted = self._axis.predict(motion, tilt_m_step2 + self.disturbance(estimate))
        return Estimate(*predicted, estimate.disturbance_m_step2)

    def shift(self, estimate: Estimate, jump: FrameShift) -> Estimate:
        """Move the estimate with the frame; what the tilt does not explain of the acceleration stays."""
        change = self._products.speed_product(jump.velocity_m_s[:, 0:2])
        disturbance = estimate.disturbance_m_step2
        if self._drag is not None:
            drag = self._products.drag_product(self._drag, change)
            disturbance = clamp(disturbance + drag, self._disturbance_limit)
        motion = estimate.position_m, estimate.velocity_m_step
        return Estimate(*self._axis.shift(motion, jump.position_m[:, 0:2], change), disturbance)

    def turn(self, estimate: Estimate, sine: Real, cosine: Real) -> Estimate:
        """Turn what the tilt does not explain by the angles of sine and cosine (n,)."""
        rest = self.disturbance(estimate)
        disturbance = self._products.turn(rest, sine, cosine)
        if self._drag is not None:
            disturbance = estimate.disturbance_m_step2 + (disturbance - rest)
        return replace(estimate, disturbance_m_step2=clamp(disturbance, self._disturbance_limit))
