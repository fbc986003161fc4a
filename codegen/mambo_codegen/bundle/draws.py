"""Pseudo-random numbers of the self-test, and their scales: C and NumPy have the same integers."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods import Method
from mambo_codegen.methods.shared.inputs import Rows
from mambo_codegen.methods.shared.limits_constants import LimitsConstants
from mambo_codegen.methods.shared.math import Real, rounded
from mambo_codegen.numbers.fixed_point import LARGEST
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.numbers.literals import SCALARS
from mambo_codegen.numbers.representation import WEIGHT_LIMIT, YAW_LIMIT_RAD, Representation

_UNIT_BITS: Final = 23
_UNIT: Final = 1 << _UNIT_BITS
"""Random numbers are integers in -_UNIT.._UNIT - 1, which every scalar type represents exactly."""
_MULTIPLIER: Final = 2654435761
"""The prime nearest to 2**32 / golden ratio (Knuth, The Art of Computer Programming 3, section 6.4)."""
_LARGE: Final = 1e9
"""Out of every range, as NaN is."""
_LARGEST_TURN_RAD: Final = 4.0
_LARGEST_TILT_RAD: Final = 0.8
"""Beyond what any small angle stands for, and the steepest that counts for a thrust."""
_MOST_SPEED_M_S: Final = 2.0
"""Of the limits that are drawn: a drone that is slow can be far enough from a near wall."""

Words = NDArray[np.uint32]


@dataclass(frozen=True)
class InputScales:
    """Factors from random integers to inputs; errors between drone and target have four sizes, and none.

    In floating point an input is integer x factor. In fixed point, whose formats cannot represent factors
    that small, it is integer x factor / _UNIT.
    """

    target_position_m: float
    target_velocity_m_s: float
    error_position_m: tuple[float, ...]
    error_velocity_m_s: tuple[float, ...]
    attitude_rad: float
    yaw_rad: float
    heading_rad: float
    turn_rad: float
    thrust_m_s2: float
    """Of the thrust less that of hover, without a height; with one of the thrust."""
    hover_m_s2: float
    target_motion: float
    """Of what the tracker reads: the change of the target's velocity from step to step, in m/s, or a given
    acceleration, in m/s^2; 0 without a tracker."""
    climb_motion: float
    """The same of the target's climb; 0 without a height."""
    weights: tuple[float, ...]
    """With a 1-norm."""
    limits: tuple[float, ...]
    """What stands for the limits of the settings."""


def input_scales(method: Method) -> InputScales:
    """Return the factors that give inputs as in a flight, within the ranges of the settings."""
    settings = method.settings
    half_m, half_m_s = settings.ranges.position_m / 2, settings.ranges.velocity_m_s / 2
    position_m, velocity_m_s = min(2.0, half_m), min(1.0, half_m_s)
    near = 0.5, 0.05, 0.0025, 0.0
    fixed, most_m_s2 = settings.code.scalar == "fixed", settings.ranges.thrust_acceleration_max_m_s2
    hover_m_s2 = min(GRAVITY_M_S2, most_m_s2) if fixed else GRAVITY_M_S2
    thrust_m_s2 = min(3.0, most_m_s2 - hover_m_s2) if fixed else 3.0
    if method.has_height:
        thrust_m_s2 = min(2 * GRAVITY_M_S2, most_m_s2)
    unit = 1 if fixed else _UNIT
    motions = []
    for tracker in (method.tracker, method.climb_tracker):
        if tracker:
            most = settings.ranges.thrust_acceleration_max_m_s2 if tracker.is_given else half_m_s / 4
        motions.append(min(tracker.tested_input, most) if tracker else 0.0)
    cost = settings.cost
    weights = (cost.tracking_weight, cost.effort_weight) if method.weight_limits else ()
    return InputScales(
        target_position_m=position_m / unit,
        target_velocity_m_s=velocity_m_s / unit,
        error_position_m=tuple(
            error / unit for error in (min(20.0, half_m), *(size * position_m for size in near))
        ),
        error_velocity_m_s=tuple(
            error / unit for error in (min(10.0, half_m_s), *(size * velocity_m_s for size in near))
        ),
        attitude_rad=_LARGEST_TILT_RAD / unit,
        yaw_rad=100.0 / unit,
        heading_rad=YAW_LIMIT_RAD / unit,
        turn_rad=_LARGEST_TURN_RAD / unit,
        thrust_m_s2=thrust_m_s2 / unit,
        hover_m_s2=hover_m_s2,
        target_motion=motions[0] / unit,
        climb_motion=motions[1] / unit,
        weights=tuple(min(2 * weight, WEIGHT_LIMIT) / unit for weight in weights),
        limits=tuple(one / unit for one in _limits_scales(method.limiting, 2 * position_m)),
    )


def _limits_scales(limits: LimitsConstants | None, wall_m: float) -> tuple[float, ...]:
    """Return the largest limits that are drawn, in the order of nmpc_limits_t; none without limits.

    Along y and in height the least may be drawn above the largest, which is refused.
    """
    if limits is None:
        return ()
    speed_m_s, braking_m_s2, *_ = limits.limits.tolist()
    tilt_rad, vertical = float(limits.limits[6]), limits.limits[9:].tolist()
    walls = (-wall_m, wall_m, wall_m, wall_m)
    height = (wall_m, wall_m, *vertical) if vertical else ()
    return (min(speed_m_s, _MOST_SPEED_M_S), braking_m_s2, *walls, tilt_rad, *height)


def scale_constants(method: Method, scales: InputScales) -> list[tuple[str, float, str]]:
    """Return the scales that have a constant in the C: its name, the scale and its quantity."""
    tracker, has_height = method.tracker, method.has_height
    is_given = method.settings.target.gives_acceleration
    found = [
        ("TARGET_M", scales.target_position_m, "position"),
        ("TARGET_M_S", scales.target_velocity_m_s, "velocity"),
        ("ATTITUDE_RAD", scales.attitude_rad, "angle"),
        ("YAW_RAD", scales.yaw_rad, "yaw"),
        ("HEADING_RAD", scales.heading_rad, "yaw"),
        ("TURN_RAD", scales.turn_rad, "yaw"),
        ("THRUST_M_S2", scales.thrust_m_s2, "thrust"),
    ]
    if not has_height:
        found.append(("HOVER_M_S2", scales.hover_m_s2, "thrust"))
    if tracker or is_given:
        quantity = "thrust" if is_given else "velocity"
        ending = "M_S2" if is_given else "CHANGE_M_S"
        found.append(("TARGET_M_S2" if is_given else ending, scales.target_motion, quantity))
        if has_height:
            found.append((f"CLIMB_{ending}", scales.climb_motion, quantity))
    for name, scale, quantity in zip(
        ("TRACKING", "EFFORT"), scales.weights, ("tracking", "effort"), strict=False
    ):
        found.append((name, scale, quantity))
    return [*found, ("TINY_M", tiny_m(method), "position")]


def tiny_m(method: Method) -> float:
    """Return a position below the smallest normal number; 0 in fixed point."""
    scalar = method.settings.code.scalar
    return 0.0 if scalar == "fixed" else float(np.finfo(SCALARS[scalar]).smallest_normal) / 100


class EpisodeDraws:
    """n random number generators: Marsaglia's xorshift (Journal of Statistical Software 8(14), 2003).

    last: (n,) the numbers that they drew last, which are their states.
    """

    def __init__(self, episodes: Words, numbers: Representation) -> None:
        self.last = fold(np.zeros_like(episodes), episodes + np.uint32(1))
        self._numbers = numbers

    def next(self) -> Words:
        """Return the next 32 bits of every generator."""
        number = self.last
        number = number ^ (number << np.uint32(13))
        number = number ^ (number >> np.uint32(17))
        number = number ^ (number << np.uint32(5))
        self.last = number
        return number

    def restore(self, rows: Rows, before: Words) -> None:
        """Put the generators of `rows` (n,) back to the numbers that they drew last."""
        self.last = np.where(rows, before, self.last)

    def draw(self, scale: Real) -> Real:
        """Return the next integer of 24 bits with a sign times `scale`, rounded once."""
        return self._scaled(self._integers(), scale)

    def share(self, scale: Real) -> Real:
        """Return such an integer without its sign times `scale`."""
        return self._scaled(np.abs(self._integers()), scale)

    def spoil(self, numbers: Real) -> Real:
        """Return numbers (n, k), each out of range in one of 64 cases, of the other sign in another."""
        choice = self.next()
        wrong = np.where((choice & 32 == 0)[:, None], self.beyond(choice >> 6)[:, None], -numbers)
        spoilt: Real = np.where((choice & 31)[:, None] == np.arange(numbers.shape[1]), wrong, numbers)
        return spoilt

    def beyond(self, choice: NDArray[Any]) -> Any:
        """Return numbers out of range (n,): NaN or a large one of either sign, by the lowest bits."""
        sign = np.where(choice & 2 == 0, 1, -1)
        if self._numbers.formats is not None:
            return sign * (LARGEST - 1)
        scalar = self._numbers.scalar
        return np.where(choice & 1 == 0, scalar(np.nan), (sign * _LARGE).astype(scalar))

    def _integers(self) -> NDArray[np.int32]:
        """Return the upper 24 of the next 32 bits with a sign; 0, -1 or +/- _UNIT in three of 128 cases."""
        word = self.next()
        drawn = (word >> 8).astype(np.int32) - _UNIT
        exact = [np.full_like(drawn, one) for one in (0, -1)]
        exact.append(np.where(word & 128 == 0, -_UNIT, _UNIT).astype(np.int32))
        integers: NDArray[np.int32] = np.select([word & 127 == k for k in range(3)], exact, drawn)
        return integers

    def _scaled(self, whole: NDArray[np.int32], scale: Real) -> Real:
        integers = whole.astype(self._numbers.computed)
        if self._numbers.formats is not None:
            return rounded(integers * scale, _UNIT_BITS)
        scaled: Real = integers * scale
        return scaled


def fold(digest: NDArray[Any], word: NDArray[Any]) -> Words:
    """Mix a word into a digest; for a given digest, different words give different results."""
    mixed = (digest ^ word) * np.uint32(_MULTIPLIER)
    folded: Words = mixed ^ (mixed >> np.uint32(15))
    return folded
