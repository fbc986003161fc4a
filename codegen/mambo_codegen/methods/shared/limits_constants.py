"""Constants of the limits of speed, braking and place: what the settings ask for, whatever the method.

The law K_e (p - p_T) + K_v (v - v_T) follows the desired velocity v_T + k (p_T - p), with the approach rate
k = K_e / K_v. All limits are limits of that velocity: `limits.c` derives them.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.numbers.fixed_point import fractional_bits
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.port import taken
from mambo_codegen.settings.fields import SMALLEST_LIMIT
from mambo_codegen.settings.key import Refusal
from mambo_codegen.settings.sections import DEFAULTS, Sections

ONE_NORM_APPROACH_1_S: Final = 1.6
"""Approach rate with the 1-norm, whose law is not linear: measured on presets mambo-1norm and table1."""

ONE_NORM_OUTAGE_S: Final = 0.5
"""Time without a good state after which a controller with the 1-norm commands level attitude."""

BRAKING_SHARE: Final = 0.8
"""Braking limit where none is given, over what the tilt limit gives: the rest is left for wind and lag."""

NEAR_SHARE: Final = 0.7
"""Braking that is fed forward ends at this share of the distance up to which f is linear; see `limits.c`.
Flown with presets mambo and crazyflie: with less they overshoot, with more the command jumps."""

SPELLING: Final = 1.0005
"""A braking limit may exceed what the tilt limit gives by this factor, since both are rounded."""

TURN_SHARE: Final = 0.9
"""With the 1-norm a target's turns may take this share of what the tilt limit gives; see `limits.c`."""

LEAST_TURN_M2_S2: Final = 4e-5
"""The smallest turn that limits a speed: its square has a root in float32."""

LEAST_SQUARE: Final = 1e-9
"""In floating point every square whose root the limits take is at least this, m^2 or m^2/s^2."""

_MEMBERS: Final = [row.member for row in taken.LIMITS for _ in range(int(row.count))]
PLACES: Final = {row.member: _MEMBERS.index(row.member) for row in taken.LIMITS}
"""The place of each member of nmpc_limits_t among its numbers, the first of a fence's two."""

LIMITS: Final = tuple(row.quantity for row in taken.LIMITS if not row.when for _ in range(int(row.count)))
"""The quantity of each number in nmpc_limits_t, in their order."""

HEIGHT_LIMITS: Final = tuple(row.quantity for row in taken.LIMITS if row.when)
"""The same of the further ones with a height, which stand last."""

LATER_LIMITS: Final = tuple(
    f"limits.{key}" for key in type(DEFAULTS.limits).model_fields if key != "tilt_rad"
)
"""Keys that the settings' digest leaves out at their defaults."""

SHARE_BITS: Final = 30
"""Format of the factor that shortens a velocity, and of the mantissa of an inverse square root."""

ROOT_BITS: Final = 16
"""Format of a speed over the root of twice the braking."""


@dataclass(frozen=True)
class TiltAcceleration:
    """The acceleration along any axis of the heading by a tilt: at least slope * tilt - trim, in m/s^2."""

    slope_m_s2_rad: float
    trim_m_s2: float

    def at(self, tilt_rad: float) -> float:
        """Return the acceleration of a tilt, m/s^2."""
        return (self.slope_m_s2_rad * tilt_rad) - self.trim_m_s2


@dataclass(frozen=True)
class LimitsConstants:
    """Constants of the limits, float64.

    approach_1_s: k.
    tilted:       what the tilt limit gives.
    limits:       (7,) the limits of the settings, of the quantities LIMITS: a missing one is the widest that
                  may be set. With a height (11,), HEIGHT_LIMITS too.
    is_tracked:   whether the target's acceleration is fed forward, and so the braking.
    turn_m_s_rad: change of velocity in an update period that a turn may take, per tilt; None if turns do not
                  limit the speed.
    """

    approach_1_s: float
    tilted: TiltAcceleration
    limits: NDArray[np.float64]
    is_tracked: bool
    turn_m_s_rad: float | None = None

    @property
    def quantities(self) -> tuple[str, ...]:
        """The quantity of each limit."""
        return (*LIMITS, *HEIGHT_LIMITS)[: len(self.limits)]

    @property
    def named(self) -> dict[str, Any]:
        """The limits by their members of nmpc_limits_t, each a float, or the two of a fence."""
        present = {member: place for member, place in PLACES.items() if place < len(self.limits)}
        return {member: of_member(self.limits, member).tolist() for member in present}

    @property
    def knee_s2(self) -> float:
        """The distance up to which the approach speed is linear, over twice the braking limit."""
        return 1 / (2 * self.approach_1_s * self.approach_1_s)

    @property
    def near_s2(self) -> float:
        """The distance from the target at which braking ends, over twice the braking limit."""
        return self.near_share * self.knee_s2

    @property
    def near_share(self) -> float:
        """The share of the knee's distance at which braking ends."""
        return NEAR_SHARE if self.is_tracked else 1.0

    @property
    def steepest_1_s(self) -> float:
        """The largest speed over distance: where braking ends."""
        return self.approach_1_s / self.near_share


def of_member(limits: NDArray[Any], member: str) -> Any:
    """Return the numbers of a member of nmpc_limits_t of limits (..., k): (...), or (..., 2) of a fence."""
    place, count = PLACES[member], _MEMBERS.count(member)
    return limits[..., place] if count == 1 else limits[..., place : place + count]


def in_order(named: Mapping[str, ArrayLike]) -> NDArray[np.float64]:
    """Return limits (k,) by their members of nmpc_limits_t in its order. Raises KeyError for another name."""
    members = sorted(named, key=PLACES.__getitem__)
    return np.concatenate([np.ravel(np.asarray(named[member], np.float64)) for member in members])


def has_limits(settings: Sections) -> bool:
    """Return whether the settings have another limit than the tilt limit."""
    tilt_rad = DEFAULTS.limits.tilt_rad
    return settings.limits.model_copy(update={"tilt_rad": tilt_rad}) != DEFAULTS.limits


def limits_constants(settings: Sections, approach_1_s: float, tilted: TiltAcceleration) -> LimitsConstants:
    """Derive the constants of the limits."""
    limits, ranges = settings.limits, settings.ranges
    low, high = zip(*(_walls(settings, axis) for axis in "xy"), strict=True)
    braking_m_s2 = limits.braking_m_s2 or BRAKING_SHARE * tilted.at(settings.limits.tilt_rad)
    return LimitsConstants(
        approach_1_s=approach_1_s,
        tilted=tilted,
        limits=in_order(
            {
                "speed_m_s": limits.speed_m_s or ranges.velocity_m_s,
                "braking_m_s2": braking_m_s2,
                "fence_min_m": low,
                "fence_max_m": high,
                "tilt_rad": limits.tilt_rad,
                **_height_limits(settings),
            }
        ),
        is_tracked=settings.controller.method == "quadratic" or settings.target.acceleration == "tracked",
    )


def one_norm_limits(settings: Sections) -> LimitsConstants | None:
    """Derive the constants of the limits with the 1-norm; None if `settings` have none."""
    if not has_limits(settings):
        return None
    turn = TURN_SHARE * ONE_NORM_TILT.slope_m_s2_rad * settings.horizon.update_period_s
    return replace(limits_constants(settings, ONE_NORM_APPROACH_1_S, ONE_NORM_TILT), turn_m_s_rad=turn)


def refusals(settings: Sections, tilted: TiltAcceleration, *, is_limited: bool) -> list[Refusal]:
    """Return why a controller cannot have the limits of `settings`; `is_limited`: whether it has any."""
    limits, ranges = settings.limits, settings.ranges
    refused = []
    if limits.speed_m_s > ranges.velocity_m_s:
        refused.append(
            Refusal("limits", "speed_m_s", f"must be at most {ranges.velocity_m_s!r} (ranges.velocity_m_s)")
        )
    most_m_s2 = tilted.at(settings.limits.tilt_rad)
    if limits.braking_m_s2 and limits.braking_m_s2 > most_m_s2:
        rule = (
            f"must be at most {math.floor(most_m_s2 * 1000) / 1000:g}, the deceleration at "
            f"limits.tilt_rad = {limits.tilt_rad:g}"
        )
        refused.append(Refusal("limits", "braking_m_s2", rule))
    least_m_s2 = SMALLEST_LIMIT / BRAKING_SHARE
    if is_limited and not limits.braking_m_s2 and most_m_s2 < least_m_s2:
        rule = (
            f"must give a deceleration of {least_m_s2:g} m/s^2 to limit speed, braking or place, and gives "
            f"{most_m_s2:.3g}"
        )
        refused.append(Refusal("limits", "tilt_rad", rule))
    for name, value in limits.fence.model_dump().items():
        if abs(value) > ranges.position_m:
            rule = f"must lie in {-ranges.position_m!r}..{ranges.position_m!r} (ranges.position_m)"
            refused.append(Refusal("limits.fence", name, rule))
    return refused


def limits_bits(found: LimitsConstants | None, velocity: int, position: int) -> dict[str, int]:
    """Return the fractional bits of the limits' own quantities in fixed point; 0 without limits.

    velocity and position are the formats of those inputs. braking: of twice the braking, with three bits to
    spare for its product with a distance. approach: of `steepest_1_s`. knee: of `knee_s2`. slope: of
    `TiltAcceleration`.
    """
    if found is None:
        return dict.fromkeys(("braking", "approach", "knee", "slope"), 0)
    slope = found.tilted.slope_m_s2_rad
    return {
        "braking": fractional_bits(16 * slope * found.named["tilt_rad"]),
        "approach": min(fractional_bits(found.steepest_1_s), 29 + velocity - position),
        "knee": fractional_bits(found.knee_s2),
        "slope": fractional_bits(SPELLING * slope),
    }


def _height_limits(settings: Sections) -> dict[str, float]:
    """Return floor, ceiling, climb and descent, by their members; none without a height."""
    height, fence, reach_m = settings.height, settings.limits.fence, settings.ranges.position_m
    if height is None:
        return {}
    is_walled = fence.floor_m < fence.ceiling_m
    floor_m, ceiling_m = (fence.floor_m, fence.ceiling_m) if is_walled else (-reach_m, reach_m)
    return {
        "floor_m": floor_m,
        "ceiling_m": ceiling_m,
        "climb_m_s": height.climb_m_s,
        "descent_m_s": height.descent_m_s,
    }


ONE_NORM_TILT: Final = TiltAcceleration(GRAVITY_M_S2, 0.0)
"""The model of a controller with the 1-norm answers a command with its own acceleration."""


def _walls(settings: Sections, axis: str) -> tuple[float, float]:
    """Return the walls along an axis; without any the ends of the range."""
    low, high = (getattr(settings.limits.fence, f"{axis}_{end}_m") for end in ("min", "max"))
    reach_m = settings.ranges.position_m
    return (low, high) if low < high else (-reach_m, reach_m)
