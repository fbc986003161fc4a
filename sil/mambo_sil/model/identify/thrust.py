"""The response of the height to the thrust command: lag, hover command, gain, and the sag of the battery.

In windows of 1.2 s, with c the command behind a dead time and a first-order lag, times cos roll cos pitch:

    climb' = slope (c - hover) - drag climb

Both sides are integrated twice. Slope and drag are solved linearly inside the search for lag and dead time;
without the drag the slope would be too low, and the lag too short. The hover command is a constant of each
window and holds what changes slowly, the weight, the battery and gusts, which the controller answers: so its
answer does not pass for a response. Through the hover commands of all windows goes a line: its value in the
middle of the logs is their hover command, the gain is g over it, and its slope is the sag. The sum of lag and
dead time is known better than either: it is the lag that is reported. It holds the age of the height, too.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.model.identify.identify_record import ThrustResult
from mambo_sil.model.identify.response import (
    NORMAL_95,
    WIDENING,
    Interval,
    newey_west,
)
from mambo_sil.model.identify.segments import Segment
from mambo_sil.model.identify.thrust_windows import SIZE, WINDOW_S, Windows, cut_windows
from mambo_sil.results.number_format import three_digits

LEAST_S, GOOD_S = 8.0, 14.0
"""Time in windows below which the thrust is refused, and weak."""
_HOVER_CORRELATION: Final = 13
"""Windows over which the hover commands are taken as correlated: 8 s, because gusts last for seconds."""
_BLOCK: Final = 8
"""Windows that are fitted, or held out, together: 5 s."""

_STARTS: Final = np.log([[0.05, 0.02], [0.15, 0.005]])
_LOW, _HIGH = np.log([0.003, 0.0005]), np.log([0.5, 0.2])
"""Logarithms of lag and dead time: starts and bounds of the search."""
_STEP: Final = 0.02
"""Change of these logarithms for their derivatives."""

LEAST_CHANGE, GOOD_CHANGE = 0.03, 0.05
"""Change of the thrust, over hover, below which the thrust is refused, and weak."""
LEAST_R2, GOOD_R2 = 0.5, 0.8
"""Share of the changes of height that the model must explain in the windows that were held out."""
SURPLUS_GAIN: Final = 0.015
"""Added to the half-width of the gain, over it: a steady vertical wind of 0.15 m/s^2 looks like it."""
SURPLUS_LAG_S: Final = 0.01
"""Added to the interval of the lag: the noise of the height comes back through the altitude loop."""
EXPLAINED_R2, UNEXPLAINED_LAG_S = 0.98, 0.3
"""Share of the height beyond which noise explains the rest, and what is added times the share below it: the
controller answers the errors of an estimator, which looks like a thrust that is later by 0.1 to 0.3 s times
that share."""
SAG_WIDENING: Final = 2.5
"""Factor on the interval of the sag besides: slow gusts look like it."""
VAGUE_LAG_S, UNKNOWN_LAG_S = 0.05, 0.1
"""Half-widths of the interval of the lag beyond which the thrust is weak, and refused."""
LAGS_S: Final = (0.005, 0.5)
"""Bounds on a plausible sum of lag and dead time."""
STEP_M: Final = 0.12
"""Range of the height from which on it has been flown up and down."""
STEPS: Final = "fly steps of height, as 0.25 m up and down every 1.5 s, for 20 s"
WEIGHTS_G, GOOD_WEIGHTS_G = (0.5, 2.0), (0.85, 1.15)
"""Bounds on slope times hover command over g, and on the same for a thrust in proportion to its command."""


@dataclass(frozen=True, eq=False)
class _Fit:
    """Logarithms of lag and dead time (2,); slope and drag (2,)."""

    logs: FloatArray
    values: FloatArray

    @property
    def times_s(self) -> FloatArray:
        """Lag and dead time (2,)."""
        return np.asarray(np.exp(self.logs))


def fit_thrust(segments: Sequence[Segment]) -> ThrustResult | None:
    """Fit the thrust on all stretches that have height and thrust; None if there is none."""
    shown = [each for each in segments if each.height_m is not None and each.thrust is not None]
    if not shown:
        return None
    windows = cut_windows(shown, _STARTS[0])
    flown_s = 0.5 * WINDOW_S * sum(len(each.middle_s) for each in windows)
    if flown_s < LEAST_S:
        return _refused(f"{flown_s:.0f} s of flight; {LEAST_S:.0f} s are needed", np.nan)
    hover_command, change = _changes(windows)
    heights_m = [each.height_m[each.counted] for each in shown if each.height_m is not None]
    moved_m = max(float(np.ptp(each)) for each in heights_m)
    if change < LEAST_CHANGE:
        return _refused(_calm(hover_command, change, moved_m), change)
    fit = _fit(shown)
    r2 = _held_out_r2(shown)
    lag = _lag(shown, fit, r2)
    hover, sag = _hover(cut_windows(shown, fit.logs), fit)
    weight_g = float(fit.values[0]) * hover.value / GRAVITY_M_S2
    if why := _refusal(moved_m, r2, weight_g, lag):
        return _refused(why, change, r2)
    weak = _weaknesses(change, r2, weight_g, lag, flown_s)
    gain = GRAVITY_M_S2 / hover.value
    return ThrustResult(
        verdict="weak" if weak else "good",
        reasons=weak,
        command_change=change,
        held_out_r2=r2,
        gain=Interval(gain, gain * (hover.within / hover.value + SURPLUS_GAIN)),
        lag_s=lag,
        hover_command=hover.value,
        battery_sag_1_s=sag,
        weight_g=weight_g,
        drag_1_s=float(fit.values[1]),
        scaled=all(each.thrust_in_m_s2 for each in shown),
    )


def _refused(why: str, change: float, r2: float = np.nan) -> ThrustResult:
    """Return the record of logs that do not show the thrust."""
    nothing = (None, None, np.nan, None, np.nan, np.nan)
    return ThrustResult("refused", [why], change, r2, *nothing, scaled=False)


def _calm(hover_command: float, change: float, moved_m: float) -> str:
    """Return why a log whose thrust hardly changes is no use, and what to fly: not what was flown."""
    if hover_command <= 0.0:
        return "the thrust that was sent is not positive: check its column and sign"
    why = (
        f"the thrust changes by {change:.1%} of hover (rms in {WINDOW_S:g} s), {LEAST_CHANGE:.0%} are needed"
    )
    if moved_m >= STEP_M:
        return f"{why}: the height moved by {moved_m:.2f} m; fly higher or quicker steps of height"
    return f"{why}: this log shows the command of hover, {three_digits(hover_command)}, and no lag; {STEPS}"


def _refusal(moved_m: float, r2: float, weight_g: float, lag: Interval) -> str:
    """Return why a fit is no use, or nothing."""
    if r2 < LEAST_R2 or weight_g <= 0.0:
        why = f"the thrust explains {max(r2, 0.0):.2f} of the height held out, {LEAST_R2} is needed: "
        if moved_m < STEP_M:
            return f"{why}{STEPS}"
        return (
            f"{why}gusts or noise are as large as its effect, or the columns are not the height and the "
            "thrust that was sent, on one clock"
        )
    if not WEIGHTS_G[0] <= weight_g <= WEIGHTS_G[1]:
        return f"the weight would be {weight_g:.2f} g: check the units of height and time"
    if not LAGS_S[0] < lag.value < LAGS_S[1]:
        why = f"the lag would be {1e3 * lag.value:.0f} ms"
        return f"{why}: if height and thrust are on one clock, fly quicker steps"
    if lag.within > UNKNOWN_LAG_S:
        return (
            f"the lag is known within {1e3 * lag.within:.0f} ms, {1e3 * UNKNOWN_LAG_S:.0f} ms are needed; "
            "fly longer, with quicker changes of height, in calm air"
        )
    return ""


def _weaknesses(change: float, r2: float, weight_g: float, lag: Interval, flown_s: float) -> list[str]:
    """Return why a fit is not good."""
    found = []
    if r2 < GOOD_R2:
        found.append(f"the model explains {r2:.2f} of the height held out; gusts?")
    if change < GOOD_CHANGE:
        found.append(
            f"the thrust changes by {change:.1%} of hover (rms in {WINDOW_S:g} s); {GOOD_CHANGE:.0%} are "
            "better"
        )
    if flown_s < GOOD_S:
        found.append(f"{flown_s:.0f} s of flight; {GOOD_S:.0f} s are better")
    if lag.within > VAGUE_LAG_S:
        found.append(f"the lag is known within {1e3 * lag.within:.0f} ms")
    if not GOOD_WEIGHTS_G[0] <= weight_g <= GOOD_WEIGHTS_G[1]:
        found.append(
            f"a change of the command has {weight_g:.2f} times the effect that hover tells: the thrust is "
            "not in proportion to its command"
        )
    return found


def _fit(segments: Sequence[Segment], *, half: bool = False) -> _Fit:
    """Return the best fit to all windows, or to every second block of them."""

    def solve(logs: FloatArray) -> tuple[FloatArray, FloatArray]:
        rates, heights_m = _stack(cut_windows(segments, logs))
        if half:
            fitted = _blocks(len(heights_m)) == 0
            rates, heights_m = rates[:, fitted], heights_m[fitted]
        slopes, changes = rates.reshape(2, -1).T, heights_m.ravel()
        values = np.linalg.lstsq(slopes, changes, rcond=None)[0]
        return np.asarray(values), np.asarray(changes - slopes @ values)

    found = [
        least_squares(lambda logs: solve(logs)[1], start, bounds=(_LOW, _HIGH), x_scale=0.3, diff_step=1e-3)
        for start in _STARTS
    ]
    logs = np.asarray(min(found, key=lambda one: float(one.cost)).x)
    return _Fit(logs, solve(logs)[0])


def _held_out_r2(segments: Sequence[Segment]) -> float:
    """Return the R2 in every second block of windows of a fit to the others."""
    fit = _fit(segments, half=True)
    rates, heights_m = _stack(cut_windows(segments, fit.logs))
    held_out = _blocks(len(heights_m)) == 1
    left = heights_m[held_out] - _modelled(rates[:, held_out], fit.values)
    return 1.0 - float(np.sum(left**2) / np.sum(heights_m[held_out] ** 2))


def _stack(windows: Sequence[Windows]) -> tuple[FloatArray, FloatArray]:
    """Return the rates (2, n, m) and heights (n, m) in the windows of all stretches."""
    rates = np.concatenate([each.rates for each in windows], axis=1)
    return rates, np.concatenate([each.height_m for each in windows])


def _blocks(count: int) -> NDArray[np.int64]:
    """Return for each window (count,) 0 if its block is fitted, 1 if it is held out.

    A block lasts longer than a step: single windows, taken by turns, could miss all steps.
    """
    return np.arange(count) // _BLOCK % 2


def _modelled(rates: FloatArray, values: FloatArray) -> FloatArray:
    """Return the sum (...) of rates (2, ...) times slope and drag (2,)."""
    return np.asarray(values[0] * rates[0] + values[1] * rates[1])


def _lag(segments: Sequence[Segment], fit: _Fit, r2: float) -> Interval:
    """Return the sum of lag and dead time; its interval is wider by what is left unexplained."""
    windows = cut_windows(segments, fit.logs)
    columns = [[each.rates[0], each.rates[1]] for each in windows]
    for index in range(2):
        step = np.zeros(2)
        step[index] = _STEP
        after, before = (cut_windows(segments, fit.logs + sign * step) for sign in (1.0, -1.0))
        for found, late, early in zip(columns, after, before, strict=True):
            found.append(_modelled(late.rates - early.rates, fit.values) / (2.0 * _STEP))
    slopes = [np.stack(each, axis=-1).reshape(-1, 4) for each in columns]
    errors = [(each.height_m - _modelled(each.rates, fit.values)).ravel() for each in windows]
    covariance = newey_west(slopes, errors, 2 * SIZE)[2:, 2:]
    times_s = fit.times_s
    variance = max(float(times_s @ covariance @ times_s), 0.0)
    unknown_s = max(each.thrust.unknown_s for each in segments if each.thrust is not None)
    surplus_s = SURPLUS_LAG_S + unknown_s + UNEXPLAINED_LAG_S * max(EXPLAINED_R2 - r2, 0.0)
    sum_s = float(times_s.sum())
    lag_s = min(sum_s, max(sum_s - unknown_s, 2.0 * LAGS_S[0]))
    return Interval(lag_s, NORMAL_95 * WIDENING * variance**0.5 + surplus_s)


def _hover(windows: Sequence[Windows], fit: _Fit) -> tuple[Interval, Interval]:
    """Return the hover command in the middle of the logs, and its rise over it per second: the sag."""
    middle_s = float(np.mean(np.concatenate([each.middle_s for each in windows])))
    lines = [np.column_stack([np.ones(len(each.middle_s)), each.middle_s - middle_s]) for each in windows]
    commands = [
        (_modelled(each.rate_curvatures, fit.values) - each.height_curvature) / fit.values[0]
        for each in windows
    ]
    line = np.linalg.lstsq(np.concatenate(lines), np.concatenate(commands), rcond=None)[0]
    errors = [command - rows @ line for rows, command in zip(lines, commands, strict=True)]
    hover, rise = line.tolist()
    variances = np.diag(newey_west(lines, [each / hover for each in errors], _HOVER_CORRELATION))
    within = (NORMAL_95 * WIDENING * np.sqrt(np.maximum(variances, 0.0))).tolist()
    return Interval(hover, abs(hover) * within[0]), Interval(rise / hover, SAG_WIDENING * within[1])


def _changes(windows: Sequence[Windows]) -> tuple[float, float]:
    """Return the mean of the command, and the rms of its changes in windows over that.

    The changes are those in the windows that have the largest, `LEAST_S` of them; three digits.
    """
    command = np.concatenate([each.command for each in windows])
    power = np.sort(command.var(axis=1))[-round(LEAST_S / (0.5 * WINDOW_S)) :]
    mean = float(command.mean())
    return mean, round(float(np.sqrt(power.mean())) / mean, 3) if mean > 0.0 else 0.0
