"""Target tracker: the target's acceleration, estimated from its velocities by an alpha-beta filter."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mambo_nmpc.codegen.reference.arithmetic import Arithmetic
from mambo_nmpc.codegen.reference.exact_arithmetic import ExactArithmetic
from mambo_nmpc.codegen.reference.math import Real, clamp
from mambo_nmpc.codegen.tracker import TrackerConstants


@dataclass(frozen=True)
class TargetMotion:
    """What n controllers know of their targets' motion.

    velocity_m_s:         (n, 2) velocity along x, y in the last good step.
    acceleration_m_step2: (n, 2) tau^2 times the estimated acceleration.
    jerk_m_step2_update:  (n, 2) estimated change of that from one control step to the next.
    is_known:             (n,) whether there was a good step.
    """

    velocity_m_s: Real
    acceleration_m_step2: Real
    jerk_m_step2_update: Real
    is_known: NDArray[np.bool_]


def unknown_motion(like: Real) -> TargetMotion:
    """Return the motion before the first step, with the shape (n, 2) and the type of `like`."""
    zeros = np.zeros_like(like)
    return TargetMotion(zeros, zeros, zeros, np.zeros(len(like), np.bool_))


class Tracker:
    """The constants of the tracker, in the scalar type of the controller."""

    def __init__(self, constants: TrackerConstants, arithmetic: Arithmetic | ExactArithmetic) -> None:
        constant = arithmetic.numbers.constant
        self._arithmetic = arithmetic
        self._change_limit = constant(constants.change_limit_m_s, "velocity")
        self._step_squared_per_update = constant(constants.step_squared_per_update_s, "tracker")
        self._acceleration_limit = constant(constants.acceleration_limit_m_step2, "acceleration")
        self._jerk_limit = constant(constants.jerk_limit_m_step2_update, "acceleration")
        self._gain = constant(constants.gain, "sine")
        self._jerk_gain = constant(constants.jerk_gain, "sine")

    def update(self, motion: TargetMotion, velocity_m_s: Real) -> TargetMotion:
        """Take the target's velocity (n, 2) of a control step into the estimates."""
        product = self._arithmetic.tracker_product
        change = velocity_m_s - motion.velocity_m_s
        steady = motion.is_known[:, None] & (np.abs(change) <= self._change_limit)
        measured = self._arithmetic.change_product(self._step_squared_per_update, change)
        predicted = motion.acceleration_m_step2 + motion.jerk_m_step2_update
        difference = measured - predicted
        acceleration = clamp(predicted + product(self._gain, difference), self._acceleration_limit)
        jerk = clamp(motion.jerk_m_step2_update + product(self._jerk_gain, difference), self._jerk_limit)
        return TargetMotion(
            velocity_m_s=velocity_m_s,
            acceleration_m_step2=np.where(steady, acceleration, motion.acceleration_m_step2),
            jerk_m_step2_update=np.where(steady, jerk, np.zeros_like(jerk)),
            is_known=np.ones_like(motion.is_known),
        )
