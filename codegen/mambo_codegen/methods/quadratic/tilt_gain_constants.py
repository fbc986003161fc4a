"""Constants of the tilt gain: how much the drone tilts, over what the attitude model says.

The chapter *tilt gain* has the equations. The quick low-pass makes model and drone equally late, so that a
lag that is wrong by half reads as 3 to 10 % of gain, and keeps noise out; the slow one takes away what stands
still, as trims and steady wind.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.quadratic.reciprocal import Reciprocal, reciprocal
from mambo_codegen.settings.sections import Sections

QUICK_RAD_S: Final = 4.0
SLOW_RAD_S: Final = 0.5
"""Corner frequencies of the low-passes whose difference is compared."""

LEAST_LEARNT_M_S2: Final = 0.25
"""Nothing is learnt from a model's acceleration of less: noise in hover gives less."""

MOST_ERROR_M_S2: Final = 1.0
"""Larger errors count as this one, so that the gain moves by at most 60 % a second."""

RATE_1_S: Final = 0.6
"""Relative change of the gain per second and per error of 1 m/s^2."""

LEAST_GAIN: Final = 0.5
MOST_GAIN: Final = 1.6
"""The learnt gain over that of the settings stays within these."""

FREE_SHARE: Final = 0.1
"""A command nearer to the tilt limit than this share of it is not learnt from."""

INVERSE_ERROR: Final = 1e-7


@dataclass(frozen=True)
class TiltGainConstants:
    """Constants of the tilt gain, float64, for lengths in m and times in steps of an update period.

    quick_row, slow_row: (2,) the next mean from [mean, new value].
    least_m_step2, most_m_step2: least acceleration that is learnt from, and largest error.
    rate_step2_m:        relative change of the gain per error.
    inverse:             of the gain.
    """

    quick_row: NDArray[np.float64]
    slow_row: NDArray[np.float64]
    least_m_step2: float
    most_m_step2: float
    rate_step2_m: float
    inverse: Reciprocal


def tilt_gain_constants(settings: Sections) -> TiltGainConstants | None:
    """Derive the constants of the tilt gain; None if `settings` do not learn it."""
    step_s = settings.horizon.update_period_s
    if settings.observer.tilt_gain != "learnt":
        return None
    return TiltGainConstants(
        quick_row=_row(QUICK_RAD_S * step_s),
        slow_row=_row(SLOW_RAD_S * step_s),
        least_m_step2=LEAST_LEARNT_M_S2 * step_s**2,
        most_m_step2=MOST_ERROR_M_S2 * step_s**2,
        rate_step2_m=RATE_1_S / step_s,
        inverse=reciprocal(LEAST_GAIN, MOST_GAIN, INVERSE_ERROR),
    )


def tilt_gain_context(found: TiltGainConstants | None) -> dict[str, object]:
    """Return what the templates of the tilt gain insert."""
    return {
        "tilt_gain": found,
        "gain_quick_rad_s": QUICK_RAD_S,
        "gain_slow_rad_s": SLOW_RAD_S,
        "gain_least_m_s2": LEAST_LEARNT_M_S2,
        "gain_most_m_s2": MOST_ERROR_M_S2,
        "gain_rate_1_s": RATE_1_S,
        "gain_range": (LEAST_GAIN, MOST_GAIN),
        "gain_free": FREE_SHARE,
    }


def _row(steps: float) -> NDArray[np.float64]:
    """Return the weights of the old mean and of the new value in a low-pass with 1/`steps` of memory."""
    kept = float(np.exp(-steps))
    return np.array([kept, 1 - kept])
