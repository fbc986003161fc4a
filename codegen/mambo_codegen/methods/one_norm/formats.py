"""The fixed point formats of a controller: the number of fractional bits of each quantity.

A number of format b is a 32-bit integer that stands for integer / 2^b. Each quantity has as many fractional
bits as possible without overflow. Its largest value is not sampled, but bounded by the sum of the absolute
values of all terms (`_bounds`). That costs two bits compared with the largest values that occur, but a proof
by intervals finds the same bound in the C.

No plan can change the sign of a position error that exceeds the sum of all displacements over the horizon,
so such an error is clamped. Clamping changes neither the gradient nor a difference of costs, and leaves more
fractional bits for smaller errors.

The absolute errors of the whole horizon are summed in one 32-bit word. Distance, cost and gradient are 64-bit
integers; cost and gradient use at most 53 bits, so that a double holds them exactly.
"""

import math
from collections.abc import Callable
from dataclasses import asdict, astuple, dataclass
from typing import Final

import numpy as np

from mambo_codegen.methods.one_norm.horizon import HorizonTables, horizon_tables
from mambo_codegen.methods.shared.limits_constants import (
    limits_bits,
    one_norm_limits,
)
from mambo_codegen.methods.shared.rate_feedback import feedback_bits, feedback_steps
from mambo_codegen.methods.shared.tracker_constants import TrackerConstants, tracker_constants
from mambo_codegen.numbers.fixed_point import MARGIN, PRODUCT_BITS, fractional_bits, integer_bits, raw
from mambo_codegen.numbers.representation import ATTITUDE_LIMIT_RAD, WEIGHT_LIMIT, YAW_LIMIT_RAD
from mambo_codegen.settings.key import Refusal
from mambo_codegen.settings.sections import Sections

UPPER_BITS: Final = 32
"""Right shift of products with shares and eta; one factor is shifted left first to keep the format."""

SUM_BITS: Final = 53
"""Most bits of cost and gradient without the sign: as a double has, so that logs and tests are exact."""

_WEIGHT_HEADROOM: Final = 4.0
"""At run time weights may be up to this factor larger than in the settings. An effort weight of 0 counts as
1, or as the tracking weight if that is less."""

_COARSEST_ERROR_BITS: Final = 10
"""Fewest fractional bits of an error: its resolution is 1 mm or better."""

_PLACES: Final = 4.02
"""Bound of what limits compute with positions, over the range of positions."""

_SMALLEST_WEIGHT: Final = 512
"""Smallest integer for a weight: rounding changes a larger one by less than a thousandth."""


@dataclass(frozen=True)
class OneNormFormats:
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
    tracker:            tau^2 over the update period, s; 0 without a tracker.
    feedback:           rate feedback in steps; 0 without.
    braking, approach, knee, slope: of the limits, see `limits_bits`; 0 without.
    cost, gradient:     64-bit integers; cost without unit, gradient 1/rad.
    error_limit:        limit to which the initial error is clamped, an integer of the format of positions.
    tracking_limit, effort_limit: largest weights, integers of their formats.
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
    tracker: int
    feedback: int
    braking: int
    approach: int
    knee: int
    slope: int
    cost: int
    gradient: int
    error_limit: int
    tracking_limit: int
    effort_limit: int

    @property
    def bits(self) -> dict[str, int]:
        """Fractional bits by quantity; the limits, which are numbers, are among them and never read."""
        return asdict(self)


@dataclass(frozen=True)
class _Bounds:
    """Bounds of absolute values over the horizon.

    acceleration: of acceleration, displacement, deficit, and every sum of them, m/step^2 and m/step.
    shared:       of the factors of shares: the acceleration due to a change of tilt or to the measured tilt,
                  and the deficit, m/step^2.
    error:        of the change of the error over the horizon, m.
    error_sum:    of the sum of that change over all steps, m.
    response:     of the sum of the responses to a move over any steps, each with any sign.
    """

    acceleration: float
    shared: float
    error: float
    error_sum: float
    response: float


def formats(settings: Sections, tables: HorizonTables) -> OneNormFormats:
    """Choose the formats of `settings`; `refusals` says whether they are fine enough."""
    ranges, optimizer, tilt = settings.ranges, settings.optimizer, settings.limits.tilt_rad
    step_s, gain = settings.horizon.prediction_step_s, _largest_gain(settings, tables)
    bounds, tracker = (
        _bounds(settings, tables),
        tracker_constants(settings, settings.horizon.prediction_step_s),
    )

    feedback = feedback_steps(settings)
    factor = fractional_bits(optimizer.increase)
    angle = fractional_bits(
        ATTITUDE_LIMIT_RAD + (tilt if tables.has_lag else 0),
        tilt + (2 * ATTITUDE_LIMIT_RAD * max(1.0, *feedback) if feedback else 0),
        2 * tilt,
        tilt + optimizer.step_max_rad,
        optimizer.step_max_rad * optimizer.increase,
        math.ldexp(optimizer.step_max_rad, UPPER_BITS - factor),
    )
    share = fractional_bits(
        tables.displacement_share,
        *(size for angle in tables.angles for size in map(abs, astuple(angle))),
    )
    acceleration = fractional_bits(bounds.acceleration, math.ldexp(bounds.shared, UPPER_BITS - share))
    error_limit = min(2 * ranges.position_m, bounds.error) * MARGIN
    error = min(
        fractional_bits(settings.horizon.prediction * error_limit + bounds.error_sum), acceleration - 1
    )
    limiting = one_norm_limits(settings)
    position = min(fractional_bits((_PLACES if limiting else 2) * ranges.position_m), error)
    velocity = fractional_bits(2 * ranges.velocity_m_s)
    gradient_bound = 2 * gain * bounds.response
    distance_gradient = fractional_bits(gradient_bound)

    distance = 2 * settings.horizon.prediction * (error_limit + bounds.error)
    variation = 4 * settings.horizon.control * tilt
    cost = settings.cost
    effort_limit = _WEIGHT_HEADROOM * (cost.effort_weight or min(1.0, cost.tracking_weight))
    effort = min(fractional_bits(effort_limit), PRODUCT_BITS - integer_bits(variation, effort_limit) - angle)
    tracking_limit = _WEIGHT_HEADROOM * cost.tracking_weight
    tracking = min(
        fractional_bits(tracking_limit),
        SUM_BITS
        - 1
        - max(integer_bits(tracking_limit, distance), integer_bits(effort_limit, variation))
        - error,
        SUM_BITS
        - 1
        - max(integer_bits(tracking_limit, gradient_bound), integer_bits(effort_limit, 2))
        - distance_gradient,
        effort + angle - error - 1,
    )
    effort = min(effort, tracking + distance_gradient)
    return OneNormFormats(
        position=position,
        velocity=velocity,
        thrust=fractional_bits(ranges.thrust_acceleration_max_m_s2),
        yaw=fractional_bits(YAW_LIMIT_RAD),
        angle=angle,
        step=fractional_bits(step_s),
        step_squared=fractional_bits(tables.step_squared_s2),
        gain=fractional_bits(gain),
        acceleration=acceleration,
        error=error,
        share=share,
        response=fractional_bits(2 * bounds.response),  # a spare bit: gcc shifts by less than 32 faster
        distance_gradient=distance_gradient,
        tracking=tracking,
        effort=effort,
        factor=factor,
        tracker=fractional_bits(tracker.factor_s) if tracker else 0,
        feedback=feedback_bits(feedback),
        **limits_bits(limiting, velocity, position),
        cost=tracking + error,
        gradient=tracking + distance_gradient,
        error_limit=raw(error_limit, position),
        tracking_limit=raw(min(tracking_limit, WEIGHT_LIMIT), tracking),
        effort_limit=raw(min(effort_limit, WEIGHT_LIMIT), effort),
    )


def refusals(settings: Sections) -> list[Refusal]:
    """Return which values of `settings` fixed point cannot represent, each with the nearest it can."""
    tables = horizon_tables(settings)
    found = formats(settings, tables)
    if not _resolves_errors(found):
        return [_refuse_range(settings, tables)]
    refused = [
        Refusal("cost", name, _weight_rule(settings, tables, name))
        for name in ("tracking_weight", "effort_weight")
        if not _resolves_weight(settings, found, name)
    ]
    optimizer = settings.optimizer
    least = math.ldexp(1, -found.cost)
    if 0 < optimizer.tolerance < least:
        rule = (
            f'must be 0 or at least {_round_up(least)} with code.scalar = "fixed", the resolution of the cost'
        )
        refused.append(Refusal("optimizer", "tolerance", rule))
    least = math.ldexp(1, -found.angle)
    refused.extend(
        Refusal(
            "optimizer",
            name,
            f'must be at least {_round_up(least)} with code.scalar = "fixed", the resolution of angles',
        )
        for name in ("initial_step_rad", "step_max_rad", "step_min_rad")
        if getattr(optimizer, name) < least
    )
    return refused


def _resolves_errors(found: OneNormFormats) -> bool:
    return found.error >= _COARSEST_ERROR_BITS


def _resolves_weight(settings: Sections, found: OneNormFormats, name: str) -> bool:
    weight: float = getattr(settings.cost, name)
    bits = found.tracking if name == "tracking_weight" else found.effort
    return weight == 0 or math.ldexp(weight, bits) >= _SMALLEST_WEIGHT


def _refuse_range(settings: Sections, tables: HorizonTables) -> Refusal:
    """Refuse the range that contributes most to the errors over the horizon."""
    horizon, ranges = settings.horizon, settings.ranges
    error_m = _bounds(settings, tables).error
    by_speed = 2 * ranges.velocity_m_s * horizon.prediction_step_s * horizon.prediction
    name, least = "thrust_acceleration_max_m_s2", ranges.thrust_acceleration_min_m_s2
    end = math.nextafter(least, math.inf)
    if by_speed > error_m / 2:
        name, least, end = "velocity_m_s", 0.0, 0.1
    fits = _nearest(settings, "ranges", name, end, lambda changed: _resolves_errors(formats(changed, tables)))
    way_out = "write a smaller horizon.prediction_step_s"
    if fits and float(_round_down(fits)) > least:
        way_out = f"write at most {_round_down(fits)}"
    rule = (
        f"lets errors reach {error_m:.3g} m over the horizon, coarser than 1 mm with "
        f'code.scalar = "fixed"; {way_out}'
    )
    return Refusal("ranges", name, rule)


def _weight_rule(settings: Sections, tables: HorizonTables, name: str) -> str:
    """Return the rule for a weight that is too small compared with the other one."""
    fits = _nearest(
        settings,
        "cost",
        name,
        WEIGHT_LIMIT,
        lambda changed: _resolves_weight(changed, formats(changed, tables), name),
    )
    other = "effort_weight" if name == "tracking_weight" else "tracking_weight"
    return (
        f"is too small compared with cost.{other} = {getattr(settings.cost, other):g}: "
        f'code.scalar = "fixed" would round it by more than a thousandth; '
        + (f"write at least {_round_up(fits)}" if fits else f"write a smaller cost.{other}")
    )


def _nearest(
    settings: Sections, section: str, name: str, end: float, fits: Callable[[Sections], bool]
) -> float | None:
    """Bisect from the present value, which does not fit, to `end`; None if `end` does not fit either."""
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


def _round_up(value: float) -> str:
    """Spell a value with three significant digits, rounded up."""
    return f"{_round_to_three_digits(value, math.ceil):g}"


def _round_down(value: float) -> str:
    """Spell a value with three significant digits, rounded down."""
    return f"{_round_to_three_digits(value, math.floor):g}"


def _round_to_three_digits(value: float, to_integer: Callable[[float], int]) -> float:
    digits = 2 - math.floor(math.log10(value))
    return float(f"{to_integer(value * 10.0**digits)}e{-digits}")


def _largest_gain(settings: Sections, tables: HorizonTables) -> float:
    return settings.ranges.thrust_acceleration_max_m_s2 * tables.step_squared_s2


def _bounds(settings: Sections, tables: HorizonTables) -> _Bounds:
    """Roll out the largest absolute values along one axis of the world, and add where the C subtracts."""
    tilt_rad, steps = settings.limits.tilt_rad, settings.horizon.prediction
    measured_rad = ATTITUDE_LIMIT_RAD if tables.has_lag else 0.0
    gain = _largest_gain(settings, tables)
    target = _tracker_bound(tracker_constants(settings, settings.horizon.prediction_step_s))
    acceleration = shared = 2 * gain * measured_rad + target
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


def _tracker_bound(tracker: TrackerConstants | None) -> float:
    """Return a bound of the target's acceleration and of every sum in the tracker, m/step^2.

    The largest is the difference of the measured acceleration and the predicted one.
    """
    if tracker is None:
        return 0.0
    return 2 * tracker.acceleration_limit_m_step2 + tracker.jerk_limit_m_step2_update
