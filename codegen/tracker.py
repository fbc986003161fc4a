"""Constants of the target tracker: the target's acceleration from its velocity, as `nmpc_tracker.h` derives.

All arithmetic is float64 in a fixed order; constants are rounded to the scalar type once.
"""

from dataclasses import dataclass
from typing import Final

from mambo_nmpc.codegen.settings.sections import Sections

JUMP_MARGIN: Final = 1.5
"""A target that accelerates by this factor more than the drone can at its tilt limit has jumped."""

GRAVITY_M_S2: Final = 9.81


JERK_SHARE: Final = 0.1
"""The largest estimated jerk, per update, as a share of the largest acceleration."""


@dataclass(frozen=True)
class TrackerConstants:
    """Constants of the target tracker, float64.

    change_limit_m_s: largest change of the target's velocity in an update period that is no jump, m/s.
    step_squared_per_update_s: tau^2/T_s, in s: makes such a change an acceleration in m/step^2.
    acceleration_limit_m_step2: the acceleration of the largest change.
    jerk_limit_m_step2_update: largest jerk, m/step^2 per update.
    gain, jerk_gain: alpha and beta.
    """

    change_limit_m_s: float
    step_squared_per_update_s: float
    acceleration_limit_m_step2: float
    jerk_limit_m_step2_update: float
    gain: float
    jerk_gain: float

    @property
    def tested_change_m_s(self) -> float:
        """Largest change of the target's velocity from step to step in tests: one in five drawn is a jump."""
        return 1.25 * self.change_limit_m_s


def tracker_constants(settings: Sections) -> TrackerConstants | None:
    """Derive the constants of the tracker; None if `settings` have none.

    With a quadratic cost tau is the update period.
    """
    if settings.target.acceleration == "none":
        return None
    update_s, gain = settings.horizon.update_period_s, settings.target.tracker_gain
    step_s = update_s if settings.cost.norm == "quadratic" else settings.horizon.prediction_step_s
    acceleration_m_s2 = JUMP_MARGIN * GRAVITY_M_S2 * settings.limits.tilt_rad
    change_m_s = min(acceleration_m_s2 * update_s, 2 * settings.ranges.velocity_m_s)
    step_squared_per_update_s = (step_s * step_s) / update_s
    acceleration_m_step2 = step_squared_per_update_s * change_m_s
    return TrackerConstants(
        change_limit_m_s=change_m_s,
        step_squared_per_update_s=step_squared_per_update_s,
        acceleration_limit_m_step2=acceleration_m_step2,
        jerk_limit_m_step2_update=JERK_SHARE * acceleration_m_step2,
        gain=gain,
        jerk_gain=gain * gain / (2 - gain),
    )
