"""The response of measured to commanded tilt: gain, lag, dead time and, if it pays, an integrator.

    measured = gain * G(command delayed by the dead time) + offset
    G(s) = 1 / (lag s + 1), with the integrator (s + k) / (lag s^2 + s + k)

A response of second order without an integrator is k / (lag s^2 + s + k).

Output error: the model is driven by the commands alone. Gain and offsets are solved linearly inside the
search for the other parameters, of which it takes the logarithms. Model and tilt may be smoothed alike: then
the model describes slow motion, in which a drone of higher order has another lag than in quick motion.
"""

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dtbtrs
from scipy.optimize import least_squares

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.model.identify.segments import PERIOD_S, Segment

SHORTEST_DELAY_S: Final = 0.001
_LOW: Final = np.log([0.005, SHORTEST_DELAY_S, 0.02])
_HIGH: Final = np.log([2.0, 0.3, 10.0])
"""Bounds on lag, dead time (s) and integrator (1/s)."""
_HIGH_SECOND_ORDER: Final = np.log([2.0, 0.3, 200.0])

_STARTS: Final = ((0.1, 0.03, 0.7), (0.05, 0.1, 0.7))
_STARTS_INTEGRATOR: Final = (*_STARTS, (0.25, 0.02, 1.0), (0.1, 0.03, 2.0))
"""With an integrator the error has several minima: a lag with a larger gain is one of them."""
_STARTS_SECOND_ORDER: Final = ((0.05, 0.03, 10.0), (0.05, 0.1, 10.0))
_STEP: Final = 1e-3
CORRELATION_S: Final = 1.0
"""Time over which residuals are taken as correlated (Newey and West 1987)."""

NORMAL_95: Final = 1.96
WIDENING: Final = 2.0
DEAD_TIME_WIDENING: Final = 3.0
SURPLUS_S: Final = 0.005
"""Factors on the 95 % intervals, and what is added to times. Residuals of real logs are correlated
for longer than the window; with these factors the intervals hold from flight to flight."""

SURPLUS_RARE_GAIN: Final = 0.01
"""Added to the half-width of the gain, over it, where commands are rarely logged: cubics through their
samples leave out a part of quick motion."""

_LEAST_VARIANCE: Final = 1e-12
"""Least variance of the residuals that intervals assume."""

Masks = Sequence[NDArray[np.bool_]]


@dataclass(frozen=True)
class Interval:
    """A value and the half-width of its 95 % interval."""

    value: float
    within: float


@dataclass(frozen=True, eq=False)
class FittedResponse:
    """Parameters of one axis; `integral_1_s` is 0 without an integrator."""

    gain: float
    lag_s: float
    delay_s: float
    integral_1_s: float
    offset_rad: tuple[float, ...]
    """Measured tilt at no command, one value a segment."""
    zero: float = 1.0
    """Factor on s in the numerator: 0 for a response of second order, whose k is `integral_1_s`."""

    def predict(self, segment: Segment, axis: int, offset_rad: float) -> FloatArray:
        """Return the modelled tilt (m,) of a segment."""
        return self.gain * _unit_response(self.logs, segment, axis, self.zero) + offset_rad

    @property
    def lag_at_bound(self) -> bool:
        """Whether the lag ended at a bound of its search."""
        return not _LOW[0] + 0.02 < np.log(self.lag_s) < _HIGH[0] - 0.02

    @property
    def logs(self) -> FloatArray:
        """The logarithms of lag, dead time and, if there is one, integrator."""
        values = [self.lag_s, self.delay_s] + ([self.integral_1_s] if self.integral_1_s else [])
        return np.log(values)


def fit_response(
    segments: Sequence[Segment], axis: int, masks: Masks, *, integrator: bool, span: int = 1
) -> FittedResponse:
    """Fit one axis of all segments at once, on the samples of `masks`, smoothed over `span` samples twice."""
    if integrator:
        return _fit(segments, axis, masks, _STARTS_INTEGRATOR, _HIGH, zero=1.0, span=span)
    return _fit(segments, axis, masks, [start[:2] for start in _STARTS], _HIGH[:2], zero=1.0, span=span)


def fit_second_order(segments: Sequence[Segment], axis: int, masks: Masks) -> FittedResponse:
    """Fit a response of second order, with which an integrator must compete."""
    return _fit(segments, axis, masks, _STARTS_SECOND_ORDER, _HIGH_SECOND_ORDER, zero=0.0)


def _fit(
    segments: Sequence[Segment],
    axis: int,
    masks: Masks,
    starts: Sequence[Sequence[float]],
    high: FloatArray,
    *,
    zero: float,
    span: int = 1,
) -> FittedResponse:
    """Fit lag, dead time and, if `starts` have three values, k."""

    def residual(logs: FloatArray) -> FloatArray:
        gain, parts = _project(logs, segments, axis, masks, zero=zero, span=span)
        return np.concatenate([tilt - gain * unit for unit, tilt, _, _ in parts])

    bounds = (_LOW[: len(high)], high)
    found = [
        least_squares(residual, np.log(start), bounds=bounds, x_scale=0.3, diff_step=_STEP)
        for start in starts
    ]
    logs = min(found, key=lambda one: float(one.cost)).x
    gain, parts = _project(logs, segments, axis, masks, zero=zero, span=span)
    offsets = tuple(tilt_mean - gain * unit_mean for _, _, unit_mean, tilt_mean in parts)
    lag_s, delay_s, *rest = np.exp(logs).tolist()
    return FittedResponse(gain, lag_s, delay_s, rest[0] if rest else 0.0, offsets, zero)


def residuals(
    response: FittedResponse, segments: Sequence[Segment], axis: int, masks: Masks, span: int = 1
) -> list[FloatArray]:
    """Return measured less modelled tilt of each segment on the samples of `masks`, offsets as fitted."""
    return [
        _smooth((segment.tilt_rad[axis] - response.predict(segment, axis, offset))[mask], span)
        for segment, offset, mask in zip(segments, response.offset_rad, masks, strict=True)
    ]


def root_mean_square(parts: Sequence[FloatArray]) -> float:
    """Return the rms of all samples."""
    return float(np.sqrt(np.mean(np.square(np.concatenate(list(parts))))))


@dataclass(frozen=True)
class AxisParameters:
    """Parameters with their 95 % intervals; `sum_s` is lag plus dead time, known better than either."""

    gain: Interval
    sum_s: Interval
    lag_s: Interval
    delay_s: Interval
    integral_1_s: Interval | None
    split_is_known: bool = True
    """Else only `sum_s` is: the lag may be anything from 0 up to it, as its interval says."""

    @property
    def split_s(self) -> float:
        """By how much the lag may be longer or shorter, and the dead time the reverse, at the same sum."""
        return max(self.lag_s.value, self.delay_s.value)

    def without_split(self) -> "AxisParameters":
        """Return the parameters with intervals of lag and dead time that hold every split of their sum."""
        within_s = self.split_s + self.sum_s.within
        lag_s, delay_s = (Interval(each.value, within_s) for each in (self.lag_s, self.delay_s))
        return replace(self, lag_s=lag_s, delay_s=delay_s, split_is_known=False)


def intervals(
    response: FittedResponse, segments: Sequence[Segment], axis: int, masks: Masks, span: int = 1
) -> AxisParameters:
    """Return the intervals of a fit on the same samples, from Newey and West's covariance, widened.

    Of rarely logged commands the dead time is in the middle between that of moving and that of held ones.
    """
    logs = response.logs
    slopes = [
        np.column_stack([_smooth(column, span) for column in each.T])
        for each in _slopes(response, logs, segments, axis, masks)
    ]
    errors = residuals(response, segments, axis, masks, span)
    covariance = newey_west(slopes, errors, round(CORRELATION_S / PERIOD_S))

    def half_width(weights: Sequence[float], widening: float) -> float:
        along = np.zeros(len(covariance))
        along[: len(weights)] = weights
        return NORMAL_95 * widening * math.sqrt(max(float(along @ covariance @ along), 0.0))

    lag, delay = response.lag_s, response.delay_s
    order = len(logs)
    unknown_s = max(segment.command[axis].unknown_s for segment in segments)
    surplus_s, known_s = SURPLUS_S + unknown_s, max(delay - unknown_s, SHORTEST_DELAY_S)
    surplus_gain = SURPLUS_RARE_GAIN * response.gain if unknown_s else 0.0
    return AxisParameters(
        gain=Interval(response.gain, half_width([0.0] * order + [1.0], WIDENING) + surplus_gain),
        sum_s=Interval(lag + known_s, half_width([lag, delay], WIDENING) + surplus_s),
        lag_s=Interval(lag, half_width([lag], WIDENING) + surplus_s),
        delay_s=Interval(known_s, half_width([0.0, delay], DEAD_TIME_WIDENING) + surplus_s),
        integral_1_s=Interval(response.integral_1_s, half_width([0.0, 0.0, response.integral_1_s], WIDENING))
        if order == 3
        else None,
    )


def newey_west(slopes: Sequence[FloatArray], errors: Sequence[FloatArray], window: int) -> FloatArray:
    """Return the covariance (p, p) of least-squares parameters whose residuals are correlated.

    `slopes` (m, p) and `errors` (m,) are those of each segment; correlations beyond `window` samples, and
    between segments, are taken as 0 (Newey and West 1987). A combination of parameters that the samples do
    not show gets the variance 1.
    """
    whole = np.concatenate(list(slopes))
    samples, parameters = whole.shape
    variance = max(root_mean_square(errors) ** 2, _LEAST_VARIANCE)
    meat = variance * variance * np.eye(parameters)
    for slope, error in zip(slopes, errors, strict=True):
        scores = slope * error[:, np.newaxis]
        meat += scores.T @ scores
        for lag in range(1, min(window, len(scores) - 1) + 1):
            cross = scores[lag:].T @ scores[:-lag]
            meat += (1.0 - lag / (window + 1.0)) * (cross + cross.T)
    bread = np.linalg.inv(whole.T @ whole + variance * np.eye(parameters))
    return np.asarray(bread @ meat @ bread * (samples / max(samples - parameters, 1)))


def _smooth(values: FloatArray, span: int) -> FloatArray:
    """Return the means of `span` samples of the means of `span` samples (m,), where there are so many."""
    for _ in range(2 if span > 1 else 0):
        sums = np.concatenate([[0.0], np.cumsum(values)])
        values = (sums[span:] - sums[:-span]) / span
    return values


def _unit_response(logs: FloatArray, segment: Segment, axis: int, zero: float) -> FloatArray:
    """Return G of the command (m,), which the beginning of the segment finds in steady state."""
    lag, delay, *rest = np.exp(logs).tolist()
    command = segment.command_means(axis, delay)
    if not rest:
        keep = float(np.exp(-PERIOD_S / lag))
        top, bottom = np.array([1.0 - keep]), np.array([1.0, -keep])
    else:
        (integral,) = rest
        top, bottom = _second_order_filter(lag, integral, zero)
    return segment.as_measured(axis, filter_command(top, bottom, command))


def filter_command(top: FloatArray, bottom: FloatArray, command: FloatArray) -> FloatArray:
    """Return the answer (m,) of the filter `top` / `bottom`, before the command (m,) in steady state.

    Solves bottom[0] y[k] + bottom[1] y[k - 1] + ... = top[0] x[k] + ..., a banded system, with LAPACK:
    `scipy.signal` takes a third of a second to import. `bottom` begins with 1 and is no shorter than `top`.
    """
    order, samples = len(bottom) - 1, len(command)
    rest = command[0] * (np.sum(top) / np.sum(bottom))
    inputs = np.concatenate([np.full(order, command[0]), command])
    driven = sum(value * inputs[order - k : order - k + samples] for k, value in enumerate(top))
    for k in range(1, order + 1):
        driven[:k] -= bottom[k] * rest
    band = np.repeat(bottom[:, np.newaxis], samples, axis=1)
    return np.asarray(dtbtrs(band, driven, uplo="L", diag="U")[0])


def _second_order_filter(lag_s: float, integral_1_s: float, zero: float) -> tuple[FloatArray, FloatArray]:
    """Return numerator (2,) and denominator (3,) of (zero s + k) / (lag s^2 + s + k) for period means.

    The exponential of a 2 x 2 matrix with trace 2 m and the eigenvalues m +- q is
    e^m (cosh q + sinh q / q (A - m)).
    """
    system = PERIOD_S * np.array([[0.0, 1.0], [-integral_1_s / lag_s, -1.0 / lag_s]])
    middle = -0.5 * PERIOD_S / lag_s
    q = cmath.sqrt(middle * middle - PERIOD_S * PERIOD_S * integral_1_s / lag_s)
    ratio = (cmath.sinh(q) / q).real if abs(q) > 1e-9 else 1.0
    step = math.exp(middle) * (cmath.cosh(q).real * np.eye(2) + ratio * (system - middle * np.eye(2)))
    drive = np.linalg.solve(system, step - np.eye(2)) @ [0.0, PERIOD_S]
    read = np.array([integral_1_s, zero]) / lag_s
    trace = step[0, 0] + step[1, 1]
    top = np.array([read @ drive, read @ (step - trace * np.eye(2)) @ drive])
    return top, np.array([1.0, -trace, math.exp(2.0 * middle)])


def _project(
    logs: FloatArray, segments: Sequence[Segment], axis: int, masks: Masks, *, zero: float, span: int
) -> tuple[float, list[tuple[FloatArray, FloatArray, float, float]]]:
    """Return the best gain, and of each segment unit response and tilt without their means, and the means."""
    parts = []
    for segment, mask in zip(segments, masks, strict=True):
        whole = _unit_response(logs, segment, axis, zero), segment.tilt_rad[axis]
        unit, tilt = (_smooth(each[mask], span) for each in whole)
        unit_mean, tilt_mean = (float(each.mean()) for each in (unit, tilt))
        parts.append((unit - unit_mean, tilt - tilt_mean, unit_mean, tilt_mean))
    power = sum(float(unit @ unit) for unit, _, _, _ in parts)
    gain = sum(float(unit @ tilt) for unit, tilt, _, _ in parts) / max(power, 1e-300)
    return gain, parts


def _slopes(
    response: FittedResponse, logs: FloatArray, segments: Sequence[Segment], axis: int, masks: Masks
) -> list[FloatArray]:
    """Return the derivatives (m, p) of the modelled tilt of each segment: logarithms, gain, each offset."""
    found = []
    for number, (segment, mask) in enumerate(zip(segments, masks, strict=True)):
        columns = []
        for index in range(len(logs)):
            step = np.zeros(len(logs))
            step[index] = 10.0 * _STEP
            above, below = (
                _unit_response(logs + sign * step, segment, axis, response.zero) for sign in (1.0, -1.0)
            )
            columns.append(response.gain * (above - below)[mask] / (20.0 * _STEP))
        columns.append(_unit_response(logs, segment, axis, response.zero)[mask])
        offsets = np.zeros((int(mask.sum()), len(segments)))
        offsets[:, number] = 1.0
        found.append(np.column_stack([*columns, offsets]))
    return found
