"""Target tracker: the target's acceleration and its rate, estimated by an alpha-beta filter."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.shared.arithmetic import Arithmetic
from mambo_codegen.methods.shared.inputs import Rows
from mambo_codegen.methods.shared.math import Real, clamp, confine
from mambo_codegen.methods.shared.tracker_constants import (
    LEAST_CHANGE,
    MOST_COUNTED,
    MOST_NOISE,
    TargetNoise,
    TrackerConstants,
)


@dataclass(frozen=True)
class TargetMotion:
    """What n controllers know of their targets' motion.

    velocity_m_s:         (n, 2) velocity along x, y in the last good step.
    acceleration_m_step2: (n, 2) tau^2 times the estimated acceleration.
    jerk_m_step2_update:  (n, 2) estimated change of that from one control step to the next.
    deviation:            (n, 2) what was new of the acceleration in the last step, over the most that counts.
    reversal:             (n, 2) mean product of successive deviations of opposite sign.
    doubt:                (n, 2) 1 less the believed share of what is new. All three are 0 without its noise.
    is_known:             (n,) whether there was a good step.
    """

    velocity_m_s: Real
    acceleration_m_step2: Real
    jerk_m_step2_update: Real
    deviation: Real
    reversal: Real
    doubt: Real
    is_known: NDArray[np.bool_]


def unknown_motion(like: Real) -> TargetMotion:
    """Return the motion before the first step, with the shape (n, 2) and the type of `like`."""
    zeros = np.zeros_like(like)
    return TargetMotion(zeros, zeros, zeros, zeros, zeros, zeros, np.zeros(len(like), np.bool_))


class TargetNoiseShare:
    """The share of what is new that a tracker believes: the less, the more it reverses its sign."""

    def __init__(self, noise: TargetNoise, constants: TrackerConstants, arithmetic: Arithmetic) -> None:
        constant = arithmetic.numbers.constant
        self._arithmetic = arithmetic
        self._per_noise = constant(noise.steps2_per_m, "per_noise")
        self._limit = constant(noise.limit_m_step2, "acceleration")
        self._share, self._rest = constant(noise.share, "factor"), constant(1 - noise.share, "factor")
        self._whole, self._two = constant(1.0, "factor"), constant(2.0, "factor")
        self._least, self._most = constant(LEAST_CHANGE, "factor"), constant(MOST_COUNTED, "factor")
        self._square = constant(MOST_NOISE**2, "whole")
        self._bound = constant(constants.acceleration_bound_m_step2, "acceleration")

    def update(self, motion: TargetMotion, difference: Real) -> tuple[Real, Real, Real]:
        """Return deviations, reversals and doubts after what is new of accelerations (n, 2)."""
        product = self._arithmetic.factor_product
        new = self._arithmetic.noise_product(self._per_noise, clamp(difference, self._limit))
        both = product(new, motion.deviation)
        latest = np.where(both < 0, -both, np.zeros_like(both))
        mean = clamp(product(self._rest, motion.reversal) + product(self._share, latest), self._whole)
        share = self._whole - motion.doubt
        counted = np.minimum(product(share, mean), self._most)
        better = product(share, self._two - (share + (self._square * counted)))
        return new, mean, self._whole - confine(better, product(self._least, share), self._whole)

    def believe(self, difference: Real, doubt: Real) -> Real:
        """Return the believed share (n, 2) of accelerations (n, 2)."""
        return self._arithmetic.factor_product(difference, self._whole - doubt)

    def fade(self, predicted: Real, doubt: Real) -> Real:
        """Return accelerations or jerks (n, 2), the nearer to 0 the less of what is new is believed."""
        product = self._arithmetic.factor_product
        return product(predicted, self._whole - product(self._share, product(doubt, doubt)))

    def limited(self, acceleration: Real) -> Real:
        """Return accelerations (n, 2) within their bound, which none exceeds but by rounding."""
        return clamp(acceleration, self._bound)


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
        self._noise = TargetNoiseShare(constants.noise, constants, arithmetic) if constants.noise else None

    def unknown(self, like: Real) -> TargetMotion:
        """Return the motion before the first step, with the shape (n, k) and the type of `like`."""
        return unknown_motion(like)

    def follow(
        self, motion: TargetMotion, program: Real, aim: Real, limited: tuple[Rows, Rows]
    ) -> tuple[TargetMotion, Real]:
        """Return the motions after targets within the limits (n, 4 or more), which stay as they are."""
        del program, limited
        return self.update(motion, aim[:, 2:4]), aim

    def stored(self, motion: TargetMotion) -> list[Real]:
        """Return the columns (n, k) that nmpc_t stores of motions, in their order."""
        stored = [motion.velocity_m_s, motion.acceleration_m_step2, motion.jerk_m_step2_update]
        if self._noise is not None:
            noise = np.stack([motion.deviation, motion.reversal, motion.doubt], axis=2)
            stored.append(noise.reshape(len(noise), -1))
        return stored

    def update(self, motion: TargetMotion, velocity: Real) -> TargetMotion:
        """Take the targets' velocities (n, 2) of a control step into the estimates."""
        product = self._arithmetic.tracker_product
        change = velocity - motion.velocity_m_s
        steady = motion.is_known[:, None] & (np.abs(change) <= self._change_limit)
        measured = self._arithmetic.target_product(self._factor, change)
        predicted = motion.acceleration_m_step2 + motion.jerk_m_step2_update
        difference = measured - predicted
        jerk, noise = motion.jerk_m_step2_update, (motion.deviation, motion.reversal, motion.doubt)
        if self._noise is None:
            acceleration = product(self._rest, predicted) + product(self._gain, measured)
        else:
            noise = self._noise.update(motion, difference)
            difference = self._noise.believe(difference, noise[2])
            predicted, jerk = (self._noise.fade(each, noise[2]) for each in (predicted, jerk))
            acceleration = self._noise.limited(predicted + product(self._gain, difference))
        jerk = clamp(jerk + product(self._jerk_gain, difference), self._jerk_limit)
        return TargetMotion(
            velocity_m_s=velocity,
            acceleration_m_step2=np.where(steady, acceleration, motion.acceleration_m_step2),
            jerk_m_step2_update=np.where(steady, jerk, np.zeros_like(jerk)),
            deviation=np.where(steady, noise[0], motion.deviation),
            reversal=np.where(steady, noise[1], motion.reversal),
            doubt=np.where(steady, noise[2], motion.doubt),
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
