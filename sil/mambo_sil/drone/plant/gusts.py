"""Horizontal gusts: the Dryden model of MIL-F-8785C (1980, section 3.7) and MIL-HDBK-1797, at low altitude.

The commands run its equal in C, `flight/engine/world.h`, which has the same bits.

Below 1000 ft, with the height h in ft, the mean wind W20 at 20 ft and the mean wind V at height h:

    sigma_w = 0.1 W20    sigma_u = sigma_v = sigma_w / (0.177 + 0.000823 h)^0.4
    L_u = L_v = h / (0.177 + 0.000823 h)^1.2
    H_u(s) = sigma_u sqrt(2 L_u / (pi V)) / (1 + L_u s / V)
    H_v(s) = sigma_v sqrt(L_v / (pi V)) (1 + sqrt(3) L_v s / V) / (1 + L_v s / V)^2

u is the gust along the mean wind, v the gust across it. V = W20 ln(h / z0) / ln(20 / z0) with z0 = 0.15 ft
(category C flight phases). White noise drives both filters. They are discretized exactly: the sampled gusts
have the variance and the autocorrelation of the continuous ones.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray, PerFlight
from mambo_sil.drone.plant.elementary import exponential, logarithm, sine_cosine
from mambo_sil.drone.plant.randomness import Draws, Purpose

FOOT_M: Final = 0.3048
MIN_HEIGHT_FT: Final = 10.0
"""Lower end of the model's range of heights: below it, its scales at 10 ft are used."""
ROUGHNESS_FT: Final = 0.15
REFERENCE_FT: Final = 20.0
KNOT_M_S: Final = 1852.0 / 3600.0
LIGHT_M_S: Final = 15.0 * KNOT_M_S
"""W20 of light turbulence in the specifications."""
MIN_SPEED_M_S: Final = 0.1
"""Lower bound on V in the filters' time constant L / V: with V = 0 the gusts would not vary."""


def mean_speed_m_s(speed_20ft_m_s: FloatArray, height_m: float) -> FloatArray:
    """Return the mean wind (n,) in m/s at a height of at least 3 ft, from that at 20 ft (n,)."""
    height_ft = height_m / FOOT_M
    profile = logarithm(height_ft / ROUGHNESS_FT) / logarithm(REFERENCE_FT / ROUGHNESS_FT)
    return np.asarray(speed_20ft_m_s * profile)


@dataclass(frozen=True)
class Scales:
    """Scales of the gusts at one height, the same along the wind and across it."""

    length_m: float
    """L_u = L_v."""
    intensity: float
    """Standard deviation over W20: sigma_u / W20 = sigma_v / W20."""


def low_altitude_scales(height_m: float) -> Scales:
    """Return length and intensity of the horizontal gusts at a height."""
    height_ft = max(height_m / FOOT_M, MIN_HEIGHT_FT)
    factor = 0.177 + 0.000823 * height_ft
    power = float(exponential(0.4 * logarithm(factor)))
    return Scales(height_ft / (power * power * power) * FOOT_M, 0.1 / power)


ACROSS_GAINS: Final = (math.sqrt(3.0 / 2.0), (1.0 - math.sqrt(3.0)) / math.sqrt(2.0))
"""Gains of the states a and b in the gust across the wind."""


@dataclass(frozen=True, eq=False)
class GustFilter:
    """The filters of n flights, sampled at a fixed step; every field is (n,)."""

    mean_m_s: FloatArray
    sigma_m_s: FloatArray
    """Standard deviation of the gusts."""
    heading: tuple[FloatArray, FloatArray]
    """Cosine and sine of the direction towards which the air moves."""
    x: FloatArray
    """Step in the dimensionless time."""
    decay: FloatArray
    """exp(-x)."""
    root_aa: FloatArray
    root_ab: FloatArray
    root_bb: FloatArray
    """Cholesky factor of the covariance of an increment of the states a and b."""


def coefficients(
    speed_20ft_m_s: PerFlight, direction_rad: PerFlight, flights: int, *, height_m: float, step_s: float
) -> GustFilter:
    """Return the filters of n flights at one height."""
    speed_20ft = np.broadcast_to(np.asarray(speed_20ft_m_s, np.float64), flights)
    sine, cosine = sine_cosine(np.broadcast_to(np.asarray(direction_rad, np.float64), flights))
    scales = low_altitude_scales(height_m)
    mean_m_s = mean_speed_m_s(speed_20ft, height_m)
    x = step_s * np.maximum(np.abs(mean_m_s), MIN_SPEED_M_S) / scales.length_m
    decay = exponential(-x)
    # Stationary covariance for w of intensity 2: E aa = 1, E ab = 1/2, E bb = 1/2.
    # aa, ab, bb: covariance of the increment.
    decay_squared = decay * decay
    aa = 1.0 - decay_squared
    ab = 0.5 - decay_squared * (x + 0.5)
    bb = 0.5 - decay_squared * (x * x + x + 0.5)
    root_aa = np.sqrt(aa)
    root_ab = ab / root_aa
    return GustFilter(
        mean_m_s=mean_m_s,
        sigma_m_s=scales.intensity * speed_20ft,
        heading=(cosine, sine),
        x=x,
        decay=decay,
        root_aa=root_aa,
        root_ab=root_ab,
        root_bb=np.sqrt(np.maximum(bb - root_ab * root_ab, 0.0)),
    )


class Gusts:
    """Generates the wind of n flights at one height, one tick after the other.

    In the dimensionless time x = t V / L the filter of v has the states a' = -a + w and b' = -b + a, w white
    noise, and the output (sqrt(3) a + (1 - sqrt(3)) b) / sqrt(2) of unit variance. The filter of u has one
    state with the equation of a. Each tick multiplies the states by the transition matrix and adds a Gaussian
    increment. The covariance of the increment is the stationary covariance minus that of the propagated
    states, so the states stay stationary.
    """

    def __init__(
        self,
        speed_20ft_m_s: PerFlight,
        direction_rad: PerFlight,
        seeds: Sequence[int],
        *,
        height_m: float,
        step_s: float,
    ) -> None:
        self._filter = coefficients(
            speed_20ft_m_s, direction_rad, len(seeds), height_m=height_m, step_s=step_s
        )
        self._draws = Draws(seeds, Purpose.GUSTS, 3)
        first = self._draws.next()
        self._u = first[0].copy()
        self._a = first[1].copy()
        self._b = 0.5 * first[1] + 0.5 * first[2]

    def next(self) -> tuple[FloatArray, FloatArray]:
        """Return the air velocity in m/s along world x (n,) and y (n,); advance the filters by a tick."""
        f, (gain_a, gain_b) = self._filter, ACROSS_GAINS
        along = f.mean_m_s + f.sigma_m_s * self._u
        across = f.sigma_m_s * (gain_a * self._a + gain_b * self._b)
        cosine, sine = f.heading
        drawn = self._draws.next()
        self._u = f.decay * self._u + f.root_aa * drawn[0]
        self._b = f.decay * (self._b + f.x * self._a) + (f.root_ab * drawn[1] + f.root_bb * drawn[2])
        self._a = f.decay * self._a + f.root_aa * drawn[1]
        return cosine * along - sine * across, sine * along + cosine * across
