"""Tracking metrics of a trace.

e(t) is the Euclidean norm of the horizontal position error, h(t) the error of the height, u(t) the command,
t the time on the trajectory's clock; the take-off is left out. Integrals of e and h use the trapezoidal rule
over the samples of the trace. Integrals of u are exact, because commands are held between samples.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.elementary import hypotenuse
from mambo_sil.flight.traces import Trace

TRANSIENT_S = 10.0
"""Length of the initial transient that metrics may leave out."""


@dataclass(frozen=True, eq=False)
class Metrics:
    """Metrics of n flights, each field (n,); NaN for a flight that was lost."""

    iae_m_s: FloatArray
    """Integral of e: IAE of Table II."""
    ise_m2_s: FloatArray
    """Integral of e^2: ISE of Table II."""
    itse_m2_s2: FloatArray
    """Integral of t e^2: ITSE of Table II."""
    itae_m_s2: FloatArray
    """Integral of t e: ITAE of Table II."""
    rms_error_m: FloatArray
    """Root of the mean of e^2 over time."""
    max_error_m: FloatArray
    final_error_m: FloatArray
    """e at the end of the flight."""
    effort_rad_s: FloatArray
    """Integral of the 1-norm of u."""
    command_variation_rad: FloatArray
    """Mean 1-norm of the change of u from one update of the controller to the next."""
    rms_height_error_m: FloatArray
    """Root of the mean of h^2 over time."""
    max_height_error_m: FloatArray
    """Largest magnitude of h."""
    rms_error_3d_m: FloatArray
    """Root of the mean of e^2 + h^2 over time."""
    max_error_3d_m: FloatArray
    """Largest distance to the target in space."""

    @property
    def table2(self) -> FloatArray:
        """The indices of Table II (4, n): IAE, ISE, ITSE, ITAE."""
        return np.array([self.iae_m_s, self.ise_m2_s, self.itse_m2_s2, self.itae_m_s2])


HEIGHT_METRICS: Final = ("rms_height_error_m", "max_height_error_m", "rms_error_3d_m", "max_error_3d_m")
"""Metrics that a flight on a level course does not show."""


def height_error_m(trace: Trace) -> FloatArray:
    """Return h (k, n), the height of the drone less its target's in m."""
    return -trace.position_m[..., 2] - trace.target_height_m


def horizontal_error_m(trace: Trace) -> FloatArray:
    """Return e (k, n), the horizontal distance to the target in m."""
    offset_m = trace.target[..., :2] - trace.position_m[..., :2]
    return hypotenuse(offset_m[..., 0], offset_m[..., 1])


def horizontal_speed_m_s(trace: Trace) -> FloatArray:
    """Return the horizontal speed of the drone (k, n) in m/s."""
    return hypotenuse(trace.velocity_m_s[..., 0], trace.velocity_m_s[..., 1])


def saturated_share(command_rad: FloatArray, limit_rad: float) -> FloatArray:
    """Return the share (n,) of the commands (k, n, 2) with roll or pitch at the limit."""
    return np.asarray(np.mean((np.abs(command_rad) >= limit_rad).any(axis=-1), axis=0))


def measure(trace: Trace, start_s: float = 0.0) -> Metrics:
    """Return the metrics from `start_s` to the end: 0 for the whole flight, or `TRANSIENT_S`.

    Raises `ValueError` if fewer than two samples are left.
    """
    measured = trace.time_s >= start_s
    time_s = trace.time_s[measured]
    if len(time_s) < 2:
        raise ValueError(f"start_s = {start_s:g} must lie before the end {trace.time_s[-1]:g} of the flight")
    command_rad = trace.command_rad[measured]
    error_m = horizontal_error_m(trace)[measured]
    weight_s = time_s[:, np.newaxis]
    span_s = time_s[-1] - time_s[0]
    squared_m2 = error_m * error_m
    height_m = height_error_m(trace)[measured]
    height_m2 = height_m * height_m
    whole_m2 = squared_m2 + height_m2
    ise_m2_s = _integral(squared_m2, time_s)
    effort_rad = np.abs(command_rad[:-1]).sum(axis=-1)
    return Metrics(
        iae_m_s=_integral(error_m, time_s),
        ise_m2_s=ise_m2_s,
        itse_m2_s2=_integral(weight_s * squared_m2, time_s),
        itae_m_s2=_integral(weight_s * error_m, time_s),
        rms_error_m=np.sqrt(ise_m2_s / span_s),
        max_error_m=error_m.max(axis=0),
        final_error_m=error_m[-1],
        effort_rad_s=_sum(np.diff(time_s)[:, np.newaxis] * effort_rad),
        command_variation_rad=_sum(np.abs(np.diff(command_rad, axis=0)).sum(axis=-1)) / (len(time_s) - 1),
        rms_height_error_m=np.sqrt(_integral(height_m2, time_s) / span_s),
        max_height_error_m=np.abs(height_m).max(axis=0),
        rms_error_3d_m=np.sqrt(_integral(whole_m2, time_s) / span_s),
        max_error_3d_m=np.sqrt(whole_m2.max(axis=0)),
    )


def _integral(values: FloatArray, time_s: FloatArray) -> FloatArray:
    """Return the trapezoidal integrals (n,) of values (k, n)."""
    steps_s = np.diff(time_s)[:, np.newaxis]
    return _sum(steps_s * (values[1:] + values[:-1]) / 2.0)


def _sum(values: FloatArray) -> FloatArray:
    """Return the sums (n,) of values (k, n) in the order of time; the order of NumPy's `sum` varies."""
    return np.asarray(np.add.accumulate(values, axis=0)[-1])
