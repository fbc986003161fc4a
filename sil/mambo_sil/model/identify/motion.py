"""The motion that follows from tilt: acceleration per tilt, drag, trim; and what they leave unexplained.

The logged velocity v is the true one behind a filter F, which is linear, so that v obeys

    v' = share * F(T tilt) - drag * v - share * (change of T tilt by the trim)

T tilt is the horizontal part of the thrust over mass T; where T is not logged, its vertical part is taken as
g. F is a first-order lag and a delay, which may be negative: together they have the delay and the spread of
any low-pass, also of a central difference. Without F, and with its delay alone, the drag would be too small.

Where the heading turned, a constant push in x and y stands beside them, that of a steady wind: a trim, which
turns with the drone, can be told from it.

Both sides are integrated over half a second and then averaged over another, which removes most of the noise
of velocities that are differentiated positions: it has hardly any low frequencies. Share, drag, trim and push
are solved linearly inside the search for lag and delay of F.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import least_squares

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.model.identify.response import (
    NORMAL_95,
    SURPLUS_S,
    WIDENING,
    Interval,
    filter_command,
    newey_west,
)
from mambo_sil.model.identify.segments import PERIOD_S, Segment

SPAN_S: Final = 0.5
"""Time over which both sides are integrated, and then averaged."""
EDGE_S: Final = 0.5
"""Beginning and end of a stretch that the fit leaves out: the filter does not know what is beyond."""
TURNED_RAD: Final = math.radians(20.0)
"""Range of the heading below which its sense does not show."""
STANDING: Final = 0.7
"""Length of the mean unit vector of the heading, 1 of one that stands, beyond which wind looks like a trim.

Of a heading that swings evenly by 90 degrees to both sides it is 0.64, of whole turns 0.
"""
DRAUGHT_M_S: Final = 0.5
"""Steady wind that the interval of a trim allows for where the heading did not turn."""
ATTITUDE_RAD: Final = 0.005
"""Constant error of the measured attitude that it always allows for."""
_LEAST_POWER: Final = 1e-6
"""Mean square of the velocity increments, in m^2/s^2, below which the drone does not move."""
_STRIDE: Final = 5
_CORRELATION: Final = 80
"""Strides over which what is left is taken as correlated: 4 s, because gusts last for seconds."""
_START: Final = np.array([0.03, np.log(0.03)])
_LOW: Final = np.array([-0.1, np.log(0.001)])
_HIGH: Final = np.array([0.3, np.log(0.3)])
_SCALE: Final = np.array([0.01, 0.3])
"""Lag and delay of the velocity together, and logarithm of the lag: start, bounds and scale of the search."""
_STEP: Final = 1e-2
"""Step of derivatives by the two, over their scale."""


@dataclass(frozen=True)
class Hypothesis:
    """A way to read tilt and yaw: whether roll and pitch are swapped, and the factors on them."""

    swapped: bool = False
    roll: float = 1.0
    pitch: float = 1.0
    yaw: float = 1.0
    late_s: float = 0.0
    """How much later than the velocity the tilt is logged."""


AS_LOGGED: Final = Hypothesis()


@dataclass(frozen=True)
class Motion:
    """Parameters of the motion; pairs are roll, pitch."""

    acceleration_per_tilt: Interval
    """Acceleration over g per radian of measured tilt."""
    drag_1_s: Interval
    trim_rad: tuple[Interval, Interval]
    """Measured tilt at which the drone does not accelerate."""
    trim_is_known: bool
    """Whether the heading turned enough to tell a trim from a steady wind."""
    velocity_lag_s: Interval
    """Lag and delay together of the logged velocity behind the measured tilt."""
    r2: float
    disturbance_m_s2: float
    """Rms of the acceleration that the model does not explain, averaged over `SPAN_S` twice."""


def explained(segments: Sequence[Segment], hypothesis: Hypothesis = AS_LOGGED) -> float:
    """Return the R2 of the velocity increments under a hypothesis, with a share of g of 0 or more.

    The velocity is taken as it is: its filter would hide that tilt and velocity are of two clocks.
    """
    slopes, changes = _stack([_increments(each, _rates(each, hypothesis)) for each in _moved(segments)])
    free, *others = slopes.T
    rest = np.column_stack([*others])
    change = changes - rest @ np.linalg.lstsq(rest, changes, rcond=None)[0]
    tilt = free - rest @ np.linalg.lstsq(rest, free, rcond=None)[0]
    power = float(change @ change)
    if power < _LEAST_POWER * len(change):
        return 0.0
    share = max(float(tilt @ change) / max(float(tilt @ tilt), 1e-300), 0.0)
    return 1.0 - float(np.sum((change - share * tilt) ** 2)) / power


def fit_motion(segments: Sequence[Segment]) -> Motion:
    """Fit the parameters on all stretches that have velocities; raises ValueError if there is none.

    A controller tilts against gusts and an estimator's errors, which biases the share of g and the drag by up
    to about what the fit leaves unexplained, times the inflation of their variances: with much drag the
    velocity follows the tilt, and the two hardly differ. Their intervals are widened by that. At a constant
    heading a steady wind looks like a trim, and an attitude that is measured wrong always does.
    """
    turned = has_turned(_moved(segments))
    moved = [(each, _rates(each, AS_LOGGED, push=turned)) for each in _moved(segments)]

    def regression(late: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        lag_s = float(np.exp(late[1]))
        return [_means(each, rates, lag_s, float(late[0]) - lag_s) for each, rates in moved]

    def residual(late: FloatArray) -> FloatArray:
        slopes, changes = _stack(regression(late))
        return np.asarray(changes - slopes @ np.linalg.lstsq(slopes, changes, rcond=None)[0])

    late = least_squares(residual, _START, bounds=(_LOW, _HIGH), x_scale=_SCALE, diff_step=1e-3).x
    parts = regression(late)
    slopes, changes = _stack(parts)
    found = np.linalg.lstsq(slopes, changes, rcond=None)[0]
    errors = [change - slope @ found for slope, change in parts]
    by_late = []
    for index in range(len(late)):
        step = np.zeros_like(late)
        step[index] = _STEP * _SCALE[index]
        pairs = zip(regression(late + step), regression(late - step), strict=True)
        by_late.append([(above - below) @ found / (2.0 * step[index]) for (above, _), (below, _) in pairs])
    every = [np.column_stack([slope, *columns]) for (slope, _), *columns in zip(parts, *by_late, strict=True)]
    covariance = newey_west(every, errors, _CORRELATION)
    within = (NORMAL_95 * WIDENING * np.sqrt(np.maximum(np.diag(covariance), 0.0))).tolist()
    share, drag, *trims = found[:4].tolist()
    error = np.concatenate(errors)
    left = float(np.sum(error**2) / np.sum((changes - changes.mean()) ** 2))
    biased = left * _inflation(slopes)
    surplus_rad = ATTITUDE_RAD
    if not turned:
        surplus_rad += abs(drag) * DRAUGHT_M_S / (abs(share) * GRAVITY_M_S2)
    return Motion(
        Interval(share, within[0] + biased * abs(share)),
        Interval(drag, within[1] + biased * abs(drag)),
        (
            Interval(trims[0] / share, abs(within[2] / share) + surplus_rad),
            Interval(trims[1] / share, abs(within[3] / share) + surplus_rad),
        ),
        turned,
        Interval(float(late[0]), within[slopes.shape[1]] + SURPLUS_S),
        1.0 - left,
        float(np.sqrt(np.mean(error**2))) / SPAN_S,
    )


def _inflation(slopes: FloatArray) -> float:
    """Return 1 / (1 - rho^2), rho the correlation of what tilt and drag do beside the others (k, 4 or 6)."""
    tilt, drag = (
        slopes[:, :2] - slopes[:, 2:] @ np.linalg.lstsq(slopes[:, 2:], slopes[:, :2], rcond=None)[0]
    ).T
    common = float(tilt @ drag) ** 2 / max(float(tilt @ tilt) * float(drag @ drag), 1e-300)
    return 1.0 / max(1.0 - common, 1e-3)


def heading_range_rad(segments: Sequence[Segment]) -> float:
    """Return the range of yaw over all stretches."""
    yaw = np.concatenate([segment.yaw_rad for segment in segments])
    return float(np.ptp(yaw))


def has_turned(segments: Sequence[Segment]) -> bool:
    """Return whether the heading turned enough in all stretches to tell a trim from a steady wind."""
    yaw_rad = np.concatenate([segment.yaw_rad for segment in segments])
    return bool(np.hypot(np.cos(yaw_rad).mean(), np.sin(yaw_rad).mean()) <= STANDING)


def _moved(segments: Sequence[Segment]) -> list[Segment]:
    """Return the stretches that have velocities."""
    found = [each for each in segments if each.velocity_m_s is not None]
    if not found:
        raise ValueError("no stretch has velocities")
    return found


def _stack(parts: Sequence[tuple[FloatArray, FloatArray]]) -> tuple[FloatArray, FloatArray]:
    """Return the slopes and changes of all stretches."""
    slopes, changes = (np.concatenate(each) for each in zip(*parts, strict=True))
    return slopes, changes


def _rates(segment: Segment, hypothesis: Hypothesis, *, push: bool = False) -> FloatArray:
    """Return the acceleration (4, 2, m), x and y, by tilt, by drag of 1 1/s, and by trims of 1 rad.

    With a push (6, 2, m), also by a push of g in x and in y.
    """
    roll, pitch = (
        np.interp(segment.time_s + hypothesis.late_s, segment.time_s, tilt) for tilt in segment.tilt_rad
    )
    if hypothesis.swapped:
        roll, pitch = pitch, roll
    roll, pitch = hypothesis.roll * roll, hypothesis.pitch * pitch
    thrust = segment.thrust_m_s2
    if thrust is None:
        thrust = GRAVITY_M_S2 / (np.cos(roll) * np.cos(pitch))
    sines, cosines = np.sin([roll, pitch]), np.cos([roll, pitch])
    ahead = thrust * np.stack([-cosines[0] * sines[1], -sines[0] * sines[1], cosines[0] * cosines[1]])
    right = thrust * np.stack([sines[0], -cosines[0], np.zeros_like(roll)])
    cosine, sine = np.cos(hypothesis.yaw * segment.yaw_rad), np.sin(hypothesis.yaw * segment.yaw_rad)
    pull, by_roll, by_pitch = np.stack([cosine * ahead - sine * right, sine * ahead + cosine * right], axis=1)
    pushes = [GRAVITY_M_S2 * np.outer(axis, np.ones_like(roll)) for axis in np.eye(2)] if push else []
    return np.stack([pull, -_velocity(segment), by_roll, by_pitch, *pushes])


def _velocity(segment: Segment) -> FloatArray:
    if segment.velocity_m_s is None:
        raise ValueError("the stretch has no velocities")
    return segment.velocity_m_s


def _increments(segment: Segment, rates: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return slopes (2 m, n) and changes of velocity (2 m,) of one stretch over `SPAN_S`: x, then y."""
    return _spans(np.concatenate([_integral(rates), _velocity(segment)[np.newaxis]]))


def _means(
    segment: Segment, rates: FloatArray, lag_s: float, delay_s: float
) -> tuple[FloatArray, FloatArray]:
    """Return the same of means over `SPAN_S`, behind a filter of the velocity."""
    keep = float(np.exp(-PERIOD_S / lag_s))
    mean = lag_s / PERIOD_S * (1.0 - keep)
    top, bottom = np.array([1.0 - mean, mean - keep]), np.array([1.0, -keep])
    pull = np.stack([filter_command(top, bottom, each) for each in rates[0]])
    late = np.stack([_late_integral(each, delay_s) for each in pull])
    whole = np.concatenate([late[np.newaxis], _integral(rates[1:]), _velocity(segment)[np.newaxis]])
    edge, count = round(EDGE_S / PERIOD_S), round(SPAN_S / PERIOD_S)
    sums = np.cumsum(whole[..., edge : whole.shape[-1] - edge], axis=-1)
    return _spans((sums[..., count:] - sums[..., :-count]) / count)


def _spans(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the changes over `SPAN_S` of what is integrated (n, 2, m), as slopes, and of the velocity."""
    span = round(SPAN_S / PERIOD_S)
    *slopes, changes = (values[..., span:] - values[..., :-span])[..., ::_STRIDE].reshape(len(values), -1)
    return np.stack(slopes, axis=1), changes


def _integral(rates: FloatArray) -> FloatArray:
    """Return the integrals (..., m) of samples (..., m), which change evenly in between."""
    areas = 0.5 * (rates[..., 1:] + rates[..., :-1]) * PERIOD_S
    return np.concatenate([np.zeros_like(areas[..., :1]), np.cumsum(areas, axis=-1)], axis=-1)


def _late_integral(rate: FloatArray, delay_s: float) -> FloatArray:
    """Return the integral (m,) of samples (m,) that are delayed; it stops at the ends."""
    place = np.clip(np.arange(len(rate)) - delay_s / PERIOD_S, 0.0, len(rate) - 1.0)
    whole = np.minimum(place.astype(np.int64), len(rate) - 2)
    part = place - whole
    rise = rate[whole + 1] - rate[whole]
    return np.asarray(_integral(rate)[whole] + PERIOD_S * part * (rate[whole] + 0.5 * part * rise))
