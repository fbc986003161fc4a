"""Target tracker: the target's acceleration and its rate, estimated by an alpha-beta filter."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.shared.arithmetic import Arithmetic
from mambo_codegen.methods.shared.math import Real, clamp
from mambo_codegen.methods.shared.tracker_constants import TrackerConstants


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

    def __init__(self, constants: TrackerConstants, arithmetic: Arithmetic) -> None:
        constant = arithmetic.numbers.constant
        self._arithmetic = arithmetic
        self._change_limit = constant(constants.change_limit_m_s, "velocity")
        self._factor = constant(constants.factor_s, "tracker")
        self._bound = constant(constants.acceleration_bound_m_step2, "acceleration")
        self._velocity_range = constant(constants.velocity_range_m_s, "velocity")
        self._jerk_limit = constant(constants.jerk_limit_m_step2_update, "acceleration")
        self._gain = constant(constants.gain, "sine")
        self._rest = constant(1 - constants.gain, "sine")
        self._jerk_gain = constant(constants.jerk_gain, "sine")

    def stored(self, motion: TargetMotion) -> list[Real]:
        """Return the columns (n, k) that nmpc_t stores of motions, in their order."""
        return [motion.velocity_m_s, motion.acceleration_m_step2, motion.jerk_m_step2_update]

    def update(self, motion: TargetMotion, velocity: Real) -> TargetMotion:
        """Take the targets' velocities (n, 2) of a control step into the estimates."""
        product = self._arithmetic.tracker_product
        change = velocity - motion.velocity_m_s
        steady = motion.is_known[:, None] & (np.abs(change) <= self._change_limit)
        measured = self._arithmetic.target_product(self._factor, change)
        predicted = motion.acceleration_m_step2 + motion.jerk_m_step2_update
        difference = measured - predicted
        acceleration = product(self._rest, predicted) + product(self._gain, measured)
        jerk = clamp(motion.jerk_m_step2_update + product(self._jerk_gain, difference), self._jerk_limit)
        return TargetMotion(
            velocity_m_s=velocity,
            acceleration_m_step2=np.where(steady, acceleration, motion.acceleration_m_step2),
            jerk_m_step2_update=np.where(steady, jerk, np.zeros_like(jerk)),
            is_known=np.ones_like(motion.is_known),
        )

    def shift(self, motion: TargetMotion, change_m_s: Real) -> TargetMotion:
        """Change the targets' velocities by the first columns of `change_m_s`, which is no acceleration."""
        change = change_m_s[:, : motion.velocity_m_s.shape[1]]
        return replace(motion, velocity_m_s=clamp(motion.velocity_m_s + change, self._velocity_range))

    def turn(self, motion: TargetMotion, sine: Real, cosine: Real) -> TargetMotion:
        """Turn the targets' accelerations (n, 2) by the angles of sine and cosine (n,).

        The next velocities are the first ones, where the jerk begins at 0.
        """
        turn = self._arithmetic.turn
        acceleration = clamp(turn(motion.acceleration_m_step2, sine, cosine), self._bound)
        return self.begin_again(replace(motion, acceleration_m_step2=acceleration))

    def begin_again(self, motion: TargetMotion) -> TargetMotion:
        """Take the next velocities for the first ones."""
        return replace(motion, is_known=np.zeros_like(motion.is_known))
