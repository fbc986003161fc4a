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

    is_given: whether the caller gives the acceleration; else the tracker measures it by changes of velocity.
    input_limit: largest measured change of the target's velocity in an update period that is no jump, m/s;
        or the limit of a given acceleration, m/s^2.
    factor: makes such an input an acceleration in m/step^2: tau^2/T_s, in s; or tau^2, in s^2.
    acceleration_limit_m_step2: the acceleration of the largest input, M.
    jerk_limit_m_step2_update: largest jerk, m/step^2 per update.
    gain, jerk_gain: alpha and beta.
    noise: that of the guard; None without one, and where a given acceleration is taken as it comes.
    velocity_range_m_s: largest velocity of a target.
    """

    is_given: bool
    input_limit: float
    factor: float
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
    def input_quantity(self) -> str:
        """The quantity of the inputs."""
        return "thrust" if self.is_given else "velocity"

    @property
    def tested_input(self) -> float:
        """Largest input in tests: one in five drawn is beyond the limit."""
        return 1.25 * self.input_limit


def tracker_constants(
    settings: Sections, step_s: float, jump_m_s2: float | None = None
) -> TrackerConstants | None:
    """Derive the constants of the tracker for the prediction step tau; None if `settings` have none.

    `jump_m_s2` is the acceleration from which
    on the target has jumped; None for what the tilt limit gives.
    """
    if settings.target.acceleration == "none":
        return None
    is_given, ranges = settings.target.acceleration == "given", settings.ranges
    update_s, gain = settings.horizon.update_period_s, settings.target.tracker_gain
    if is_given:
        input_limit = given_limit_m_s2(settings, jump_m_s2)
        factor = step_s * step_s
    else:
        acceleration_m_s2 = jump_m_s2 or (JUMP_MARGIN * GRAVITY_M_S2 * settings.limits.tilt_rad)
        input_limit = min(acceleration_m_s2 * update_s, 2 * ranges.velocity_m_s)
        factor = (step_s * step_s) / update_s
    acceleration_m_step2 = factor * input_limit
    return TrackerConstants(
        is_given=is_given,
        input_limit=input_limit,
        factor=factor,
        acceleration_limit_m_step2=acceleration_m_step2,
        jerk_limit_m_step2_update=JERK_SHARE * acceleration_m_step2,
        gain=gain,
        jerk_gain=gain * gain / (2 - gain),
        noise=_target_noise(settings, step_s),
        velocity_range_m_s=ranges.velocity_m_s,
    )


def given_limit_m_s2(settings: Sections, jump_m_s2: float | None = None) -> float:
    """Return the limit of a given acceleration; `jump_m_s2` as of `tracker_constants`."""
    most_m_s2 = jump_m_s2 or (JUMP_MARGIN * GRAVITY_M_S2 * settings.limits.tilt_rad)
    return min(most_m_s2, settings.ranges.thrust_acceleration_max_m_s2)


def _target_noise(settings: Sections, step_s: float) -> TargetNoise | None:
    """Return the noise of a target; None if what is new of it is believed as it comes."""
    target = settings.target
    if settings.guard is None or (target.acceleration == "given" and target.tracker_gain == 1):
        return None
    limit_m_step2 = MOST_NOISE * settings.guard.target_noise_m_s2 * step_s * step_s
    return TargetNoise(
        limit_m_step2=limit_m_step2,
        steps2_per_m=1 / limit_m_step2,
        share=min(settings.horizon.update_period_s, NOISE_MEMORY_S) / NOISE_MEMORY_S,
    )
