"""How quick a motion settings can fly: the largest horizontal acceleration that their tilt limit gives."""

import math

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.model import Settings


def largest_acceleration_m_s2(settings: Settings) -> float:
    """Return the horizontal acceleration of a level flight at the tilt limit, along the weaker axis."""
    model, limit_rad = settings.model, settings.limits.tilt_rad
    tilts = (
        model.roll_gain * limit_rad - abs(model.roll_trim_rad),
        model.pitch_gain * limit_rad - abs(model.pitch_trim_rad),
    )
    return GRAVITY_M_S2 * model.acceleration_per_tilt * math.tan(max(min(tilts), 0.0))


def reach_words(settings: Settings) -> str:
    """Return in words what `largest_acceleration_m_s2` returns."""
    acceleration_m_s2, tilt_rad = largest_acceleration_m_s2(settings), settings.limits.tilt_rad
    return (
        f"largest horizontal acceleration: {acceleration_m_s2:.2g} m/s^2, by limits.tilt_rad = {tilt_rad:g}"
    )
