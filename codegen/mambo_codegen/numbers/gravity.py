"""Gravity, and the thrust of hover."""

from typing import Final

from mambo_codegen.settings.sections import Sections

GRAVITY_M_S2: Final = 9.81


def hover_thrust(settings: Sections, offset_m_s2: float = 0.0) -> float:
    """Return the thrust acceleration of hover plus the offset, m/s^2, clamped to the range of `settings`.

    With a height it is the commanded one.
    """
    ranges, gain = settings.ranges, 1.0 if settings.height is None else settings.height.thrust_gain
    thrust = GRAVITY_M_S2 / gain + offset_m_s2
    return min(max(thrust, ranges.thrust_acceleration_min_m_s2), ranges.thrust_acceleration_max_m_s2)
