"""The fixed point formats of a controller: the number of fractional bits of each quantity.

A number of format b is an integer of 32 bits, its value times 2^b. Each quantity has the most fractional bits
with which none of its values overflows. Those values are bounded by the sum of the absolute values of all
terms (`_bounds`), not sampled. That costs two bits compared with the largest values that occur, and lets a
proof by intervals find the same bounds in the C.

No plan can change the sign of a position error that is larger than all displacements over the horizon
together: such an error is clamped. That changes neither the gradient nor a difference of costs, and leaves
the bits to smaller errors.

The absolute errors of a whole horizon are summed in one word. Distance, cost and gradient have 64 bits, of
which they use at most 53, so that a double holds them exactly.
"""

import math
from collections.abc import Callable
from dataclasses import astuple, dataclass
from typing import Final

import numpy as np

from mambo_nmpc.codegen.horizon import HorizonTables, horizon_tables
from mambo_nmpc.codegen.settings.limits import ATTITUDE_LIMIT_RAD, WEIGHT_LIMIT, YAW_LIMIT_RAD
from mambo_nmpc.codegen.settings.sections import Sections

WORD_BITS: Final = 31
"""Bits of a number without its sign."""

LARGEST: Final = 2**WORD_BITS - 1
"""The largest number: the saturation value of an input, outside every input range, so it is refused."""

SINE_BITS: Final = 30
"""Format of sine and cosine, whose largest value is 1."""

UPPER_BITS: Final = 32
"""Right shift of the products of shares and of eta: one factor is shifted left before."""

SUM_BITS: Final = 53
"""Bits of cost and gradient without the sign: those of a double, so that logs and tests are exact."""

_PRODUCT_BITS: Final = 62
"""Bits of a product without its sign: one less than the type has, because rounding adds to it."""

_MARGIN: Final = 1.01
"""Every bound is enlarged by 1 %, a thousand times more than all roundings over a horizon add."""

_WEIGHT_HEADROOM: Final = 4.0
"""At run time weights may be up to this factor larger than in the settings. An effort weight of 0 counts as
1, or as the tracking weight if that is less."""

_COARSEST_ERROR_BITS: Final = 10
"""Errors have a resolution of 1 mm or better."""

_FEWEST_WEIGHT: Final = 512
"""A weight smaller than this number would be rounded by more than a thousandth."""


@dataclass(frozen=True)
class Formats:
    """Fractional bits by quantity, and the limits that are not in the settings, as numbers.

    position:           input positions and their difference, m.
    velocity:           input velocities and their difference, m/s.
    thrust:             thrust acceleration, m/s^2.
    yaw:                rad.
    angle:              tilt, moves, their changes and the step sizes of RPROP, rad.
    step, step_squared: tau, s, and tau^2, s^2.
    gain:               acceleration per tilt, m/step^2 per rad.
    acceleration:       acceleration, displacement and deficit, m/step^2 and m/step.
    error:              predicted error, m.
    share:              shares and decays of the attitude lag.
    response:           sums of responses.
    distance_gradient:  gradient of the distance, m/rad.
    tracking, effort:   lambda_1 and lambda_2, 1/m and 1/rad.
    factor:             eta+ and eta-.
    cost, gradient:     of 64 bits.
    error_limit:        largest initial error, a number of the format of positions.
    tracking_limit, effort_limit: largest weights.
    """

    position: int
    velocity: int
    thrust: int
    yaw: int
    angle: int
    step: int
    step_squared: int
    gain: int
    acceleration: int
    error: int
    share: int
    response: int
    distance_gradient: int
    tracking: int
    effort: int
    factor: int
    cost: int
    gradient: int
    error_limit: int
    tracking_limit: int
    effort_limit: int


@dataclass(frozen=True)
class _Bounds:
    """Bounds of absolute values over the horizon.

    acceleration: of acceleration, displacement, deficit, and every sum of them, m/step^2 and m/step.
    shared:       of what is multiplied by a share: the acceleration of a change of tilt or of the measured
                  tilt, and the deficit, m/step^2.
    error:        of the change of the error over the horizon, m.
    error_sum:    of the sum of that change over all steps, m.
    response:     of the sum of the responses to a move, with any signs and over any steps.
    """

    acceleration: float
    shared: float
    error: float
    error_sum: float
    response: float


@dataclass(frozen=True)
class Refusal:
    """Why settings have no fixed point controller: the key to change, and the rule, from "must" on."""

    section: str
    name: str
    rule: str


def formats(settings: Sections, tables: HorizonTables) -> Formats:
    """Choose the formats of `settings`; where `refusals` finds faults, they are too coarse to use."""
    ranges, optimizer, tilt = settings.ranges, settings.optimizer, settings.limits.tilt_rad
    step_s, gain = settings.horizon.prediction_step_s, _largest_gain(settings, tables)
    bounds = _bounds(settings, tables)

    factor = _fit(optimizer.increase)
    angle = _fit(
        ATTITUDE_LIMIT_RAD + (tilt if tables.has_lag else 0),
        2 * tilt,
        tilt + optimizer.step_max_rad,
        optimizer.step_max_rad * optimizer.increase,
        math.ldexp(optimizer.step_max_rad, UPPER_BITS - factor),
    )
    share = _fit(
        tables.displacement_share,
        *(size for angle in tables.angles for size in map(abs, astuple(angle))),
    )
    acceleration = _fit(bounds.acceleration, math.ldexp(bounds.shared, UPPER_BITS - share))
    error_limit = min(2 * ranges.position_m, bounds.error) * _MARGIN
    error = min(_fit(settings.horizon.prediction * error_limit + bounds.error_sum), acceleration - 1)
    position = min(_fit(2 * ranges.position_m), error)
    gradient_bound = 2 * gain * bounds.response
    distance_gradient = _fit(gradient_bound)

    distance = 2 * settings.horizon.prediction * (error_limit + bounds.error)
    variation = 4 * settings.horizon.control * tilt
    cost = settings.cost
    effort_limit = _WEIGHT_HEADROOM * (cost.effort_weight or min(1.0, cost.tracking_weight))
    effort = min(_fit(effort_limit), _PRODUCT_BITS - _whole(variation, effort_limit) - angle)
    tracking_limit = _WEIGHT_HEADROOM * cost.tracking_weight
    tracking = min(
        _fit(tracking_limit),
        SUM_BITS - 1 - max(_whole(tracking_limit, distance), _whole(effort_limit, variation)) - error,
        SUM_BITS
        - 1
        - max(_whole(tracking_limit, gradient_bound), _whole(effort_limit, 2))
        - distance_gradient,
        effort + angle - error - 1,
    )
    effort = min(effort, tracking + distance_gradient)
    return Formats(
        position=position,
        velocity=_fit(2 * ranges.velocity_m_s),
        thrust=_fit(ranges.thrust_acceleration_max_m_s2),
        yaw=_fit(YAW_LIMIT_RAD),
        angle=angle,
        step=_fit(step_s),
        step_squared=_fit(tables.step_squared_s2),
        gain=_fit(gain),
        acceleration=acceleration,
        error=error,
        share=share,
        response=_fit(2 * bounds.response),  # one bit spare: gcc shifts by less than 32 in fewer instructions
        distance_gradient=distance_gradient,
        tracking=tracking,
        effort=effort,
        factor=factor,
        cost=tracking + error,
        gradient=tracking + distance_gradient,
        error_limit=raw(error_limit, position),
        tracking_limit=raw(min(tracking_limit, WEIGHT_LIMIT), tracking),
        effort_limit=raw(min(effort_limit, WEIGHT_LIMIT), effort),
    )


def raw(value: float, bits: int) -> int:
    """Return the number of format `bits` nearest to `value`, ties away from zero.

    Beyond 2^62 it returns that: no cost comes near, and only a tolerance may be set so far.
    """
    size: int = min(math.floor(math.ldexp(abs(value), bits) + 0.5), 2**_PRODUCT_BITS)
    return -size if value < 0 else size


def refusals(settings: Sections) -> list[Refusal]:
    """Return what fixed point cannot represent in `settings`, each with the nearest value that it can."""
    tables = horizon_tables(settings)
    found = formats(settings, tables)
    if not _fine_errors(found):
        return [_too_wide(settings, tables)]
    refused = [
        Refusal("cost", name, _too_small(settings, tables, name))
        for name in ("tracking_weight", "effort_weight")
        if not _fine_weight(settings, found, name)
    ]
    optimizer = settings.optimizer
    least = math.ldexp(1, -found.cost)
    if 0 < optimizer.tolerance < least:
        rule = f'must be 0 or at least {_up(least)} with code.scalar = "fixed", the resolution of the cost'
        refused.append(Refusal("optimizer", "tolerance", rule))
    least = math.ldexp(1, -found.angle)
    refused.extend(
        Refusal(
            "optimizer",
            name,
            f'must be at least {_up(least)} with code.scalar = "fixed", the resolution of angles',
        )
        for name in ("initial_step_rad", "step_max_rad", "step_min_rad")
        if getattr(optimizer, name) < least
    )
    return refused


def _fine_errors(found: Formats) -> bool:
    return found.error >= _COARSEST_ERROR_BITS


def _fine_weight(settings: Sections, found: Formats, name: str) -> bool:
    weight: float = getattr(settings.cost, name)
    bits = found.tracking if name == "tracking_weight" else found.effort
    return weight == 0 or math.ldexp(weight, bits) >= _FEWEST_WEIGHT


def _too_wide(settings: Sections, tables: HorizonTables) -> Refusal:
    """Name the range that adds most to the errors over the horizon."""
    horizon, ranges = settings.horizon, settings.ranges
    error_m = _bounds(settings, tables).error
    by_speed = 2 * ranges.velocity_m_s * horizon.prediction_step_s * horizon.prediction
    name, least = "thrust_acceleration_max_m_s2", ranges.thrust_acceleration_min_m_s2
    end = math.nextafter(least, math.inf)
    if by_speed > error_m / 2:
        name, least, end = "velocity_m_s", 0.0, 0.1
    fits = _nearest(settings, "ranges", name, end, lambda changed: _fine_errors(formats(changed, tables)))
    way_out = "write a smaller horizon.prediction_step_s"
    if fits and float(_down(fits)) > least:
        way_out = f"write at most {_down(fits)}"
    rule = (
        f"lets errors reach {error_m:.3g} m over the horizon, coarser than 1 mm with "
        f'code.scalar = "fixed"; {way_out}'
    )
    return Refusal("ranges", name, rule)


def _too_small(settings: Sections, tables: HorizonTables, name: str) -> str:
    """Return the rule that a weight breaks which is too small beside the other one."""
    fits = _nearest(
        settings,
        "cost",
        name,
        WEIGHT_LIMIT,
        lambda changed: _fine_weight(changed, formats(changed, tables), name),
    )
    other = "effort_weight" if name == "tracking_weight" else "tracking_weight"
    return (
        f"must not be so small beside cost.{other} = {getattr(settings.cost, other):g} with "
        f'code.scalar = "fixed", which would round it by more than a thousandth; '
        + (f"write at least {_up(fits)}" if fits else f"write a smaller cost.{other}")
    )


def _nearest(
    settings: Sections, section: str, name: str, end: float, fits: Callable[[Sections], bool]
) -> float | None:
    """Bisect from the value of a key, which does not fit, to `end`; None if `end` does not fit either."""
    document = settings.model_dump()
    bad, good = document[section][name], end

    def changed(value: float) -> Sections:
        return Sections.model_validate(document | {section: document[section] | {name: value}})

    if not fits(changed(end)):
        return None
    for _ in range(40):
        middle = math.sqrt(bad * good)
        bad, good = (bad, middle) if fits(changed(middle)) else (middle, good)
    return float(good)


def _up(value: float) -> str:
    """Spell a value with three digits, rounded up."""
    return f"{_three_digits(value, math.ceil):g}"


def _down(value: float) -> str:
    """Spell a value with three digits, rounded down."""
    return f"{_three_digits(value, math.floor):g}"


def _three_digits(value: float, rounded: Callable[[float], int]) -> float:
    digits = 2 - math.floor(math.log10(value))
    return float(f"{rounded(value * 10.0**digits)}e{-digits}")


def _largest_gain(settings: Sections, tables: HorizonTables) -> float:
    return settings.ranges.thrust_acceleration_max_m_s2 * tables.step_squared_s2


def _bounds(settings: Sections, tables: HorizonTables) -> _Bounds:
    """Bound a roll-out along one axis of the world: absolute values for values, sums for differences."""
    tilt_rad, steps = settings.limits.tilt_rad, settings.horizon.prediction
    measured_rad = ATTITUDE_LIMIT_RAD if tables.has_lag else 0.0
    gain = _largest_gain(settings, tables)
    acceleration = shared = 2 * gain * measured_rad
    displacement = (
        2 * settings.ranges.velocity_m_s * settings.horizon.prediction_step_s
        + tables.displacement_share * acceleration
    )
    error = error_sum = 0.0
    deficits = [0.0, 0.0]
    previous_rad = measured_rad
    for step in range(steps):
        if step < settings.horizon.control:
            change = gain * (previous_rad + tilt_rad)
            previous_rad = tilt_rad
            acceleration += 2 * change
            displacement += change * sum(abs(angle.displacement_share) for angle in tables.angles)
            deficits = [
                size + angle.deficit_share * change
                for size, angle in zip(deficits, tables.angles, strict=True)
            ]
            shared = max(shared, 2 * change, *deficits)
        error += displacement
        error_sum += error
        displacement += acceleration + sum(deficits)
        deficits = [size * angle.deficit_decay for size, angle in zip(deficits, tables.angles, strict=True)]
    return _Bounds(
        acceleration=displacement,
        shared=shared,
        error=error,
        error_sum=error_sum,
        response=float(steps * np.abs(tables.response_sum).max()),
    )


def _fit(*sizes: float) -> int:
    """Return the most fractional bits with which numbers of these absolute values fit in a word."""
    return WORD_BITS - _whole(max(sizes), 1.0)


def _whole(a: float, b: float) -> int:
    """Return the integer bits of the product of two bounds."""
    return math.frexp(a * b * _MARGIN)[1]
