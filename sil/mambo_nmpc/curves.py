"""Curves to fly, and their velocity and acceleration, in the frame of any simulator.

    curve = Circle(radius_m=1.0, angular_rate_rad_s=1.5)
    now = sample(curve, time_s, "NWU", height_m=1.0)
    target = TargetState.in_frame("NWU", *now)

A curve is any object with the methods `target(time_s)`, [x, y, vx, vy] of shape (..., 4), and
`acceleration(time_s)`, (..., 2), north and east; one with `vertical(time_s)`, [height, climb, acceleration]
of shape (..., 3), up positive, has a height.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mambo_sil.arguments import as_numbers, require, require_choice, require_number
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.frames import FrameName, vectors_to_ned
from mambo_sil.flight.names import CURVE_NAMES, CurveName
from mambo_sil.flight.polynomials import Piece, Pieces, PiecesInSpace
from mambo_sil.flight.trajectories import (
    CURVES,
    Bernoulli,
    Circle,
    Gerono,
    Hover,
    InSpace,
    Lissajous,
    PositionStep,
    Trajectory,
    Waypoints,
    is_spatial,
    is_trajectory,
    vertical_of,
)

__all__ = [
    "Bernoulli",
    "Circle",
    "CurvePoint",
    "Gerono",
    "Hover",
    "InSpace",
    "Lissajous",
    "Piece",
    "Pieces",
    "PiecesInSpace",
    "PositionStep",
    "Trajectory",
    "Waypoints",
    "curve",
    "sample",
]


class CurvePoint(NamedTuple):
    """Points of a curve at times (...), each (..., 3), along the axes of a frame."""

    position_m: FloatArray
    velocity_m_s: FloatArray
    acceleration_m_s2: FloatArray


def curve(name: CurveName, size_m: float = 2.0, rate_rad_s: float = 0.5) -> Trajectory:
    """Return a curve of the command `fly`: half-width, radius, step or height, and angular rate.

    Raises ArgumentError for another name, and for numbers that are NaN or out of range.
    """
    require_choice("name", name, CURVE_NAMES)
    require_number("size_m", size_m, -1000.0, 1000.0)
    require_number("rate_rad_s", rate_rad_s, -100.0, 100.0)
    return CURVES[name](size_m, rate_rad_s)


def sample(
    trajectory: Trajectory, time_s: ArrayLike, frame: FrameName = "NED", *, height_m: float = 1.0
) -> CurvePoint:
    """Return where a curve is at times (...), with velocity and acceleration, in a frame by name.

    height_m: height of a curve that has none. x of the curve points north, or ahead with "NWU".
    Raises ArgumentError for what is no curve, for another frame, for times that are no finite numbers, and
    for a curve that is not finite at one of them.
    """
    require(is_trajectory(trajectory), "trajectory", trajectory, "have the methods target and acceleration")
    times_s = as_numbers("time_s", time_s)
    require(bool(np.isfinite(times_s).all()), "time_s", time_s, "be finite")
    require_number("height_m", height_m, -1000.0, 1000.0)
    target, acceleration = trajectory.target(times_s), trajectory.acceleration(times_s)
    vertical = vertical_of(trajectory, times_s)
    if not is_spatial(trajectory):
        vertical = np.broadcast_to([height_m, 0.0, 0.0], vertical.shape)
    level = target[..., :2], target[..., 2:], acceleration
    finite = all(bool(np.isfinite(part).all()) for part in (*level, vertical))
    require(finite, "trajectory", trajectory, "be finite at these times")
    return CurvePoint(
        *(
            vectors_to_ned(frame, np.concatenate([plane, -vertical[..., axis : axis + 1]], axis=-1))
            for axis, plane in enumerate(level)
        )
    )
