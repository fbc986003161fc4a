"""The fixed point formats of a controller: how many bits each quantity has behind the point, and why.

A number of format b is a whole number of 32 bits, its value times 2^b. Each quantity has the most bits with
which no value that it can take overflows. Those values are bounded, not sampled: for held commands
every intermediate of the prediction is linear in the velocity error, the measured tilt and the moves, so that
its largest size is the sum of the sizes of its coefficients times their ranges (`_reach`).

A position error beyond what the horizon can change keeps its sign there whatever the moves: it is clamped to
a little more than that reach, which changes neither a slope nor a difference of costs, and leaves the bits to
the errors that matter.

Sums over the horizon, cost and gradient have 64 bits, of which they use no more than 53: a double holds them.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from codegen.horizon import AxisConstants, HorizonTables, horizon_tables
from codegen.settings.limits import ATTITUDE_LIMIT_RAD, WEIGHT_LIMIT, YAW_LIMIT_RAD
from codegen.settings.model import Horizon, Settings

WORD_BITS: Final = 31
"""Bits of a number beside its sign."""

LARGEST: Final = 2**WORD_BITS - 1
"""The largest number; as an input it stands for whatever no format holds, and is out of every range."""

SINE_BITS: Final = 30
"""Format of sine and cosine, of which 1 is the largest."""

SHARE_PRODUCT_BITS: Final = 32
"""Where the product of a share ends: the bend is shifted up to there first."""

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
    tilt:     of the bend of a turn, of all turns together, and of what is to come of them, m.
    error:    of what is added to the first error, m.
    response: of the sum of all responses to a move.
    """

    bend: float
    tilt: float
    error: float
    response: float


@dataclass(frozen=True)
class Refusal:
    """Why settings have no fixed point controller: the key to blame, and the rule, from "must" on."""

    section: str
    name: str
    rule: str


@lru_cache(maxsize=256)
def formats(settings: Settings) -> Formats:
    """Choose the formats of `settings`, which `refusals` finds nothing wrong with."""
    ranges, optimizer, tilt = settings.ranges, settings.optimizer, settings.limits.tilt_rad
    tables = horizon_tables(settings)
    step_s, gain = settings.horizon.prediction_step_s, _largest_gain(settings, tables)
    reach = _reach(settings, tables)

    angle = _fit(
        ATTITUDE_LIMIT_RAD + (tilt if tables.has_lag else 0),
        2 * tilt,
        tilt + optimizer.step_max_rad,
        optimizer.step_max_rad * optimizer.increase,
    )
    share = _fit(max(max(abs(axis.at_once), axis.delayed, axis.decay, tables.held) for axis in tables.axes))
    bend = _fit(reach.bend, math.ldexp(reach.tilt, SHARE_PRODUCT_BITS - share))
    error_limit = min(2 * ranges.position_m, reach.error) * _MARGIN
    error = min(_fit(error_limit + reach.error), bend - 1)
    position = min(_fit(2 * ranges.position_m), error)
    slope_bound = math.sqrt(2) * gain * reach.response
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
        response=_fit(2 * reach.response),
        slope=slope,
        tracking=tracking,
        effort=effort,
        factor=_fit(optimizer.increase),
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


def refusals(settings: Settings) -> list[Refusal]:
    """Tell what in `settings` fixed point cannot represent, with the nearest value that it can."""
    found = formats(settings)
    if not _fine_errors(found):
        return [_too_wide(settings)]
    refused = [
        Refusal("cost", name, _too_small(settings, name))
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


def _fine_weight(settings: Settings, found: Formats, name: str) -> bool:
    weight: float = getattr(settings.cost, name)
    bits = found.tracking if name == "tracking_weight" else found.effort
    return weight == 0 or math.ldexp(weight, bits) >= _FEWEST_WEIGHT


def _too_wide(settings: Settings) -> Refusal:
    """Blame the range that adds most to the errors over the horizon."""
    horizon, ranges = settings.horizon, settings.ranges
    reach = _reach(settings, horizon_tables(settings)).error
    by_speed = 2 * ranges.velocity_m_s * horizon.prediction_step_s * horizon.prediction
    name = "velocity_m_s" if by_speed > reach / 2 else "thrust_acceleration_max_m_s2"
    fits = _nearest(settings, "ranges", name, 0.1, lambda changed: _fine_errors(formats(changed)))
    rule = (
        f'lets errors reach {reach:.3g} m over the horizon, coarser than 1 mm with code.scalar = "fixed"; '
        + (f"write at most {_down(fits)}" if fits else "shorten the horizon")
    )
    return Refusal("ranges", name, rule)


def _too_small(settings: Settings, name: str) -> str:
    fits = _nearest(
        settings, "cost", name, WEIGHT_LIMIT, lambda changed: _fine_weight(changed, formats(changed), name)
    )
    other = "effort_weight" if name == "tracking_weight" else "tracking_weight"
    return (
        f"must not be so small beside cost.{other} = {getattr(settings.cost, other):g} with "
        f'code.scalar = "fixed", which would round it by more than a thousandth; '
        + (f"write at least {_up(fits)}" if fits else f"write a smaller cost.{other}")
    )


def _nearest(
    settings: Settings, section: str, name: str, end: float, fits: Callable[[Settings], bool]
) -> float | None:
    """Find the value of a key nearest to its own, on the way to `end`, that fits; None if none does."""

    def changed(value: float) -> Settings:
        part = getattr(settings, section).model_copy(update={name: value})
        return settings.model_copy(update={section: part})

    if not fits(changed(end)):
        return None
    bad, good = getattr(getattr(settings, section), name), end
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


def _largest_gain(settings: Settings, tables: HorizonTables) -> float:
    return settings.ranges.thrust_acceleration_max_m_s2 * tables.step_squared_s2


def _reach(settings: Settings, tables: HorizonTables) -> _Reach:
    """Bound what a prediction computes, by the sizes of its coefficients.

    Gains of roll and pitch are sine and cosine of the heading times one number, so that together they
    bend at most by the root of the sum of the squares of what each alone does.
    """
    tilt_rad = settings.limits.tilt_rad
    measured_rad = ATTITUDE_LIMIT_RAD if tables.has_lag else 0.0
    gain = _largest_gain(settings, tables)
    speed = 2 * settings.ranges.velocity_m_s * settings.horizon.prediction_step_s
    roll, pitch = (
        _axis_reach(axis, tables.held, settings.horizon, measured_rad, tilt_rad) for axis in tables.axes
    )
    tilt, before, after, by_tilt = (
        [gain * math.sqrt(a * a + b * b) for a, b in zip(of_roll, of_pitch, strict=True)]
        for of_roll, of_pitch in zip(zip(*roll, strict=True), zip(*pitch, strict=True), strict=True)
    )
    largest_turn = math.sqrt(2) * gain * (measured_rad + 2 * tilt_rad)
    once = tables.response_sum.copy()
    once[:-1] /= 2
    responses = [
        sum(abs(float(after - before)) for before, after in itertools.pairwise(column)) for column in once.T
    ]
    return _Reach(
        bend=speed + max(*tilt, *before, *after, max(1.0, tables.held) * largest_turn),
        tilt=max(*tilt, largest_turn),
        error=max((i + 1) * speed + error for i, error in enumerate(by_tilt)),
        response=max(responses),
    )


def _axis_reach(
    axis: AxisConstants, held: float, horizon: Horizon, measured_rad: float, tilt_rad: float
) -> list[tuple[float, float, float, float]]:
    """Bound one axis in every step, per unit of gain, by the walk of each of its inputs.

    They are of bend and what is to come of it, of the advance before and after the step, and of the error.
    """
    steps, moves = horizon.prediction, horizon.control
    bounds = [(0.0, 0.0, 0.0, 0.0)] * steps
    for move in range(-1, moves):
        size = measured_rad if move < 0 else tilt_rad
        error, to_come = 0.0, 0.0
        bend, advance = (1.0, held) if move < 0 else (0.0, 0.0)
        for step in range(steps):
            turn = float(step == move) - float(step == move + 1 < moves)
            before = advance + axis.at_once * turn
            bend += turn
            to_come -= axis.delayed * turn
            error += before
            advance = before + bend + to_come
            tilt, first, second, third = bounds[step]
            bounds[step] = (
                tilt + size * (abs(bend) + abs(to_come)),
                first + size * abs(before),
                second + size * abs(advance),
                third + size * abs(error),
            )
            to_come *= axis.decay
    return bounds


def _fit(*sizes: float) -> int:
    """Return the most bits behind the point with which numbers of these sizes fit in a word."""
    return WORD_BITS - _whole(max(sizes), 1.0)


def _whole(a: float, b: float) -> int:
    """Return the bits before the point of the product of two bounds."""
    return math.frexp(a * b * _MARGIN)[1]
