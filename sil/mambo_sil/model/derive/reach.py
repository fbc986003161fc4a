"""How quick a motion settings can fly, in words."""

from mambo_codegen.numbers.reach import largest_acceleration_m_s2
from mambo_codegen.settings.model import Settings


def reach_words(settings: Settings) -> str:
    """Return in words what `largest_acceleration_m_s2` returns."""
    acceleration_m_s2, tilt_rad = largest_acceleration_m_s2(settings), settings.limits.tilt_rad
    return (
        f"largest horizontal acceleration: {acceleration_m_s2:.2g} m/s^2, by limits.tilt_rad = {tilt_rad:g}"
    )
