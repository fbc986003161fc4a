"""Curves of the user's own: a CSV file, a class in a file, or an object of a program."""

import hashlib
from pathlib import Path
from typing import Any, Final

import numpy as np

from mambo_codegen.errors import echo
from mambo_sil.arguments import as_numbers
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import ArgumentError, TrajectoryError
from mambo_sil.flight.own_file import load_object
from mambo_sil.flight.polynomials import read_course
from mambo_sil.flight.trajectories import CURVES, Trajectory, is_trajectory, vertical_of

_SAMPLES: Final = 400
_NEXT_S: Final = 0.01
_OFF_S: Final = 0.0037
"""Of the first sample, so that none lies where curves jump: at whole milliseconds."""
_STEP_S: Final = 1e-4
_SHARE, _LEAST_M_S = 0.1, 0.01
"""Disagreement that rounding and tables of a curve may have, of its largest speed and at rest."""


def is_curve_file(named: str) -> bool:
    """Return whether a curve is named by its file."""
    return ".py:" in named or named.lower().endswith(".csv")


def load_curve(named: str) -> tuple[Trajectory, str]:
    """Return the curve of a file, and the SHA-256 of the file and of the modules beside it that it imports.

    Raises TrajectoryError, and FlightError as `load_object`.
    """
    if ".py:" not in named:
        path = Path(named)
        return read_course(path), hashlib.sha256(path.read_bytes()).hexdigest()
    curve, sha256 = load_object(named)
    if not is_trajectory(curve):
        name = echo(named.rpartition(":")[2])
        raise TrajectoryError(f"{echo(named)}: {name} has no methods target(time_s) and acceleration(time_s)")
    return curve, sha256


def curve_named(name: str, size_m: float, rate_rad_s: float) -> Trajectory:
    """Return a curve by name, with its size and angular rate, or that of a file; raises as `load_curve`."""
    shipped = next((curve for known, curve in CURVES.items() if known == name), None)
    return load_curve(name)[0] if shipped is None else shipped(size_m, rate_rad_s)


def check_curve(name: str, curve: Trajectory, duration_s: float) -> None:
    """Raise TrajectoryError unless a curve is finite, and its velocity the derivative of its position.

    Two samples in a row must disagree: a curve may jump. Messages begin with `name`.
    """
    try:
        _check_derivative(curve, duration_s)
    except (TrajectoryError, ArgumentError) as error:
        raise TrajectoryError(f"{name}: {error}") from error


def _check_derivative(curve: Trajectory, duration_s: float) -> None:
    first_s = _OFF_S + np.linspace(0.0, max(duration_s - 2.0 * _NEXT_S, 0.0), _SAMPLES)
    times_s = first_s[:, np.newaxis] + np.array([0.0, _NEXT_S])
    moved = _motion(curve, times_s + _STEP_S)[0] - _motion(curve, times_s - _STEP_S)[0]
    slope_m_s, velocity_m_s = moved / (2.0 * _STEP_S), _motion(curve, times_s)[1]
    off_m_s = np.abs(velocity_m_s - slope_m_s).min(axis=1)
    largest_m_s = max(np.abs(velocity_m_s).max(), np.abs(slope_m_s).max())
    worst = np.unravel_index(off_m_s.argmax(), off_m_s.shape)
    if off_m_s[worst] > _SHARE * largest_m_s + _LEAST_M_S:
        sample, *_, axis = (int(one) for one in worst)
        place = (sample, 0, *worst[1:])
        raise TrajectoryError(
            f"at {times_s[sample, 0]:.2f} s its velocity along {('x', 'y', 'the height')[axis]} is "
            f"{velocity_m_s[place] + 0.0:.3g} m/s, but its position changes by {slope_m_s[place]:.3g} m/s: "
            "give the derivative of the position"
        )


def _motion(curve: Trajectory, times_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return position and velocity x, y, height at times (k, 2), each (k, 2, 3) or (k, 2, n, 3).

    Raises TrajectoryError for a curve that raises, or is not finite.
    """
    clock_s = times_s.ravel()
    try:
        target = _of_shape("target", curve.target(clock_s), len(clock_s), 4)
        acceleration = _of_shape("acceleration", curve.acceleration(clock_s), len(clock_s), 2)
        vertical = _of_shape("vertical", vertical_of(curve, clock_s), len(clock_s), 3)
    except (TrajectoryError, ArgumentError):
        raise
    except Exception as error:
        raise TrajectoryError(f"{type(error).__name__}: {echo(str(error))}") from error
    for part in (target, acceleration, vertical):
        bad = ~np.isfinite(part.reshape(len(clock_s), -1)).all(axis=1)
        if bad.any():
            raise TrajectoryError(f"is not finite at {clock_s[bad][0]:.2f} s")
    vertical = np.broadcast_to(
        vertical if vertical.ndim == target.ndim else vertical[:, np.newaxis], (*target.shape[:-1], 3)
    )
    parts = ((target[..., :2], vertical[..., :1]), (target[..., 2:], vertical[..., 1:2]))
    position_m, velocity_m_s = (
        np.concatenate(both, axis=-1).reshape(*times_s.shape, *target.shape[1:-1], 3) for both in parts
    )
    return position_m, velocity_m_s


def _of_shape(method: str, values: Any, times: int, columns: int) -> FloatArray:
    """Return what a method gives for k times, (k, columns) or (k, n, columns); raises TrajectoryError."""
    found = as_numbers(f"trajectory.{method}()", values)
    if found.ndim not in (2, 3) or (len(found), found.shape[-1]) != (times, columns):
        raise TrajectoryError(
            f"{method}() has shape {found.shape} for {times} times; it must be ({times}, {columns}), or "
            f"({times}, n, {columns}) for n flights"
        )
    return found
