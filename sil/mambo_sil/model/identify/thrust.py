"""The response of the height to the thrust command: gain, lag, hover command, and the sag of the battery.

In windows of two seconds, with c the command behind a first-order lag, times cos roll cos pitch:

    height = constant + constant t + double integral of (gain (1 - sag t) c - weight)

t being the time since the beginning of the log. The weight is fitted, too, because the thrust need not be in
proportion to its command: gain is the slope at hover. Constants, gain, sag and weight are solved linearly
inside the search for the lag, which holds the dead time, and the age of the height, too.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import minimize_scalar

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.model.identify.identify_record import ThrustResult, Verdict
from mambo_sil.model.identify.response import (
    NORMAL_95,
    SURPLUS_S,
    WIDENING,
    Interval,
    filter_command,
    newey_west,
)
from mambo_sil.model.identify.segments import PERIOD_S, Segment

WINDOW_S: Final = 2.0
LEAST_WINDOWS, GOOD_WINDOWS = 4, 7
"""Windows below which the thrust is refused, and weak."""
_TRIED_S: Final = np.geomspace(0.005, 0.4, 25)
_CHANGE: Final = 0.01
"""Lags that are tried first; change of the logarithm of the lag for its derivative."""
_CORRELATION: Final = 100
"""Samples over which what is left is taken as correlated."""

LEAST_CHANGE, GOOD_CHANGE = 0.03, 0.05
"""Standard deviation of the lagged command over its mean below which the thrust is refused, and weak."""
LEAST_R2, GOOD_R2 = 0.8, 0.9
"""Share of the height that the model must explain on the half that was held out."""
SURPLUS_GAIN: Final = 0.02
"""Added to the half-width of the gain, over it: rotors are no first-order lag of the thrust, and a log has
fewer samples than the loop that commands it."""
SAG_WIDENING: Final = 2.5
"""Factor on the interval of the sag besides: slow gusts look like it."""
VAGUE_SHARE, VAGUE_LAG_S = 0.1, 0.05
"""Half-widths of the intervals of the gain, over it, and of the lag beyond which the thrust is weak."""
WEIGHTS_G, GOOD_WEIGHTS_G = (0.5, 2.0), (0.9, 1.1)
"""Bounds on a plausible weight, and on that of a thrust in proportion to its command."""
STEPS: Final = "fly steps of height, as 0.25 m up and down every 1.5 s, for 20 s"


@dataclass(frozen=True, eq=False)
class _Window:
    """Heights of a window without their mean and mean climb (m,), and what drives them (m, 3)."""

    rates: FloatArray
    height_m: FloatArray


@dataclass(frozen=True, eq=False)
class _Fit:
    """Gain, gain times sag, and weight (3,) at a lag, and the error of each window."""

    lag_s: float
    values: FloatArray
    errors: list[FloatArray]

    @property
    def power(self) -> float:
        """The sum of the squares of the errors."""
        return sum(float(each @ each) for each in self.errors)


def fit_thrust(segments: Sequence[Segment]) -> ThrustResult | None:
    """Fit the thrust on all stretches that have height and thrust; None if there is none."""
    shown = [each for each in segments if each.height_m is not None and each.thrust is not None]
    if not shown:
        return None
    windows = _windows(shown, _TRIED_S[0])
    if len(windows) < LEAST_WINDOWS:
        why = f"{WINDOW_S * len(windows):.0f} s of flight; {WINDOW_S * LEAST_WINDOWS:.0f} s are needed"
        return ThrustResult("refused", [why], np.nan, np.nan, None, None, np.nan, None, np.nan, scaled=False)
    fit, half = _fit(shown), _fit(shown, first_half=True)
    held_out = _windows(shown, half.lag_s)[len(half.errors) :]
    r2 = 1.0 - sum(map(_power, _errors(held_out, half.values))) / sum(
        _power(each.height_m) for each in held_out
    )
    change = _change(shown, fit.lag_s)
    gain, lag, sag = _intervals(shown, fit)
    weight_g = float(fit.values[2]) / GRAVITY_M_S2
    refused = _refusals(change, r2, weight_g, gain)
    weak = [f"the model explains {r2:.2f} of the height held out; gusts?"] if r2 < GOOD_R2 else []
    weak += _weaknesses(change, weight_g, gain, lag, len(windows))
    verdict: Verdict = "refused" if refused else "weak" if weak else "good"
    return ThrustResult(
        verdict=verdict,
        reasons=refused or weak,
        command_change=change,
        held_out_r2=r2,
        gain=None if refused else gain,
        lag_s=None if refused else lag,
        hover_command=np.nan if refused else float(fit.values[2]) / gain.value,
        battery_sag_1_s=None if refused else sag,
        weight_g=weight_g,
        scaled=all(each.thrust_in_m_s2 for each in shown),
    )


def _refusals(change: float, r2: float, weight_g: float, gain: Interval) -> list[str]:
    """Return why a fit is no use."""
    if change < LEAST_CHANGE:
        return [
            f"the thrust changes by {change:.1%} of hover (rms), {LEAST_CHANGE:.0%} are needed: "
            f"in hover gain and weight are one number; {STEPS}"
        ]
    if r2 < LEAST_R2 or gain.value <= 0.0:
        return [f"the model explains {r2:.2f} of the height held out; {LEAST_R2} is needed; {STEPS}"]
    if not WEIGHTS_G[0] <= weight_g <= WEIGHTS_G[1]:
        return [f"the weight would be {weight_g:.2f} g: check the units of height and time"]
    return []


def _weaknesses(change: float, weight_g: float, gain: Interval, lag: Interval, windows: int) -> list[str]:
    """Return why a fit is not good."""
    found = []
    if change < GOOD_CHANGE:
        found.append(f"the thrust changes by {change:.1%} of hover (rms); {GOOD_CHANGE:.0%} are better")
    if windows < GOOD_WINDOWS:
        found.append(f"{WINDOW_S * windows:.0f} s of flight; {WINDOW_S * GOOD_WINDOWS:.0f} s are better")
    if gain.within > VAGUE_SHARE * gain.value:
        found.append(f"the gain is known within {gain.within / gain.value:.0%}")
    if lag.within > VAGUE_LAG_S:
        found.append(f"the lag is known within {1e3 * lag.within:.0f} ms")
    if not GOOD_WEIGHTS_G[0] <= weight_g <= GOOD_WEIGHTS_G[1]:
        found.append(f"the weight would be {weight_g:.2f} g: the thrust is not in proportion to its command")
    return found


def _fit(segments: Sequence[Segment], *, first_half: bool = False) -> _Fit:
    """Return the best fit to all windows, or to the first half of them."""

    def at(lag_s: float) -> _Fit:
        windows = _windows(segments, lag_s)
        windows = windows[: len(windows) // 2] if first_half else windows
        rates = np.concatenate([each.rates for each in windows])
        values = np.linalg.lstsq(rates, np.concatenate([each.height_m for each in windows]), rcond=None)[0]
        return _Fit(lag_s, values, _errors(windows, values))

    powers = [at(lag_s).power for lag_s in _TRIED_S]
    best = min(max(int(np.argmin(powers)), 1), len(_TRIED_S) - 2)
    bounds = np.log(_TRIED_S[best - 1]), np.log(_TRIED_S[best + 1])
    found = minimize_scalar(lambda log: at(np.exp(log)).power, bounds=bounds, method="bounded")
    return at(float(np.exp(found.x)))


def _power(values: FloatArray) -> float:
    return float(values @ values)


def _errors(windows: Sequence[_Window], values: FloatArray) -> list[FloatArray]:
    """Return measured less modelled height (m,) of each window."""
    return [each.height_m - each.rates @ values for each in windows]


def _intervals(segments: Sequence[Segment], fit: _Fit) -> tuple[Interval, Interval, Interval]:
    """Return gain, lag and sag, with intervals as those of the angles."""
    after, before = (_windows(segments, fit.lag_s * np.exp(sign * _CHANGE)) for sign in (1.0, -1.0))
    slopes = [
        np.column_stack([here.rates, (late.rates - early.rates) @ fit.values / (2.0 * _CHANGE)])
        for here, late, early in zip(_windows(segments, fit.lag_s), after, before, strict=True)
    ]
    variances = np.diag(newey_west(slopes, fit.errors, _CORRELATION))
    within = (NORMAL_95 * WIDENING * np.sqrt(np.maximum(variances, 0.0))).tolist()
    gain = float(fit.values[0])
    return (
        Interval(gain, within[0] + SURPLUS_GAIN * abs(gain)),
        Interval(fit.lag_s, fit.lag_s * within[3] + SURPLUS_S),
        Interval(float(fit.values[1]) / gain, SAG_WIDENING * within[1] / abs(gain)),
    )


def _vertical(segment: Segment, lag_s: float) -> FloatArray:
    """Return the command (m,) of a stretch behind a lag, times its vertical share."""
    assert segment.thrust is not None
    keep = np.exp(-PERIOD_S / lag_s)
    lagged = filter_command(
        np.array([1.0 - keep]), np.array([1.0, -keep]), segment.thrust.means(segment.time_s)
    )
    return np.asarray(lagged * np.cos(segment.tilt_rad[0]) * np.cos(segment.tilt_rad[1]))


def _change(segments: Sequence[Segment], lag_s: float) -> float:
    """Return the standard deviation of the lagged command over its mean."""
    whole = np.concatenate([_vertical(each, lag_s)[each.counted] for each in segments])
    return float(whole.std() / abs(whole.mean()))


def _windows(segments: Sequence[Segment], lag_s: float) -> list[_Window]:
    """Return all windows of stretches."""
    size = round(WINDOW_S / PERIOD_S)
    time_s = PERIOD_S * np.arange(size)
    lines, _ = np.linalg.qr(np.column_stack([np.ones(size), time_s]))
    found = []
    for segment in segments:
        assert segment.height_m is not None
        vertical = _vertical(segment, lag_s)
        begun = int(np.argmax(segment.counted))
        for first in range(begun, len(vertical) - size + 1, size):
            here = slice(first, first + size)
            late = -(segment.time_s[here] - segment.begun_s) * vertical[here]
            rates = np.column_stack([_twice(vertical[here]), _twice(late), -0.5 * time_s * time_s])
            height_m = segment.height_m[here]
            found.append(_Window(rates - lines @ (lines.T @ rates), height_m - lines @ (lines.T @ height_m)))
    return found


def _twice(values: FloatArray) -> FloatArray:
    """Return the double integral (m,) of samples (m,), which change evenly in between."""
    for _ in range(2):
        values = PERIOD_S * np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))])
    return values
