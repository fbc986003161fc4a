"""Constants of the target's observer: memory, gains and limits, as the chapter of nmpc.c uses them.

The observer fits a cubic to the last n velocities of a set-point, by least squares, where n follows from how
much their innovations change from one set-point to the next: a curve's change little, those of noise much.
Velocities are in m/s, the derivatives in m/s per step, per step^2 and per step^3.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.quadratic.height_constants import jump_m_s2
from mambo_codegen.methods.shared.tracker_constants import target_limit_m_s2
from mambo_codegen.port.taken import AHEAD_S
from mambo_codegen.settings.optional_sections import Height
from mambo_codegen.settings.sections import Sections

_PERIOD_S: Final = 0.01
"""The update period at which the times and slopes below were chosen by flights."""

MEMORY_S: Final = (0.18, 0.42)
"""The memory without noise; the second is that of the slower of its two rises."""
MEMORY_S2_M: Final = (32.0, 8.0)
"""What it grows by with the noise, in s per m/s: quickly, and slowly from where the second line is less."""
LONGEST_MEMORY_S: Final = 0.76
FIRST_MEMORY_S: Final = 0.32
"""Of the first set-point, and of one that has jumped."""
FALL: Final = 3
"""A memory that is too long loses at most so many set-points in a step, which adds one."""
MOST_SET_POINTS: Final = 250
LEAST_SET_POINTS: Final = 5
"""A cubic has four coefficients."""

KNOWN_MEMORY_S: Final = 0.08
LONGEST_KNOWN_MEMORY_S: Final = 0.2
KNOWN_MEMORY_S3_M: Final = 1.0
"""The same for known accelerations, in s and in s per m/s^2, by a parabola."""
LEAST_KNOWN_SET_POINTS: Final = 4

NOISE_MEMORY_S: Final = 1 / 6
"""The time over which the noise is a mean."""
FIRST_NOISE_M_S: Final = 0.03
"""What it is taken for at the first set-point."""
KNOWN_JUMP_SHARE: Final = 0.1
"""A known acceleration has jumped if it changes by this share of its limit in a step."""
AHEAD_SNAP_S: Final = 0.1
"""The time over which the change of the jerk is a mean where the acceleration ahead is known."""
JERK_1_S: Final = 10.0
SNAP_1_S2: Final = 2.1
KNOWN_SNAP_1_S2: Final = 6.4
"""The largest derivatives over the largest acceleration."""

DESIRED_GAIN: Final = 0.58
"""The gain of the filter of the desired velocity: less passes fences by more, more feels noise.

The gain of the jerk is that of Benedict and Bordner, as in tracker.c.
"""

FADE_SHARE: Final = 0.06
FADE_END: Final = 3
"""The weight of the acceleration falls from where its deviation by noise is this share of what the tilt limit
gives; at FADE_END times that it is 0."""


@dataclass(frozen=True)
class MotionLimits:
    """Limits of a target's motion along an axis, float64, in m/s per step^k.

    acceleration, jerk, snap: largest; known_snap: of the same with known accelerations.
    jump, known_jump: the largest change that is none, of a velocity and of an acceleration, without noise.
    """

    acceleration: float
    jerk: float
    snap: float
    known_snap: float
    jump: float
    known_jump: float

    @property
    def row(self) -> list[float]:
        """The limits in the order of the C's table."""
        return [self.acceleration, self.jerk, self.snap, self.known_snap, self.jump, self.known_jump]


@dataclass(frozen=True)
class TargetObserverConstants:
    """Constants of the observer, float64.

    update_s:      the update period.
    velocity_range: largest velocity of a target, m/s.
    least, first, longest: set-points in memory: the fewest, those at first, the most.
    memory_slopes: (2,) set-points per m/s of noise.
    slow:          what the second line has without noise.
    gains:         (rows, 4) of velocity to snap, for `least` to `longest` set-points.
    known_least, known_longest, known_slope, known_gains (rows, 3): the same for known accelerations.
    noise_share:   of the latest change in the noise.
    first_noise, most_noise: of the noise, m/s.
    fade:          by how much the belief falls per m/s of noise; fade_top: what it would be without noise.
    ahead_share:   from the difference of two accelerations, AHEAD_S apart, to a jerk in steps.
    snap_share:    of the latest change of such a jerk in the snap.
    half_ahead_s:  by how much such a jerk is ahead.
    desired_gain, desired_jerk_gain: of the difference of a change of the desired velocity within limits.
    level, climb:  limits along x and y, and of the height; None without.
    """

    update_s: float
    velocity_range: float
    least: int
    first: int
    longest: int
    memory_slopes: tuple[float, float]
    slow: int
    gains: NDArray[np.float64]
    known_least: int
    known_longest: int
    known_slope: float
    known_gains: NDArray[np.float64]
    noise_share: float
    first_noise: float
    most_noise: float
    fade: float
    fade_top: float
    ahead_share: float
    snap_share: float
    half_ahead_s: float
    desired_gain: float
    desired_jerk_gain: float
    level: MotionLimits
    climb: MotionLimits | None

    @property
    def last_row(self) -> int:
        """The last row of `gains`."""
        return len(self.gains) - 1

    @property
    def known_last_row(self) -> int:
        """The last row of `known_gains`."""
        return len(self.known_gains) - 1

    @property
    def least_drawn(self) -> int:
        """The smallest memory that the self-test writes: it grows by 1 before it is used."""
        return self.least - 1

    @property
    def limits(self) -> list[MotionLimits]:
        """The limits of each kind of axis."""
        return [self.level, *([self.climb] if self.climb else [])]


def target_observer_constants(settings: Sections) -> TargetObserverConstants:
    """Derive the constants of the observer."""
    update_s = settings.horizon.update_period_s
    # Noise that is independent from set-point to set-point counts by its density.
    density = math.sqrt(update_s / _PERIOD_S)
    least, slow, longest, first = (
        set_points(time_s, update_s, LEAST_SET_POINTS)
        for time_s in (*MEMORY_S, LONGEST_MEMORY_S, FIRST_MEMORY_S)
    )
    known_least, known_longest = (
        set_points(time_s, update_s, LEAST_KNOWN_SET_POINTS)
        for time_s in (KNOWN_MEMORY_S, LONGEST_KNOWN_MEMORY_S)
    )
    gains = newest_derivatives(3, least, longest)
    most_m_s2 = target_limit_m_s2(settings)
    fade = _fade(update_s, longest, most_m_s2)
    return TargetObserverConstants(
        update_s=update_s,
        velocity_range=settings.ranges.velocity_m_s,
        least=least,
        first=first,
        longest=longest,
        memory_slopes=(
            MEMORY_S2_M[0] / update_s * density,
            MEMORY_S2_M[1] / update_s * density,
        ),
        slow=slow,
        gains=gains,
        known_least=known_least,
        known_longest=known_longest,
        known_slope=KNOWN_MEMORY_S3_M / update_s**2 * density,
        known_gains=newest_derivatives(2, known_least, known_longest),
        noise_share=min(1.0, update_s / NOISE_MEMORY_S),
        first_noise=FIRST_NOISE_M_S,
        most_noise=min(2 * FADE_END * fade, settings.ranges.velocity_m_s / 4),
        fade=1 / ((FADE_END - 1) * fade),
        fade_top=FADE_END / (FADE_END - 1),
        ahead_share=update_s / AHEAD_S,
        snap_share=min(1.0, update_s / AHEAD_SNAP_S),
        half_ahead_s=AHEAD_S / 2,
        desired_gain=DESIRED_GAIN,
        desired_jerk_gain=DESIRED_GAIN**2 / (2 - DESIRED_GAIN),
        level=motion_limits(settings, most_m_s2),
        climb=motion_limits(settings, _climb_m_s2(settings.height, settings)) if settings.height else None,
    )


def largest_velocities(found: TargetObserverConstants) -> list[float]:
    """Return bounds of what the observer adds up, m/s: a prediction, and a change of an innovation."""
    return [
        bound
        for limits in found.limits
        for bound in (
            found.velocity_range + (3 * limits.acceleration),
            (2 * found.velocity_range) + limits.jump + (4 * found.most_noise),
        )
    ]


def set_points(memory_s: float, update_s: float, least: int) -> int:
    """Return how many set-points a memory holds, from `least` on."""
    return min(max(round(memory_s / update_s), least), MOST_SET_POINTS)


@lru_cache(maxsize=8)
def newest_derivatives(order: int, least: int, most: int) -> NDArray[np.float64]:
    """Return the weights (rows, order + 1) of the newest of n values in a polynomial's derivatives there.

    The polynomial of degree `order` fits all n by least squares; a row for each n from `least` to `most`.
    They are those of a recursion whose innovation is the newest value less its prediction.
    """
    return np.array(
        [
            [float(math.factorial(k) * one) for k, one in enumerate(_fit(order, n, 0))]
            for n in range(least, most + 1)
        ]
    )


def _fit(order: int, n: int, column: int) -> list[Fraction]:
    """Return a column of the inverse normal matrix of a polynomial through n values, the newest at 0."""
    rows = [
        [Fraction(sum((-k) ** (i + j) for k in range(n))) for j in range(order + 1)]
        + [Fraction(int(i == column))]
        for i in range(order + 1)
    ]
    for pivot, row in enumerate(rows):
        row[:] = [value / row[pivot] for value in row]
        for other in rows:
            if other is not row:
                factor = other[pivot]
                other[:] = [a - factor * b for a, b in zip(other, row, strict=True)]
    return [row[-1] for row in rows]


def _climb_m_s2(height: Height, settings: Sections) -> float:
    """Return the largest vertical acceleration of a target."""
    return min(jump_m_s2(height), settings.ranges.thrust_acceleration_max_m_s2)


def motion_limits(settings: Sections, most_m_s2: float) -> MotionLimits:
    """Return the limits of a target that accelerates by at most `most_m_s2`."""
    update_s = settings.horizon.update_period_s
    acceleration = update_s * most_m_s2
    return MotionLimits(
        acceleration=acceleration,
        jerk=acceleration * min(1.0, JERK_1_S * update_s),
        snap=acceleration * min(1.0, SNAP_1_S2 * update_s**2),
        known_snap=acceleration * min(1.0, KNOWN_SNAP_1_S2 * update_s**2),
        jump=min(acceleration, settings.ranges.velocity_m_s),
        known_jump=KNOWN_JUMP_SHARE * acceleration,
    )


def _fade(update_s: float, longest: int, most_m_s2: float) -> float:
    """Return the noise, m/s, from which on the weight of the acceleration falls.

    The noise is the mean size of the difference of two independent values, 2/sqrt(pi) of their deviation.
    """
    spread = math.sqrt(_fit(3, longest, 1)[1]) / update_s
    return FADE_SHARE * most_m_s2 / 1.5 / spread * 2 / math.sqrt(math.pi)
