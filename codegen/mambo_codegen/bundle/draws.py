"""Pseudo-random numbers of the self-test, and their scales: C and NumPy have the same integers."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods import Method
from mambo_codegen.methods.shared.inputs import Rows
from mambo_codegen.methods.shared.limits_constants import LimitsConstants, in_order
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
_MOST_SPEED_M_S: Final = 2.0
"""Of the limits that are drawn: a drone that is slow can be far enough from a near wall."""

HOVER: Final = "HOVER_M_S2"
TINY: Final = "TINY_M"
"""Numbers by themselves, which are not drawn."""

Words = NDArray[np.uint32]


@dataclass(frozen=True)
class InputScales:
    """Factors from random integers to inputs; errors between drone and target have four sizes, and none.

    In floating point an input is integer x factor. In fixed point, whose formats cannot represent factors
    that small, it is integer x factor / _UNIT.
    """

    of: dict[str, tuple[float, str]]
    """By the name of its constant in C, the scale and its quantity."""
    error_position_m: tuple[float, ...]
    error_velocity_m_s: tuple[float, ...]
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
    drawn = {
        "TARGET_M": (position_m, "position"),
        "TARGET_M_S": (velocity_m_s, "velocity"),
        **_own_scales(method, "state"),
        "HEADING_RAD": (YAW_LIMIT_RAD, "yaw"),
        "TURN_RAD": (_LARGEST_TURN_RAD, "yaw"),
        "THRUST_M_S2": (thrust_m_s2, "thrust"),
        **({} if method.has_height else {HOVER: (hover_m_s2, "thrust")}),
        **_motion_scales(method, half_m_s / 4),
        **_weight_scales(method),
        **_own_scales(method, "target", "command"),
        TINY: (tiny_m(method), "position"),
    }
    return InputScales(
        of={
            name: (scale if name in (HOVER, TINY) else scale / unit, quantity)
            for name, (scale, quantity) in drawn.items()
        },
        error_position_m=tuple(
            error / unit for error in (min(20.0, half_m), *(size * position_m for size in near))
        ),
        error_velocity_m_s=tuple(
            error / unit for error in (min(10.0, half_m_s), *(size * velocity_m_s for size in near))
        ),
        limits=tuple(one / unit for one in _limits_scales(method.limiting, 2 * position_m)),
    )


def _own_scales(method: Method, *records: str) -> dict[str, tuple[float, str]]:
    """Return the scales that rows of the port have themselves."""
    rows = (row for record in records for row in method.port.rows(record))
    return {
        row.draw.scale: (row.draw.largest, row.quantity)
        for row in rows
        if row.draw is not None and row.draw.largest is not None
    }


def _motion_scales(method: Method, change_m_s: float) -> dict[str, tuple[float, str]]:
    """Return the scales of what observer or tracker read: known accelerations, and changes of velocity.

    They are the least of what these are tested with and of what the range admits.
    """
    found = dict[str, tuple[float, str]]()
    if (observer := method.target_observer) is not None:
        most_m_s2 = method.settings.ranges.thrust_acceleration_max_m_s2
        for limits, name in zip(observer.limits, ("", "CLIMB_"), strict=False):
            given_m_s2 = min(1.25 * limits.acceleration / observer.update_s, most_m_s2)
            found[f"{name or 'TARGET_'}M_S2"] = (given_m_s2, "thrust")
            found[f"{name}CHANGE_M_S"] = (min(1.25 * limits.jump, change_m_s), "velocity")
        # With half of it the memory is the longest.
        noise_m_s = 2.0 * (observer.longest - observer.least) / observer.memory_slopes[0]
        found["NOISE_M_S"] = (min(noise_m_s, observer.most_noise), "velocity")
        found["MOST_NOISE_M_S"] = (observer.most_noise, "velocity")
    elif method.tracker is not None:
        found["CHANGE_M_S"] = (min(method.tracker.tested_change_m_s, change_m_s), "velocity")
    return found


def _weight_scales(method: Method) -> dict[str, tuple[float, str]]:
    """Return the scales of weights; none if the C takes none."""
    cost = method.settings.cost
    if not method.weight_limits:
        return {}
    return {
        name: (min(2 * weight, WEIGHT_LIMIT), name.lower())
        for name, weight in (("TRACKING", cost.tracking_weight), ("EFFORT", cost.effort_weight))
    }


def _limits_scales(limits: LimitsConstants | None, wall_m: float) -> tuple[float, ...]:
    """Return the largest limits that are drawn, in the order of nmpc_limits_t; none without limits.

    Along y and in height the least may be drawn above the largest, which is refused.
    """
    if limits is None:
        return ()
    own = limits.named
    drawn = {
        "speed_m_s": min(own["speed_m_s"], _MOST_SPEED_M_S),
        "fence_min_m": (-wall_m, wall_m),
        "fence_max_m": (wall_m, wall_m),
    }
    if "floor_m" in own:
        drawn |= {"floor_m": wall_m, "ceiling_m": wall_m}
    return tuple(in_order(own | drawn).tolist())


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
