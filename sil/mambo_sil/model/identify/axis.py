"""One axis: fitted on all stretches, with or without an integrator, and the verdict."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from mambo_sil.drone.vehicles.vehicle_sections import LONGEST_DELAY_S
from mambo_sil.model.identify.checks import EXCITED_RAD, NO_COMMAND_RAD
from mambo_sil.model.identify.identify_record import AxisResult, Verdict
from mambo_sil.model.identify.response import (
    AxisParameters,
    FittedResponse,
    Interval,
    fit_response,
    fit_second_order,
    intervals,
    residuals,
    root_mean_square,
)
from mambo_sil.model.identify.segments import Segment, duration_s
from mambo_sil.model.identify.signals import COMMANDS, DEGREE

WORTH: Final = 0.97
"""Largest ratio of held-out errors with and without the integrator at which it is taken."""

SLOW_SPAN: Final = 30
"""Samples over which model and tilt are smoothed, twice, for a response in slow motion: below 1 Hz."""
SLOW_WORTH: Final = 0.8
"""Largest ratio of held-out errors in slow motion at which the response fitted to it is taken."""

SHORTEST_FIT_S, GOOD_FIT_S = 8.0, 15.0
LEAST_R2: Final = 0.9
GOOD_COMMAND_RAD: Final = 2.0 * DEGREE
GAINS: Final = (0.4, 1.5)
"""Bounds on a plausible gain."""

VAGUE_GAIN, VAGUE_LAG_S = 0.1, 0.05
"""Half-widths of the intervals of gain and lag beyond which an axis is weak."""

SHORT_DELAY_S, LONG_DELAY_S = 0.002, 0.15
"""Dead times beyond which an offset between two clocks is likely."""

LARGEST_SPREAD_S: Final = 0.03
"""Difference of lag plus dead time between logs beyond which their clocks are doubted; of lag, the drone."""

LARGEST_SPREAD_GAIN: Final = 0.05
"""Difference of the gain between logs beyond which they are taken as of different drones."""


@dataclass(frozen=True, eq=False)
class AxisFit:
    """The fits of one axis: on all samples, and on the first halves, with errors in the second halves."""

    whole: FittedResponse
    intervals: AxisParameters
    first_order: AxisParameters
    """Without an integrator, whether or not `whole` has one."""
    slow: bool
    """Whether that is fitted to slow motion; a lag at the bound of its search is then a delay's."""
    half: FittedResponse
    r2: float
    error_rad: float
    other_error_rad: float
    """Error of the order that was not chosen."""


def fit_axis(segments: Sequence[Segment], axis: int) -> AxisFit | None:
    """Fit one axis and choose its order; None without a command.

    The integrator is taken if it lowers the held-out error, also of a response of second order, which it
    can imitate with a wrong gain, and its interval does not hold 0. Without one the response is that in slow
    motion, which the controller predicts, if it lowers the held-out error there by a fifth: the sines would
    else decide on the lag of a drone of higher order. The interval of the gain without it holds
    the gain of the better of both where they lower the error, and its interval where they do by as much as
    makes an integrator worth it.
    """
    if command_deviation_rad(segments, axis) < NO_COMMAND_RAD:
        return None
    first = [segment.counted & segment.first_half for segment in segments]
    second = [segment.counted & ~segment.first_half for segment in segments]
    halves = [fit_response(segments, axis, first, integrator=each) for each in (False, True)]
    errors = [root_mean_square(residuals(each, segments, axis, second)) for each in halves]
    tilts = [segment.tilt_rad[axis][mask] for segment, mask in zip(segments, second, strict=True)]
    spread = root_mean_square([tilt - tilt.mean() for tilt in tilts])
    every = [segment.counted for segment in segments]
    slow = fit_response(segments, axis, first, integrator=False, span=SLOW_SPAN)
    slow_errors = [
        root_mean_square(residuals(each, segments, axis, second, SLOW_SPAN)) for each in (slow, halves[0])
    ]
    span = SLOW_SPAN if slow_errors[0] < SLOW_WORTH * slow_errors[1] else 1
    plain = fit_response(segments, axis, every, integrator=False, span=span)
    first_order = intervals(plain, segments, axis, every, span)
    whole, known, chosen = plain, first_order, 0
    if errors[1] < errors[0]:
        imitated = fit_second_order(segments, axis, first)
        other_error = root_mean_square(residuals(imitated, segments, axis, second))
        richer = fit_response(segments, axis, every, integrator=True)
        better = richer if errors[1] < other_error else fit_second_order(segments, axis, every)
        missed = intervals(better, segments, axis, every).gain
        if min(errors[1], other_error) >= WORTH * errors[0]:
            missed = Interval(missed.value, 0.0)
        first_order = known = _cover(first_order, missed)
        found = intervals(richer, segments, axis, every)
        integral = found.integral_1_s
        worth = errors[1] < WORTH * min(errors[0], other_error)
        if worth and integral is not None and integral.value > integral.within:
            whole, known, chosen = richer, found, 1
    return AxisFit(
        whole,
        known,
        first_order,
        span == SLOW_SPAN,
        halves[chosen],
        1.0 - (errors[chosen] / max(spread, 1e-300)) ** 2,
        errors[chosen],
        errors[1 - chosen],
    )


def judge_axis(
    pieces: Sequence[Sequence[Segment]], axis: int, fit: AxisFit | None, tilt_noise_rad: float
) -> AxisResult:
    """Return the record of an axis with its verdict; `pieces` has the stretches of each log."""
    segments = [segment for piece in pieces for segment in piece]
    command_rad = command_deviation_rad(segments, axis)
    if fit is None:
        why = f"no command: {COMMANDS[axis]} is 0, or moves by less than 0.1 degrees (rms)"
        nothing = (command_rad, math.nan, math.nan, math.nan, None, None, math.nan, tilt_noise_rad)
        return AxisResult("refused", [why], *nothing)
    refused = _refusals(command_rad, duration_s(segments), fit)
    weak = _weaknesses(command_rad, duration_s(segments), fit)
    weak += [] if refused else _disagreement(pieces, axis, fit.whole)
    verdict: Verdict = "refused" if refused else "weak" if weak else "good"
    known = (fit.intervals, fit.first_order)
    if weak:
        known = (fit.intervals.without_split(), fit.first_order.without_split())
    return AxisResult(
        verdict=verdict,
        reasons=refused or weak,
        command_rad=command_rad,
        held_out_r2=fit.r2,
        held_out_error_rad=fit.error_rad,
        other_error_rad=fit.other_error_rad,
        fitted=None if refused else known[0],
        first_order=None if refused else known[1],
        offset_rad=sum(fit.whole.offset_rad) / len(fit.whole.offset_rad),
        tilt_noise_rad=tilt_noise_rad,
    )


def _cover(known: AxisParameters, gain: Interval) -> AxisParameters:
    """Return the parameters with an interval of the gain that also holds the interval `gain`."""
    within = max(known.gain.within, abs(gain.value - known.gain.value) + gain.within)
    return replace(known, gain=Interval(known.gain.value, within))


def command_deviation_rad(segments: Sequence[Segment], axis: int) -> float:
    """Return the standard deviation of a command about its mean in each stretch."""
    commands = [segment.command_means(axis)[segment.counted] for segment in segments]
    return root_mean_square([command - command.mean() for command in commands])


def _refusals(command_rad: float, flown_s: float, fit: AxisFit) -> list[str]:
    """Return why an axis is refused."""
    gain, delay_s = fit.whole.gain, max(fit.whole.delay_s, fit.first_order.delay_s.value)
    found = {
        f"a dead time of {1e3 * delay_s:.0f} ms, and at most {1e3 * LONGEST_DELAY_S:g} ms can be flown: do "
        "command and measured tilt share a clock?": delay_s > LONGEST_DELAY_S,
        f"commanded by {command_rad / DEGREE:.1f} degrees (rms); 1 degree is needed": command_rad
        < EXCITED_RAD,
        f"{flown_s:.0f} s of flight; {SHORTEST_FIT_S:g} s are needed": flown_s < SHORTEST_FIT_S,
        f"the model explains {max(fit.r2, 0.0):.2f} of the held-out half; {LEAST_R2} is needed": fit.r2
        < LEAST_R2,
        f"gain {gain:.3g}; plausible are {GAINS[0]}..{GAINS[1]}": not GAINS[0] <= gain <= GAINS[1],
    }
    return [words for words, holds in found.items() if holds]


def _weaknesses(command_rad: float, flown_s: float, fit: AxisFit) -> list[str]:
    """Return why an axis that is not refused is weak."""
    delay_s, gain, lag_s = fit.whole.delay_s, fit.intervals.gain.within, fit.intervals.lag_s.within
    clocks = f"a dead time of {1e3 * delay_s:.0f} ms: do command and measured tilt share a clock?"
    found = {
        f"commanded by {command_rad / DEGREE:.1f} degrees (rms); 2 degrees make it good": command_rad
        < GOOD_COMMAND_RAD,
        f"{flown_s:.0f} s of flight; {GOOD_FIT_S:g} s make it good": flown_s < GOOD_FIT_S,
        f"the gain is known within {gain:.2f} only; fly more than one frequency": gain > VAGUE_GAIN,
        f"the lag is known within {1e3 * lag_s:.0f} ms only; fly more than one frequency": lag_s
        > VAGUE_LAG_S,
        "the lag ended at a bound of its search": fit.whole.lag_at_bound and not fit.slow,
        clocks: not SHORT_DELAY_S < delay_s < LONG_DELAY_S,
    }
    return [words for words, holds in found.items() if holds]


def _disagreement(pieces: Sequence[Sequence[Segment]], axis: int, whole: FittedResponse) -> list[str]:
    """Return the remark that the logs, each fitted alone, differ: as drones do, or as clocks."""
    useful = [
        each
        for each in pieces
        if command_deviation_rad(each, axis) >= EXCITED_RAD and duration_s(each) >= SHORTEST_FIT_S
    ]
    if len(useful) < 2:
        return []
    integrator = whole.integral_1_s > 0.0
    fits = []
    for each in useful:
        counted = [segment.counted for segment in each]
        fits.append(intervals(fit_response(each, axis, counted, integrator=integrator), each, axis, counted))
    gains, lags = [fit.gain for fit in fits], [fit.lag_s for fit in fits]
    sums_s = [fit.sum_s.value for fit in fits]
    listed = ", ".join(f"{1e3 * each:.0f}" for each in sums_s)
    if _differ(gains, LARGEST_SPREAD_GAIN) or _differ(lags, LARGEST_SPREAD_S):
        each_gain = ", ".join(f"{gain.value:.2f}" for gain in gains)
        each_lag = ", ".join(f"{1e3 * lag.value:.0f}" for lag in lags)
        return [
            f"the drones of the logs differ: gain {each_gain}; lag {each_lag} ms; lag plus dead time "
            f"{listed} ms; identify each drone from its own logs"
        ]
    if max(sums_s) - min(sums_s) <= LARGEST_SPREAD_S:
        return []
    return [f"lag plus dead time of the logs is {listed} ms: do command and measured tilt share a clock?"]


def _differ(found: Sequence[Interval], spread: float) -> bool:
    """Return whether the least and the largest value are further apart than `spread` and their intervals."""
    least, largest = min(found, key=lambda each: each.value), max(found, key=lambda each: each.value)
    return largest.value - least.value > max(spread, least.within + largest.within)
