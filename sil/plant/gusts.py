"""Gusts: the Dryden model of MIL-F-8785C (1980, section 3.7) and MIL-HDBK-1797, at low altitude.

Below 1000 ft, with the height h in ft and the mean wind W20 at 20 ft:

    sigma_w = 0.1 W20    sigma_u = sigma_v = sigma_w / (0.177 + 0.000823 h)^0.4
    L_u = L_v = h / (0.177 + 0.000823 h)^1.2
    H_u(s) = sigma_u sqrt(2 L_u / (pi V)) / (1 + L_u s / V)
    H_v(s) = sigma_v sqrt(L_v / (pi V)) (1 + sqrt(3) L_v s / V) / (1 + L_v s / V)^2

u blows along the mean wind, v across. The mean wind is W20 ln(h / z0) / ln(20 / z0), z0 = 0.15 ft (category C
flight phases). White noise drives both filters, which are sampled exactly: at the ticks the gusts have the
variance and the correlation of the continuous ones.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from mambo_nmpc.sil.plant.arrays import FloatArray, PerFlight
from mambo_nmpc.sil.plant.randomness import Draws, Purpose

FOOT_M: Final = 0.3048
LOWEST_FT: Final = 10.0
"""Least height for which the model states scales: what flies lower is given those of 10 ft."""
ROUGHNESS_FT: Final = 0.15
REFERENCE_FT: Final = 20.0
KNOT_M_S: Final = 1852.0 / 3600.0
LIGHT_M_S: Final = 15.0 * KNOT_M_S
"""Mean wind at 20 ft that the specifications take for light turbulence."""
SLOWEST_M_S: Final = 0.1
"""Least speed at which gusts are carried past the vehicle: in still air they would never change."""


def mean_speed_m_s(speed_20ft_m_s: FloatArray, height_m: float) -> FloatArray:
    """Return the mean wind at a height of 3 ft or more."""
    height_ft = height_m / FOOT_M
    profile = math.log(height_ft / ROUGHNESS_FT) / math.log(REFERENCE_FT / ROUGHNESS_FT)
    return np.asarray(speed_20ft_m_s * profile)


@dataclass(frozen=True)
class Scales:
    """Length in m of the gusts along and across, and their standard deviation over W20."""

    length_m: float
    intensity: float


def low_altitude(height_m: float) -> Scales:
    """Return the scales of the horizontal gusts at a height."""
    height_ft = max(height_m / FOOT_M, LOWEST_FT)
    factor = 0.177 + 0.000823 * height_ft
    return Scales(height_ft / factor**1.2 * FOOT_M, 0.1 / factor**0.4)


_FROM_A: Final = math.sqrt(3.0 / 2.0)
_FROM_B: Final = (1.0 - math.sqrt(3.0)) / math.sqrt(2.0)


class Gusts:
    """The moving air of n flights at one height, a tick at a time.

    With x = t V / L, the filter of v has the states a' = -a + w, b' = -b + a in x, and the output
    (sqrt(3) a + (1 - sqrt(3)) b) / sqrt(2) of unit variance; that of u has one state like a. One tick later
    the states have moved freely and by a Gaussian step, whose covariance is what the stationary one lacks.
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
        flights = len(seeds)
        speed_20ft = np.broadcast_to(np.asarray(speed_20ft_m_s, np.float64), flights)
        heading = np.broadcast_to(np.asarray(direction_rad, np.float64), flights)
        scales = low_altitude(height_m)
        self._mean = mean_speed_m_s(speed_20ft, height_m)
        self._sigma = scales.intensity * speed_20ft
        self._along = np.cos(heading), np.sin(heading)
        x = step_s * np.maximum(np.abs(self._mean), SLOWEST_M_S) / scales.length_m
        self._decay, self._x = np.exp(-x), x
        # Stationary, with unit white noise times sqrt(2): E aa = 1, E ab = 1/2, E bb = 1/2.
        left = self._decay * self._decay
        aa = 1.0 - left
        ab = 0.5 - left * (x + 0.5)
        bb = 0.5 - left * (x * x + x + 0.5)
        self._root_aa = np.sqrt(aa)
        self._root_ab = ab / self._root_aa
        self._root_bb = np.sqrt(np.maximum(bb - self._root_ab * self._root_ab, 0.0))
        self._draws = Draws(seeds, Purpose.GUSTS, 3)
        first = self._draws.next()
        self._u = first[0].copy()
        self._a = first[1].copy()
        self._b = 0.5 * first[1] + 0.5 * first[2]

    def next(self) -> tuple[FloatArray, FloatArray]:
        """Return the velocity of the air (n,) along x and y of the world, and move on by a tick."""
        along = self._mean + self._sigma * self._u
        across = self._sigma * (_FROM_A * self._a + _FROM_B * self._b)
        cosine, sine = self._along
        drawn = self._draws.next()
        self._u = self._decay * self._u + self._root_aa * drawn[0]
        self._b = self._decay * (self._b + self._x * self._a) + (
            self._root_ab * drawn[1] + self._root_bb * drawn[2]
        )
        self._a = self._decay * self._a + self._root_aa * drawn[1]
        return cosine * along - sine * across, sine * along + cosine * across
