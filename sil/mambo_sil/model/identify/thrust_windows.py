"""The windows of a log in which its thrust is fitted: what drives the height, without what changes slowly."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.model.identify.response import filter_command
from mambo_sil.model.identify.segments import PERIOD_S, Segment

WINDOW_S: Final = 1.2
SIZE: Final = round(WINDOW_S / PERIOD_S)
_STRIDE: Final = SIZE // 2
"""Samples of a window, and from one to the next: they overlap, so that none misses a step of the height."""
_TIME_S: Final = PERIOD_S * np.arange(SIZE)
_CURVES: Final = np.linalg.qr(np.vander(_TIME_S, 3, increasing=True))[0]
"""Constant, line and parabola (m, 3), orthonormal."""
_CURVATURE: Final = _CURVES[:, 2] / (_CURVES[:, 2] @ (0.5 * _TIME_S * _TIME_S))
"""Weights (m,) that give the second derivative of a parabola."""


@dataclass(frozen=True, eq=False)
class Windows:
    """The windows (n, m) of one stretch; rates and heights are without constants, lines and parabolas."""

    rates: FloatArray
    """Double integral of the command, and integral of the height, negative (2, n, m)."""
    height_m: FloatArray
    command: FloatArray
    rate_curvatures: FloatArray
    """(2, n)."""
    height_curvature: FloatArray
    """(n,)."""
    middle_s: FloatArray
    """Middle of each window (n,), from the beginning of the log on."""


def cut_windows(segments: Sequence[Segment], logs: FloatArray) -> list[Windows]:
    """Return the windows of all stretches, with the command behind a lag and a dead time."""
    lag_s, delay_s = np.exp(logs).tolist()
    return [_cut(each, _vertical(each, lag_s, delay_s)) for each in segments]


def _vertical(segment: Segment, lag_s: float, delay_s: float) -> FloatArray:
    """Return the command (k,) of a stretch behind a lag and a dead time, times its vertical share."""
    assert segment.thrust is not None
    keep = np.exp(-PERIOD_S / lag_s)
    late = segment.thrust.means(segment.time_s - delay_s)
    lagged = filter_command(np.array([1.0 - keep]), np.array([1.0, -keep]), late)
    return np.asarray(lagged * np.cos(segment.tilt_rad[0]) * np.cos(segment.tilt_rad[1]))


def _cut(segment: Segment, command: FloatArray) -> Windows:
    """Return the windows of a stretch with a vertical command (k,).

    Integrals from the beginning of the stretch on differ from a window's by a line, which is removed.
    """
    assert segment.height_m is not None
    height_m = segment.height_m - segment.height_m[0]
    starts = np.arange(int(np.argmax(segment.counted)), len(command) - SIZE + 1, _STRIDE)
    whole = np.stack([_integral(_integral(command)), -_integral(height_m), height_m, command])
    pieces = whole[:, starts[:, np.newaxis] + np.arange(SIZE)]
    left = pieces - (pieces @ _CURVES) @ _CURVES.T
    curvatures = pieces @ _CURVATURE
    middle_s = segment.time_s[starts] + 0.5 * WINDOW_S - segment.begun_s
    return Windows(left[:2], left[2], pieces[3], curvatures[:2], curvatures[2], middle_s)


def _integral(values: FloatArray) -> FloatArray:
    """Return the integral (k,) of samples (k,), which change evenly in between."""
    return PERIOD_S * np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))])
