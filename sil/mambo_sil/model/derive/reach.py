"""How quick a motion settings can fly: the largest horizontal acceleration that their tilt limit gives."""

import math
from collections.abc import Iterable

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.model import Settings


def tilted_m_s2(tilt_rad: float, attitude: Iterable[tuple[float, float]], per_tilt: float = 1.0) -> float:
    """Return the horizontal acceleration of a level flight at a commanded tilt, along the weaker axis.

    attitude: gain and trim in rad of roll and pitch. per_tilt: acceleration per tilt, in g per radian.
    """
    least_rad = min(gain * tilt_rad - abs(trim_rad) for gain, trim_rad in attitude)
    return GRAVITY_M_S2 * per_tilt * math.tan(max(least_rad, 0.0))


def largest_acceleration_m_s2(settings: Settings) -> float:
    """Return the horizontal acceleration of a level flight at the tilt limit, along the weaker axis."""
    model = settings.model
    attitude = (model.roll_gain, model.roll_trim_rad), (model.pitch_gain, model.pitch_trim_rad)
    return tilted_m_s2(settings.limits.tilt_rad, attitude, model.acceleration_per_tilt)


def reach_words(settings: Settings) -> str:
    """Return in words what `largest_acceleration_m_s2` returns."""
    acceleration_m_s2, tilt_rad = largest_acceleration_m_s2(settings), settings.limits.tilt_rad
    return (
        f"largest horizontal acceleration: {acceleration_m_s2:.2g} m/s^2, by limits.tilt_rad = {tilt_rad:g}"
    )
