"""Constants of the thrust vector: which accelerations a tilt gives, by the direction of the thrust.

With roll phi and pitch theta a thrust has, over its vertical component, sin phi / c to the right and
-sin theta cos phi / c forward, with c = cos phi cos theta. The chapter *thrust vector* has the equations.
"""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.quadratic.reciprocal import Reciprocal, reciprocal
from mambo_codegen.numbers.reach import PLANNED_SHARE, THRUST_LEFT
from mambo_codegen.numbers.trigonometry import ARC_TANGENT_ERROR, arc_tangent
from mambo_codegen.settings.key import Refusal
from mambo_codegen.settings.sections import Sections

EXACT_ERROR: Final = 1e-6
"""The same of the reciprocals of the thrust vector."""

LEAST_SHARE: Final = 0.3
"""A tilt counts as if cos roll cos pitch were at least this."""

MOST_TILT_RAD: Final = 1.2
"""Largest tilt that a command may ask for."""

MOST_SLOPE: Final = 4.0
"""More than any horizontal component of a thrust over its vertical one: 1/LEAST_SHARE, and rounding."""

LEAST_SPARE_M_S2: Final = 1.7
"""A horizontal acceleration that the height always leaves."""

KNOWN_SPARE_RAD: Final = 0.36
"""A tilt that the height always leaves where the target's acceleration is known."""

CHORDS: Final = 4
"""Chords of equal angles that stand for a quarter circle."""


@dataclass(frozen=True)
class ThrustVectorConstants:
    """Constants of the thrust vector, float64, for lengths in m and times in steps of an update period.

    slope_step2_m:  slope per acceleration with the thrust of hover, step^2/m.
    loop_gains, per_loop_gain: (2,) measured per commanded roll and pitch, and the inverse.
    share_inverse:  the reciprocal of c.
    steep_inverse:  the reciprocal of tangents from 1 on.
    arc_tangent:    coefficients of the polynomial, of the scalar type.
    arc_error:      the largest error of the arc tangent, rad.
    spare_m_step2:  the share THRUST_LEFT of the largest thrust.
    chords:         (CHORDS, 2) factors of the largest thrust and of its vertical part in what is spare.
    least_spare_m_step2: what is always spare.
    known_spare:    the same over the vertical part of the thrust, where the target's acceleration is known.
    """

    slope_step2_m: float
    loop_gains: NDArray[np.float64]
    per_loop_gain: NDArray[np.float64]
    share_inverse: Reciprocal
    steep_inverse: Reciprocal
    arc_tangent: tuple[Any, ...]
    arc_error: float
    spare_m_step2: float
    chords: NDArray[np.float64]
    least_spare_m_step2: float
    known_spare: float


def has_thrust_vector(settings: Sections) -> bool:
    """Return whether the controller computes with the direction of the thrust."""
    return settings.height is not None and settings.model.tilt == "exact"


def thrust_vector_constants(settings: Sections, gain_m_step2_rad: float) -> ThrustVectorConstants | None:
    """Derive the constants from `AttitudeConstants.gain_m_step2_rad`; None for small angles."""
    height, model, step2 = settings.height, settings.model, settings.horizon.update_period_s**2
    if height is None or not has_thrust_vector(settings):
        return None
    gains = np.array([model.roll_gain, model.pitch_gain])
    return ThrustVectorConstants(
        slope_step2_m=1 / gain_m_step2_rad,
        loop_gains=gains,
        per_loop_gain=1 / gains,
        share_inverse=reciprocal(LEAST_SHARE, 1.0, EXACT_ERROR),
        steep_inverse=reciprocal(1.0, MOST_SLOPE, EXACT_ERROR),
        arc_tangent=arc_tangent(settings.code.scalar),
        arc_error=ARC_TANGENT_ERROR[settings.code.scalar],
        spare_m_step2=THRUST_LEFT * height.thrust_max_m_s2 * step2,
        chords=_chords(),
        least_spare_m_step2=LEAST_SPARE_M_S2 * step2,
        known_spare=math.tan(KNOWN_SPARE_RAD),
    )


def thrust_vector_context(vector: ThrustVectorConstants | None) -> dict[str, object]:
    """Return what the templates of the thrust vector insert."""
    return {
        "vector": vector,
        "least_share": LEAST_SHARE,
        "most_slope": MOST_SLOPE,
        "quarter_turn": math.pi / 2,
        "thrust_left": THRUST_LEFT,
        "planned_share": PLANNED_SHARE,
        "least_spare_m_s2": LEAST_SPARE_M_S2,
        "known_spare_rad": KNOWN_SPARE_RAD,
    }


def refusals(settings: Sections) -> list[Refusal]:
    """Return why a controller cannot have the tilt of `settings`."""
    if not has_thrust_vector(settings):
        return []
    for angle in ("roll", "pitch"):
        gain = getattr(settings.model, f"{angle}_gain")
        if gain * settings.limits.tilt_rad > MOST_TILT_RAD:
            rule = (
                f'must be at most {MOST_TILT_RAD / gain:.4g} with model.tilt = "exact" and '
                f"model.{angle}_gain = {gain:g}"
            )
            return [Refusal("limits", "tilt_rad", rule)]
    return []


def most_slopes(settings: Sections) -> NDArray[np.float64]:
    """Return the tangents (2,) of the largest tilts, right and forward, less the trims."""
    slopes: NDArray[np.float64] = np.tan(_tilts_rad(settings, -1.0))
    return slopes


def steepest_slope(settings: Sections) -> float:
    """Return the largest slope of any attitude that commands within the tilt limit lead to."""
    tilt_rad = min(float(np.max(_tilts_rad(settings, 1.0))), math.acos(LEAST_SHARE))
    return min(math.tan(tilt_rad) / math.cos(tilt_rad), 1.01 / LEAST_SHARE)


def _tilts_rad(settings: Sections, side: float) -> NDArray[np.float64]:
    """Return the tilts (2,) of roll and pitch at the tilt limit, plus `side` times the trim."""
    model = settings.model
    gains = np.array([model.roll_gain, model.pitch_gain])
    trims_rad = np.abs([model.roll_trim_rad, model.pitch_trim_rad])
    tilts: NDArray[np.float64] = (gains * settings.limits.tilt_rad) + (side * trims_rad)
    return tilts


def _chords() -> NDArray[np.float64]:
    """Return (CHORDS, 2) a, b of a r - b z, whose least stands for sqrt(r^2 - z^2)."""
    angle = math.pi / 2 / CHORDS
    middles = (np.arange(CHORDS) + 0.5) * angle
    return np.stack([math.cos(angle / 2) / np.cos(middles), np.tan(middles)], axis=1)
