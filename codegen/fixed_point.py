"""The fixed point formats of a controller: how many bits each quantity has behind the point, and why.

A number of format b is a whole number of 32 bits, its value times 2^b. Each quantity has the most bits with
which no value that it can take overflows. Those values are bounded, not sampled: by the sizes of what is
added up, as if nothing ever cancelled (`_reach`). That gives away two bits, and lets a proof by intervals
find the same bounds in the C.

A position error beyond what the horizon can change keeps its sign there whatever the moves: it is clamped to
a little more than that reach, which changes neither a slope nor a difference of costs, and leaves the bits to
the errors that matter.

The sizes of the errors of a whole horizon add up in one word. Distance, cost and gradient have 64 bits, of
which they use no more than 53: a double holds them.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from mambo_nmpc.codegen.horizon import HorizonTables, horizon_tables
from mambo_nmpc.codegen.settings.limits import ATTITUDE_LIMIT_RAD, WEIGHT_LIMIT, YAW_LIMIT_RAD
from mambo_nmpc.codegen.settings.sections import Sections

WORD_BITS: Final = 31
"""Bits of a number beside its sign."""

LARGEST: Final = 2**WORD_BITS - 1
"""The largest number; as an input it stands for whatever no format holds, and is out of every range."""

SINE_BITS: Final = 30
"""Format of sine and cosine, of which 1 is the largest."""

UPPER_BITS: Final = 32
"""Where the products of shares and factors end, in the upper word: bend and step are shifted up first."""

SUM_BITS: Final = 53
"""Bits of cost and gradient beside the sign: those of a double, so that logs and tests lose nothing."""

_PRODUCT_BITS: Final = 62
"""Bits of a product beside its sign: one less than the type has, for what rounding adds."""

_MARGIN: Final = 1.01
"""Every bound is taken larger by a hundredth, a thousand times what all roundings of a horizon add."""

_WEIGHT_HEADROOM: Final = 4.0
"""Weights may grow to so many times those of the settings at run time; an effort of 0 as if it were 1, or as
much as tracking if that is less."""

_COARSEST_ERROR_BITS: Final = 10
"""Errors are resolved to a millimetre at least."""

_FEWEST_WEIGHT: Final = 512
"""A weight below this number would be rounded by more than a thousandth."""


@dataclass(frozen=True)
class Formats:
    """Bits behind the point by quantity, and the limits that are not in the settings, as numbers.

    position:       input positions and their difference, m.
    velocity:       input velocities and their difference, m/s.
    thrust:         thrust acceleration, m/s^2.
    yaw:            heading, rad.
    angle:          tilt, moves, turns and steps of the optimizer, rad.
    step, step_squared: the prediction step, s, and its square, s^2.
    gain:           bend by turn, m/rad.
    bend:           bend, advance and what is to come, m.
    error:          position less target on the way through the horizon, m.
    share:          shares of a bend.
    response:       sums of responses.
    slope:          distance by turn, m/rad.
    tracking, effort: the weights, 1/m and 1/rad.
    factor:         growth and shrinkage of a step.
    cost, gradient: 64 bits wide.
    error_limit:    largest start of an error, a number of the format of positions.
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
    bend: int
    error: int
    share: int
    response: int
    slope: int
    tracking: int
    effort: int
    factor: int
    cost: int
    gradient: int
    error_limit: int
    tracking_limit: int
    effort_limit: int


@dataclass(frozen=True)
class _Reach:
    """The largest sizes over the horizon.

    bend:     of bend, advance, what is to come, and every sum of them on the way, m.
    tilt:     of what a share is taken of: bend of a turn or of the measured tilt, and what is to come, m.
    error:    of what is added to the first error, m.
    errors:   of the sum of that over the horizon, m.
    response: of the sum of responses to a move, with whatever signs and of whatever steps.
    """

    bend: float
    tilt: float
    error: float
    errors: float
    response: float


@dataclass(frozen=True)
class Refusal:
    """Why settings have no fixed point controller: the key to blame, and the rule, from "must" on."""

    section: str
    name: str
    rule: str


def formats(settings: Sections, tables: HorizonTables) -> Formats:
    """Choose the formats of `settings`; where `refusals` finds faults, they are too coarse to use."""
    ranges, optimizer, tilt = settings.ranges, settings.optimizer, settings.limits.tilt_rad
    step_s, gain = settings.horizon.prediction_step_s, _largest_gain(settings, tables)
    reach = _reach(settings, tables)

    factor = _fit(optimizer.increase)
    angle = _fit(
        ATTITUDE_LIMIT_RAD + (tilt if tables.has_lag else 0),
        2 * tilt,
        tilt + optimizer.step_max_rad,
        optimizer.step_max_rad * optimizer.increase,
        math.ldexp(optimizer.step_max_rad, UPPER_BITS - factor),
    )
    share = _fit(max(max(abs(axis.at_once), axis.delayed, axis.decay, tables.held) for axis in tables.axes))
    bend = _fit(reach.bend, math.ldexp(reach.tilt, UPPER_BITS - share))
    error_limit = min(2 * ranges.position_m, reach.error) * _MARGIN
    error = min(_fit(settings.horizon.prediction * error_limit + reach.errors), bend - 1)
    position = min(_fit(2 * ranges.position_m), error)
    slope_bound = 2 * gain * reach.response
    slope = _fit(slope_bound)

    distance = 2 * settings.horizon.prediction * (error_limit + reach.error)
    variation = 4 * settings.horizon.control * tilt
    cost = settings.cost
    effort_limit = _WEIGHT_HEADROOM * (cost.effort_weight or min(1.0, cost.tracking_weight))
    effort = min(_fit(effort_limit), _PRODUCT_BITS - _whole(variation, effort_limit) - angle)
    tracking_limit = _WEIGHT_HEADROOM * cost.tracking_weight
    tracking = min(
        _fit(tracking_limit),
        SUM_BITS - 1 - max(_whole(tracking_limit, distance), _whole(effort_limit, variation)) - error,
        SUM_BITS - 1 - max(_whole(tracking_limit, slope_bound), _whole(effort_limit, 2)) - slope,
        effort + angle - error - 1,
    )
    effort = min(effort, tracking + slope)
    return Formats(
        position=position,
        velocity=_fit(2 * ranges.velocity_m_s),
        thrust=_fit(ranges.thrust_acceleration_max_m_s2),
        yaw=_fit(YAW_LIMIT_RAD),
        angle=angle,
        step=_fit(step_s),
        step_squared=_fit(tables.step_squared_s2),
        gain=_fit(gain),
        bend=bend,
        error=error,
        share=share,
        response=_fit(2 * reach.response),  # a bit to spare: gcc shifts by less than 32 in fewer instructions
        slope=slope,
        tracking=tracking,
        effort=effort,
        factor=factor,
        cost=tracking + error,
        gradient=tracking + slope,
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
    """Return what in `settings` fixed point cannot represent, with the nearest value that it can."""
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
    """Refuse the range that adds most to the errors over the horizon."""
    horizon, ranges = settings.horizon, settings.ranges
    reach = _reach(settings, tables).error
    by_speed = 2 * ranges.velocity_m_s * horizon.prediction_step_s * horizon.prediction
    name, least = "thrust_acceleration_max_m_s2", ranges.thrust_acceleration_min_m_s2
    end = math.nextafter(least, math.inf)
    if by_speed > reach / 2:
        name, least, end = "velocity_m_s", 0.0, 0.1
    fits = _nearest(settings, "ranges", name, end, lambda changed: _fine_errors(formats(changed, tables)))
    way_out = "write a smaller horizon.prediction_step_s"
    if fits and float(_down(fits)) > least:
        way_out = f"write at most {_down(fits)}"
    rule = (
        f"lets errors reach {reach:.3g} m over the horizon, coarser than 1 mm with "
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


def _reach(settings: Sections, tables: HorizonTables) -> _Reach:
    """Bound what a prediction computes, along one axis of the world, by walking with sizes for values."""
    tilt_rad, steps = settings.limits.tilt_rad, settings.horizon.prediction
    measured_rad = ATTITUDE_LIMIT_RAD if tables.has_lag else 0.0
    gain = _largest_gain(settings, tables)
    bend = tilt = 2 * gain * measured_rad
    advance = 2 * settings.ranges.velocity_m_s * settings.horizon.prediction_step_s + tables.held * bend
    error = errors = 0.0
    to_come = [0.0, 0.0]
    before_rad = measured_rad
    for step in range(steps):
        if step < settings.horizon.control:
            turn = gain * (before_rad + tilt_rad)
            before_rad = tilt_rad
            bend += 2 * turn
            advance += turn * sum(abs(axis.at_once) for axis in tables.axes)
            to_come = [size + axis.delayed * turn for size, axis in zip(to_come, tables.axes, strict=True)]
            tilt = max(tilt, 2 * turn, *to_come)
        error += advance
        errors += error
        advance += bend + sum(to_come)
        to_come = [size * axis.decay for size, axis in zip(to_come, tables.axes, strict=True)]
    return _Reach(
        bend=advance,
        tilt=tilt,
        error=error,
        errors=errors,
        response=float(steps * np.abs(tables.response_sum).max()),
    )


def _fit(*sizes: float) -> int:
    """Return the most bits behind the point with which numbers of these sizes fit in a word."""
    return WORD_BITS - _whole(max(sizes), 1.0)


def _whole(a: float, b: float) -> int:
    """Return the bits before the point of the product of two bounds."""
    return math.frexp(a * b * _MARGIN)[1]
