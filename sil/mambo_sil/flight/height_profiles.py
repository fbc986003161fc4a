"""Heights of targets over time: height above the ground, climb and vertical acceleration, up positive.

Before t = 0 a target rests at the first height of its profile. A jump of height or climb has no acceleration.
"""

import math
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import ArrayLike

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.elementary import sine_cosine

HOVER_HEIGHT_M: Final = 1.1
"""Height of every level course, and of the first point of a curve in space that starts in the air."""

RISE_TIME_S: Final = 1.0
FALL_TIME_S: Final = 6.0
"""Times at which a target begins to rise and to come down again, if it does both."""

PLANNED_S: Final = 2.0
"""Duration of a planned take-off, and of a planned landing."""


class HeightProfile(Protocol):
    """The height of a target as a function of time."""

    def vertical(self, time_s: ArrayLike) -> FloatArray:
        """Return [height, climb, acceleration] (..., 3) in m, m/s, m/s^2 at times (...)."""
        ...


def level(time_s: ArrayLike) -> FloatArray:
    """Return the height of a level course (..., 3)."""
    return _stack(time_s, HOVER_HEIGHT_M, 0.0, 0.0)


def _stack(time_s: ArrayLike, *profile: ArrayLike) -> FloatArray:
    """Return height, climb and acceleration, each (...) or one value, as (..., 3); no motion before t = 0."""
    stacked = np.stack([np.broadcast_to(one, np.shape(time_s)) for one in profile], axis=-1)
    stacked[..., 1:] *= (np.asarray(time_s) >= 0.0)[..., np.newaxis]
    return stacked


@dataclass(frozen=True)
class Swing:
    """A sine about the hover height, upwards first; amplitude in m, angular rate in rad/s."""

    amplitude_m: float
    angular_rate_rad_s: float

    def vertical(self, time_s: ArrayLike) -> FloatArray:
        """Return [height, climb, acceleration] (..., 3)."""
        rate, amplitude = self.angular_rate_rad_s, self.amplitude_m
        sine, cosine = sine_cosine(rate * np.maximum(time_s, 0.0))
        swing = amplitude * sine
        return _stack(time_s, HOVER_HEIGHT_M + swing, (amplitude * rate) * cosine, -(rate * rate) * swing)


@dataclass(frozen=True)
class Climb:
    """A constant climb from the hover height, in m/s."""

    climb_m_s: float

    def vertical(self, time_s: ArrayLike) -> FloatArray:
        """Return [height, climb, acceleration] (..., 3)."""
        return _stack(time_s, HOVER_HEIGHT_M + self.climb_m_s * np.maximum(time_s, 0.0), self.climb_m_s, 0.0)


@dataclass(frozen=True)
class UpAndDown:
    """The hover height, and between `RISE_TIME_S` and `FALL_TIME_S` a height that is `rise_m` above it.

    The target jumps; its climb is always 0.
    """

    rise_m: float

    def vertical(self, time_s: ArrayLike) -> FloatArray:
        """Return [height, climb, acceleration] (..., 3)."""
        up = (np.asarray(time_s) >= RISE_TIME_S) & (np.asarray(time_s) < FALL_TIME_S)
        return _stack(time_s, np.where(up, HOVER_HEIGHT_M + self.rise_m, HOVER_HEIGHT_M), 0.0, 0.0)


@dataclass(frozen=True)
class TakeOffAndLanding:
    """From the ground to `top_m`, beginning at `RISE_TIME_S`, and back, beginning at `FALL_TIME_S`.

    Each takes `PLANNED_S`, on the curve of least jerk: s = 10 p^3 - 15 p^4 + 6 p^5, p the share of the time
    (Flash and Hogan 1985, eq 3).
    """

    top_m: float

    def vertical(self, time_s: ArrayLike) -> FloatArray:
        """Return [height, climb, acceleration] (..., 3)."""
        time_s = np.asarray(time_s, np.float64)
        landing = time_s >= FALL_TIME_S
        begun_s = np.where(landing, time_s - FALL_TIME_S, time_s - RISE_TIME_S)
        p = np.clip(begun_s / PLANNED_S, 0.0, 1.0)
        share = (p * p * p) * (10.0 + p * (6.0 * p - 15.0))
        rate = (p * p) * (30.0 + p * (30.0 * p - 60.0)) / PLANNED_S
        change = p * (60.0 + p * (120.0 * p - 180.0)) / (PLANNED_S * PLANNED_S)
        signed_m = np.where(landing, -self.top_m, self.top_m)
        height_m = self.top_m * np.where(landing, 1.0 - share, share)
        return _stack(time_s, height_m, signed_m * rate, signed_m * change)


def helix_climb(angular_rate_rad_s: float, pitch_m: float) -> Climb:
    """Return the climb of a helix that rises by `pitch_m` in each turn, whichever way it turns."""
    return Climb(pitch_m * abs(angular_rate_rad_s) / (2.0 * math.pi))
