"""Constants of the target tracker: the target's acceleration and its rate, as nmpc.c derives.

All arithmetic is float64 in a fixed order; constants are rounded to the scalar type once.
"""

from dataclasses import dataclass
from typing import Final

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.sections import Sections

JUMP_MARGIN: Final = 1.5
"""A target that accelerates by this factor more than the drone can at its tilt limit has jumped."""


JERK_SHARE: Final = 0.1
"""The largest estimated jerk, per update, as a share of the largest acceleration."""

MOST_NOISE: Final = 16
"""What is new of the target's acceleration counts up to this many times its noise."""

LEAST_CHANGE: Final = 0.25
"""The share that a tracker believes falls to this much of itself at most in a control step."""

MOST_COUNTED: Final = 2.0**-6
"""Reversals times the share count up to this: beyond it the share falls as far as it may."""

NOISE_MEMORY_S: Final = 0.5
"""The time over which a guard averages how much the target's motion reverses."""


@dataclass(frozen=True)
class TargetNoise:
    """Constants of a target's noise, float64.

    limit_m_step2: what is new of the target's acceleration counts up to this, MOST_NOISE times its noise.
    steps2_per_m:  1 over that.
    share:         of the latest reversal in their mean.
    """

    limit_m_step2: float
    steps2_per_m: float
    share: float


@dataclass(frozen=True)
class TrackerConstants:
    """Constants of the target tracker, float64.

    change_limit_m_s: largest change of the target's velocity in an update period that is no jump.
    factor_s: tau^2/T_s, which makes such a change an acceleration in m/step^2.
    acceleration_limit_m_step2: the acceleration of the largest change, M.
    jerk_limit_m_step2_update: largest jerk, m/step^2 per update.
    gain, jerk_gain: alpha and beta.
    noise: that of the guard; None without one.
    velocity_range_m_s: largest velocity of a target.
    """

    change_limit_m_s: float
    factor_s: float
    acceleration_limit_m_step2: float
    jerk_limit_m_step2_update: float
    gain: float
    jerk_gain: float
    noise: TargetNoise | None
    velocity_range_m_s: float

    @property
    def acceleration_bound_m_step2(self) -> float:
        """A bound of the estimated acceleration, for any inputs: A = (1 - alpha) (A + J) + alpha M."""
        rest = (1 - self.gain) / self.gain * self.jerk_limit_m_step2_update
        return 1.01 * (self.acceleration_limit_m_step2 + rest)

    @property
    def tested_change_m_s(self) -> float:
        """Largest change in tests: one in five drawn is beyond the limit."""
        return 1.25 * self.change_limit_m_s


def tracker_constants(
    settings: Sections, step_s: float, jump_m_s2: float | None = None
) -> TrackerConstants | None:
    """Derive the constants of the tracker for the prediction step tau; None if `settings` have none.

    `jump_m_s2` is the acceleration from which
    on the target has jumped; None for what the tilt limit gives.
    """
    if settings.target.acceleration != "tracked":
        return None
    update_s, gain = settings.horizon.update_period_s, settings.target.tracker_gain
    acceleration_m_s2 = jump_m_s2 or (JUMP_MARGIN * GRAVITY_M_S2 * settings.limits.tilt_rad)
    change_limit_m_s = min(acceleration_m_s2 * update_s, 2 * settings.ranges.velocity_m_s)
    factor_s = (step_s * step_s) / update_s
    acceleration_m_step2 = factor_s * change_limit_m_s
    return TrackerConstants(
        change_limit_m_s=change_limit_m_s,
        factor_s=factor_s,
        acceleration_limit_m_step2=acceleration_m_step2,
        jerk_limit_m_step2_update=JERK_SHARE * acceleration_m_step2,
        gain=gain,
        jerk_gain=gain * gain / (2 - gain),
        noise=_target_noise(settings, step_s),
        velocity_range_m_s=settings.ranges.velocity_m_s,
    )


def target_limit_m_s2(settings: Sections) -> float:
    """Return the acceleration of a target from which on it has jumped."""
    most_m_s2 = JUMP_MARGIN * GRAVITY_M_S2 * settings.limits.tilt_rad
    return min(most_m_s2, settings.ranges.thrust_acceleration_max_m_s2)


def _target_noise(settings: Sections, step_s: float) -> TargetNoise | None:
    """Return the noise of a target; None without a guard: then what is new is believed as it comes."""
    if settings.guard is None:
        return None
    limit_m_step2 = MOST_NOISE * settings.guard.target_noise_m_s2 * step_s * step_s
    return TargetNoise(
        limit_m_step2=limit_m_step2,
        steps2_per_m=1 / limit_m_step2,
        share=min(settings.horizon.update_period_s, NOISE_MEMORY_S) / NOISE_MEMORY_S,
    )
