"""Frames of other programs, and how their vectors and angles become ours.

Ours is NED with a body that is forward, right, down. Angles are Z-Y-X: yaw, then pitch, then roll.

| frame | world                                 | body                | who                 |
|-------|---------------------------------------|---------------------|---------------------|
| NED   | x north, y east, z down               | forward, right, down | PX4, ours           |
| ENU   | x east, y north, z up                 | forward, left, up   | ROS (REP 103)       |
| NWU   | x north or ahead, y west or left, z up | forward, left, up   | Crazyflie, RotorPy  |
"""

import math
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from mambo_sil.arguments import as_numbers, require, require_choice
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import ArgumentError

FrameName = Literal["NED", "ENU", "NWU"]
FRAMES: Final[tuple[FrameName, ...]] = get_args(FrameName)

LENGTH_TOLERANCE: Final = 1e-3
"""Largest difference of a quaternion's length from 1."""


def horizontal_to_ned(frame: FrameName, vectors: ArrayLike, name: str = "vectors") -> FloatArray:
    """Return x and y in NED (..., 2) of vectors (..., 2) or (..., 3) in another world frame.

    Raises ArgumentError for another frame, and for other shapes; it calls the vectors `name`.
    """
    require_choice("frame", frame, FRAMES)
    x, y = _columns(name, vectors, 2, 3)[:2]
    match frame:
        case "NED":
            return np.stack([x, y], axis=-1)
        case "ENU":
            return np.stack([y, x], axis=-1)
        case "NWU":
            return np.stack([x, -y], axis=-1)


def attitude_to_ned(frame: FrameName, attitude_rad: ArrayLike) -> FloatArray:
    """Return roll, pitch, yaw (..., 3) in NED of those in another frame; raises ArgumentError."""
    require_choice("frame", frame, FRAMES)
    roll, pitch, yaw = _columns("attitude_rad", attitude_rad, 3)
    match frame:
        case "NED":
            return np.stack([roll, pitch, yaw], axis=-1)
        case "ENU":
            return np.stack([roll, -pitch, math.pi / 2.0 - yaw], axis=-1)
        case "NWU":
            return np.stack([roll, -pitch, -yaw], axis=-1)


def command_in_frame(frame: FrameName, command_rad: ArrayLike) -> FloatArray:
    """Return commands of roll and pitch (..., 2) with the signs of another frame's body.

    Raises ArgumentError for a frame other than NED, ENU and NWU, and for other shapes.
    """
    require_choice("frame", frame, FRAMES)
    roll, pitch = _columns("command_rad", command_rad, 2)
    return np.stack([roll, pitch if frame == "NED" else -pitch], axis=-1)


def attitude_of_quaternion(quaternion: ArrayLike) -> FloatArray:
    """Return roll, pitch, yaw (..., 3) of unit quaternions [x, y, z, w] (..., 4), in their own frame.

    NaN gives NaN. Raises ArgumentError for a length other than 1, and for other shapes.
    """
    x, y, z, w = _columns("quaternion", quaternion, 4)
    with np.errstate(over="ignore"):
        length = np.sqrt(x * x + y * y + z * z + w * w)
    off = np.abs(length - 1.0) > LENGTH_TOLERANCE
    require(not off.any(), "quaternion", quaternion, f"have length 1, within {LENGTH_TOLERANCE:g}")
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.stack([roll, pitch, yaw], axis=-1)


def _columns(name: str, values: ArrayLike, *counts: int) -> FloatArray:
    """Return the last axis of an array first; raises ArgumentError unless its length is one of `counts`."""
    array = as_numbers(name, values)
    if array.ndim == 0 or array.shape[-1] not in counts:
        allowed = " or ".join(f"(..., {count})" for count in counts)
        raise ArgumentError(f"{name}: has shape {array.shape}; it must be {allowed}")
    return np.moveaxis(array, -1, 0)
