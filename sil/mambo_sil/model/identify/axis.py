"""One axis: fitted on all stretches, with or without an integrator, and the verdict."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from mambo_sil.model.identify.checks import EXCITED_RAD, NO_COMMAND_RAD
from mambo_sil.model.identify.identify_record import AxisResult, Verdict
from mambo_sil.model.identify.response import (
    AxisParameters,
    FirstOrder,
    FittedResponse,
    fit_response,
    intervals,
    residuals,
    root_mean_square,
)
from mambo_sil.model.identify.segments import Segment, duration_s
from mambo_sil.model.identify.signals import COMMANDS, DEGREE

WORTH: Final = 0.97
"""Largest ratio of held-out errors with and without the integrator at which it is taken."""

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
"""Difference of lag plus dead time between logs beyond which their clocks are doubted."""


@dataclass(frozen=True, eq=False)
class AxisFit:
    """The fits of one axis: on all samples, and on the first halves, with errors in the second halves."""

    whole: FittedResponse
    intervals: AxisParameters
    first_order: FirstOrder
    half: FittedResponse
    r2: float
    error_rad: float
    other_error_rad: float
    """Error of the order that was not chosen."""


def fit_axis(segments: Sequence[Segment], axis: int) -> AxisFit | None:
    """Fit one axis and choose its order; None without a command.

    The integrator is taken if it lowers the held-out error and its interval does not hold 0.
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
    plain = fit_response(segments, axis, every, integrator=False)
    whole, known, chosen = plain, intervals(plain, segments, axis, every), 0
    if errors[1] < WORTH * errors[0]:
        richer = fit_response(segments, axis, every, integrator=True)
        found = intervals(richer, segments, axis, every)
        if found.integral_1_s is not None and found.integral_1_s.value > found.integral_1_s.within:
            whole, known, chosen = richer, found, 1
    return AxisFit(
        whole,
        known,
        FirstOrder(plain.gain, plain.lag_s, plain.delay_s),
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
    return AxisResult(
        verdict=verdict,
        reasons=refused or weak,
        command_rad=command_rad,
        held_out_r2=fit.r2,
        held_out_error_rad=fit.error_rad,
        other_error_rad=fit.other_error_rad,
        fitted=None if refused else fit.intervals,
        first_order=None if refused else fit.first_order,
        offset_rad=sum(fit.whole.offset_rad) / len(fit.whole.offset_rad),
        tilt_noise_rad=tilt_noise_rad,
    )


def command_deviation_rad(segments: Sequence[Segment], axis: int) -> float:
    """Return the standard deviation of a command about its mean in each stretch."""
    commands = [segment.command_means(axis)[segment.counted] for segment in segments]
    return root_mean_square([command - command.mean() for command in commands])


def _refusals(command_rad: float, flown_s: float, fit: AxisFit) -> list[str]:
    """Return why an axis is refused."""
    gain = fit.whole.gain
    found = {
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
        "the lag ended at a bound of its search": fit.whole.lag_at_bound,
        clocks: not SHORT_DELAY_S < delay_s < LONG_DELAY_S,
    }
    return [words for words, holds in found.items() if holds]


def _disagreement(pieces: Sequence[Sequence[Segment]], axis: int, whole: FittedResponse) -> list[str]:
    """Return the remark that the logs, each fitted alone, have different sums of lag and dead time."""
    useful = [
        each
        for each in pieces
        if command_deviation_rad(each, axis) >= EXCITED_RAD and duration_s(each) >= SHORTEST_FIT_S
    ]
    if len(useful) < 2:
        return []
    integrator = whole.integral_1_s > 0.0
    fits = [
        fit_response(each, axis, [segment.counted for segment in each], integrator=integrator)
        for each in useful
    ]
    sums = [fit.lag_s + fit.delay_s for fit in fits]
    if max(sums) - min(sums) <= LARGEST_SPREAD_S:
        return []
    listed = ", ".join(f"{1e3 * each:.0f}" for each in sums)
    return [f"lag plus dead time of the logs is {listed} ms: do command and measured tilt share a clock?"]
