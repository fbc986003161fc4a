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


@dataclass(frozen=True)
class TrackerConstants:
    """Constants of the target tracker, float64.

    change_limit_m_s: largest change of the target's velocity in an update period that is no jump.
    factor_s: tau^2/T_s, which makes such a change an acceleration in m/step^2.
    acceleration_limit_m_step2: the acceleration of the largest change, M.
    jerk_limit_m_step2_update: largest jerk, m/step^2 per update.
    gain, jerk_gain: alpha and beta.
    velocity_range_m_s: largest velocity of a target.
    """

    change_limit_m_s: float
    factor_s: float
    acceleration_limit_m_step2: float
    jerk_limit_m_step2_update: float
    gain: float
    jerk_gain: float
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


def tracker_constants(settings: Sections, step_s: float) -> TrackerConstants | None:
    """Derive the constants of the tracker for the prediction step tau; None if `settings` have none."""
    if settings.target.acceleration != "tracked":
        return None
    update_s, gain = settings.horizon.update_period_s, settings.target.tracker_gain
    acceleration_m_s2 = JUMP_MARGIN * GRAVITY_M_S2 * settings.limits.tilt_rad
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
        velocity_range_m_s=settings.ranges.velocity_m_s,
    )


def target_limit_m_s2(settings: Sections) -> float:
    """Return the acceleration of a target from which on it has jumped."""
    most_m_s2 = JUMP_MARGIN * GRAVITY_M_S2 * settings.limits.tilt_rad
    return min(most_m_s2, settings.ranges.thrust_acceleration_max_m_s2)
