"""The motion that follows from tilt: acceleration per tilt, drag, trim; and what they leave unexplained.

Increments of velocity over half a second are regressed on integrals over the same time:

    change of v = share * (integral(T tilt) - lag * change of (T tilt)) - drag * integral(v)
                  + constants, turned by yaw

T tilt is the horizontal part of the thrust over mass T; where T is not logged, its vertical part is taken as
g. The lag is that of the logged velocity, which a filter makes late: without it the drag would be too small.
The constants, in axes ahead and right, are the trim.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.model.identify.response import NORMAL_95, SURPLUS_S, WIDENING, Interval, newey_west
from mambo_sil.model.identify.segments import PERIOD_S, Segment

SPAN_S: Final = 0.5
_LEAST_POWER: Final = 1e-6
"""Mean square of the velocity increments, in m^2/s^2, below which the drone does not move."""
_STRIDE: Final = 5
_CORRELATION: Final = 80
"""Strides over which what is left is taken as correlated: 4 s, because gusts last for seconds."""
_LAG_COLUMN: Final = 4
"""Column of the regression for the lag of the velocity. A comparison of hypotheses leaves it out, because it
would hide that tilt and velocity are of two clocks."""


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
    velocity_lag_s: Interval
    """Lag of the logged velocity behind the measured tilt."""
    r2: float
    disturbance_m_s2: float
    """Rms of the acceleration, averaged over `SPAN_S`, that the model does not explain."""


def explained(segments: Sequence[Segment], hypothesis: Hypothesis = AS_LOGGED) -> float:
    """Return the R2 of the velocity increments under a hypothesis, with a share of g of 0 or more."""
    slopes, changes = _stack(segments, hypothesis)
    free, *others = slopes.T[:_LAG_COLUMN]
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

    A controller tilts against gusts, which biases the share of g by up to about what the fit leaves
    unexplained; its interval is widened by that.
    """
    parts = [_regression(each, AS_LOGGED) for each in segments if each.velocity_m_s is not None]
    slopes, changes = _stack(segments, AS_LOGGED)
    found = np.linalg.lstsq(slopes, changes, rcond=None)[0]
    errors = [change - slope @ found for slope, change in parts]
    covariance = newey_west([slope for slope, _ in parts], errors, _CORRELATION)
    within = (NORMAL_95 * WIDENING * np.sqrt(np.maximum(np.diag(covariance), 0.0))).tolist()
    share, drag, ahead, right, late = found.tolist()
    weight = GRAVITY_M_S2 * share
    error = np.concatenate(errors)
    left = float(np.sum(error**2) / np.sum((changes - changes.mean()) ** 2))
    return Motion(
        Interval(share, within[0] + left * abs(share)),
        Interval(drag, within[1]),
        (
            Interval(-right / weight, abs(within[3] / weight)),
            Interval(ahead / weight, abs(within[2] / weight)),
        ),
        Interval(-late / share, abs(within[4] / share) + SURPLUS_S),
        1.0 - left,
        float(np.sqrt(np.mean(error**2))) / SPAN_S,
    )


def heading_range_rad(segments: Sequence[Segment]) -> float:
    """Return the range of yaw over all stretches."""
    yaw = np.concatenate([segment.yaw_rad for segment in segments])
    return float(np.ptp(yaw))


def _stack(segments: Sequence[Segment], hypothesis: Hypothesis) -> tuple[FloatArray, FloatArray]:
    parts = [_regression(each, hypothesis) for each in segments if each.velocity_m_s is not None]
    if not parts:
        raise ValueError("no stretch has velocities")
    slopes, changes = (np.concatenate(each) for each in zip(*parts, strict=True))
    return slopes, changes


def _regression(segment: Segment, hypothesis: Hypothesis) -> tuple[FloatArray, FloatArray]:
    """Return slopes (2 m, 5) and changes of velocity (2 m,) of one stretch: x, then y."""
    velocity = segment.velocity_m_s
    if velocity is None:
        raise ValueError("the stretch has no velocities")
    roll, pitch = (
        np.interp(segment.time_s + hypothesis.late_s, segment.time_s, tilt) for tilt in segment.tilt_rad
    )
    if hypothesis.swapped:
        roll, pitch = pitch, roll
    roll, pitch = hypothesis.roll * roll, hypothesis.pitch * pitch
    thrust = segment.thrust_m_s2
    if thrust is None:
        thrust = GRAVITY_M_S2 / (np.cos(roll) * np.cos(pitch))
    ahead, right = -thrust * np.cos(roll) * np.sin(pitch), thrust * np.sin(roll)
    cosine, sine = np.cos(hypothesis.yaw * segment.yaw_rad), np.sin(hypothesis.yaw * segment.yaw_rad)
    pull = np.stack([cosine * ahead - sine * right, sine * ahead + cosine * right])
    rates = (
        pull,
        -velocity,
        np.stack([cosine, sine]),
        np.stack([-sine, cosine]),
    )
    span = round(SPAN_S / PERIOD_S)
    integrals = [
        np.pad(np.cumsum(0.5 * (r[:, 1:] + r[:, :-1]), axis=1) * PERIOD_S, ((0, 0), (1, 0))) for r in rates
    ]
    *slopes, changes = (
        (each[:, span:] - each[:, :-span])[:, ::_STRIDE].ravel() for each in (*integrals, pull, velocity)
    )
    return np.stack(slopes, axis=1), changes
