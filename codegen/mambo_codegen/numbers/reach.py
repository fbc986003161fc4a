"""How quick a motion settings can fly: the largest horizontal acceleration that tilt and thrust give."""

import math
from collections.abc import Iterable
from typing import Final

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.sections import Sections

THRUST_LEFT: Final = 0.92
"""Share of the largest thrust that height and tilt may take together: the rest is for attitude and yaw."""

PLANNED_SHARE: Final = 0.85
"""Share of what the height leaves of the thrust that a curve may take: the rest is for corrections."""

FLOWN_SHARE: Final = 0.95
"""Of the largest acceleration, what a curve may ask for: the rest is for corrections and drag."""


def tilted_m_s2(tilt_rad: float, attitude: Iterable[tuple[float, float]], per_tilt: float = 1.0) -> float:
    """Return the horizontal acceleration of a level flight at a commanded tilt, along the weaker axis.

    attitude: gain and trim in rad of roll and pitch. per_tilt: acceleration per tilt, in g per radian.
    """
    least_rad = min(gain * tilt_rad - abs(trim_rad) for gain, trim_rad in attitude)
    return GRAVITY_M_S2 * per_tilt * math.tan(max(least_rad, 0.0))


def largest_acceleration_m_s2(settings: Sections) -> float:
    """Return the horizontal acceleration of a level flight at the tilt limit, along the weaker axis."""
    model = settings.model
    attitude = (model.roll_gain, model.roll_trim_rad), (model.pitch_gain, model.pitch_trim_rad)
    return tilted_m_s2(settings.limits.tilt_rad, attitude, model.acceleration_per_tilt)


def flown_acceleration_m_s2(settings: Sections) -> float:
    """Return the horizontal acceleration that a curve may ask for, by tilt limit and thrust."""
    largest_m_s2 = largest_acceleration_m_s2(settings)
    if settings.height is not None:
        left_m_s2 = THRUST_LEFT * settings.height.thrust_max_m_s2
        spare_m_s2 = PLANNED_SHARE * math.sqrt(max(left_m_s2**2 - GRAVITY_M_S2**2, 0.0))
        largest_m_s2 = min(largest_m_s2, spare_m_s2)
    return FLOWN_SHARE * largest_m_s2
