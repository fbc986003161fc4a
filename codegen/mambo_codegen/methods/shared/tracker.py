"""Target tracker: the target's acceleration and its rate, estimated by an alpha-beta filter."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.shared.arithmetic import Arithmetic
from mambo_codegen.methods.shared.math import Real, clamp
from mambo_codegen.methods.shared.tracker_constants import TrackerConstants


@dataclass(frozen=True)
class TargetMotion:
    """What n controllers know of their targets' motion.

    velocity_m_s:         (n, 2) velocity along x, y in the last good step; 0 if the acceleration is given.
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
        self._arithmetic, self.is_given = arithmetic, constants.is_given
        self.columns = slice(4, 6) if constants.is_given else slice(2, 4)
        """What the tracker reads of a target."""
        self._input_limit = constant(constants.input_limit, constants.input_quantity)
        self._factor = constant(constants.factor, "tracker")
        self._jerk_limit = constant(constants.jerk_limit_m_step2_update, "acceleration")
        self._gain = constant(constants.gain, "sine")
        self._rest = constant(1 - constants.gain, "sine")
        self._jerk_gain = constant(constants.jerk_gain, "sine")

    def update(self, motion: TargetMotion, given: Real) -> TargetMotion:
        """Take what the tracker reads of the target (n, 2) in a control step into the estimates.

        That is its velocity, or its acceleration if that is given.
        """
        product, known = self._arithmetic.tracker_product, motion.is_known[:, None]
        if self.is_given:
            velocity, steady = motion.velocity_m_s, known
            measured = self._arithmetic.target_product(self._factor, clamp(given, self._input_limit))
            at_first = measured
        else:
            velocity, at_first = given, motion.acceleration_m_step2
            change = velocity - motion.velocity_m_s
            steady = known & (np.abs(change) <= self._input_limit)
            measured = self._arithmetic.target_product(self._factor, change)
        predicted = motion.acceleration_m_step2 + motion.jerk_m_step2_update
        difference = measured - predicted
        acceleration = product(self._rest, predicted) + product(self._gain, measured)
        jerk = clamp(motion.jerk_m_step2_update + product(self._jerk_gain, difference), self._jerk_limit)
        return TargetMotion(
            velocity_m_s=velocity,
            acceleration_m_step2=np.where(steady, acceleration, at_first),
            jerk_m_step2_update=np.where(steady, jerk, np.zeros_like(jerk)),
            is_known=np.ones_like(motion.is_known),
        )
