"""Frames of other programs, and how their vectors and angles become ours.

Ours is NED with a body that is forward, right, down. Angles are Z-Y-X: yaw, then pitch, then roll.

| frame | world                                 | body                | who                 |
|-------|---------------------------------------|---------------------|---------------------|
| NED   | x north, y east, z down               | forward, right, down | PX4, ours           |
| ENU   | x east, y north, z up                 | forward, left, up   | ROS (REP 103)       |
| NWU   | x north or ahead, y west or left, z up | forward, left, up   | Crazyflie, RotorPy  |

Each conversion is its own inverse: it leads from the frame to NED and from NED to the frame.
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

_AXES: Final = {"NED": [0, 1, 2], "ENU": [1, 0, 2], "NWU": [0, 1, 2]}
_SIGNS: Final = {
    "NED": np.array([1.0, 1.0, 1.0]),
    "ENU": np.array([1.0, 1.0, -1.0]),
    "NWU": np.array([1.0, -1.0, -1.0]),
}


def vectors_to_ned(frame: FrameName, vectors: ArrayLike, name: str = "vectors") -> FloatArray:
    """Return vectors (..., 2) or (..., 3) of another world frame in NED, with as many columns.

    Raises ArgumentError for another frame, and for other shapes; it calls the vectors `name`.
    """
    require_choice("frame", frame, FRAMES)
    array = with_columns(name, vectors, 2, 3)
    if frame == "NED":
        return array
    columns = array.shape[-1]
    return np.asarray(array[..., _AXES[frame][:columns]] * _SIGNS[frame][:columns])


def attitude_to_ned(frame: FrameName, attitude_rad: ArrayLike) -> FloatArray:
    """Return roll, pitch, yaw (..., 3) in NED of those in another frame; raises ArgumentError."""
    require_choice("frame", frame, FRAMES)
    array = with_columns("attitude_rad", attitude_rad, 3)
    if frame == "NED":
        return array
    converted = array.copy()
    converted[..., 1] = -array[..., 1]
    converted[..., 2] = yaw_to_ned(frame, array[..., 2])
    return converted


def body_to_ned(frame: FrameName, vectors: ArrayLike, name: str = "rates_rad_s") -> FloatArray:
    """Return vectors (..., 3) along forward, right, down of those along the body of another frame.

    Raises ArgumentError for another frame, and for other shapes; it calls the vectors `name`.
    """
    require_choice("frame", frame, FRAMES)
    array = with_columns(name, vectors, 3)
    return array if frame == "NED" else np.asarray(array * _SIGNS["NWU"])


def yaw_to_ned(frame: FrameName, yaw_rad: ArrayLike) -> FloatArray:
    """Return headings (...) in NED of those in another frame; raises ArgumentError."""
    require_choice("frame", frame, FRAMES)
    yaw = as_numbers("yaw_rad", yaw_rad)
    match frame:
        case "NED":
            return yaw
        case "ENU":
            return np.asarray(math.pi / 2.0 - yaw)
        case "NWU":
            return np.asarray(-yaw)


def command_in_frame(frame: FrameName, command_rad: ArrayLike) -> FloatArray:
    """Return commands of roll and pitch (..., 2) with the signs of another frame's body.

    Raises ArgumentError for a frame other than NED, ENU and NWU, and for other shapes.
    """
    require_choice("frame", frame, FRAMES)
    array = with_columns("command_rad", command_rad, 2)
    return array if frame == "NED" else np.asarray(array * [1.0, -1.0])


def wrapped(angle_rad: ArrayLike) -> FloatArray:
    """Return angles (...) within -pi..pi."""
    return np.asarray(np.remainder(np.asarray(angle_rad) + math.pi, 2.0 * math.pi) - math.pi)


def turned_tilt(roll_rad: float, pitch_rad: float, turn_rad: float) -> tuple[float, float]:
    """Return roll and pitch, Z-Y-X, at a heading that is `turn_rad` further: the thrust points as before.

    An autopilot turns its thrust to where a quaternion points in the world, and the heading after that,
    slower: roll and pitch of a set-point are those of its own heading, not of the drone's.
    """
    sine, cosine = math.sin(turn_rad), math.cos(turn_rad)
    ahead, right = math.cos(roll_rad) * math.sin(pitch_rad), -math.sin(roll_rad)
    down = math.cos(roll_rad) * math.cos(pitch_rad)
    ahead, right = cosine * ahead + sine * right, cosine * right - sine * ahead
    return math.asin(min(max(-right, -1.0), 1.0)), math.atan2(ahead, down)


def attitude_of_quaternion(quaternion: ArrayLike) -> FloatArray:
    """Return roll, pitch, yaw (..., 3) of unit quaternions [x, y, z, w] (..., 4), in their own frame.

    NaN gives NaN. Raises ArgumentError for a length other than 1, and for other shapes.
    """
    x, y, z, w = np.moveaxis(with_columns("quaternion", quaternion, 4), -1, 0)
    with np.errstate(over="ignore"):
        length = np.sqrt(x * x + y * y + z * z + w * w)
    off = np.abs(length - 1.0) > LENGTH_TOLERANCE
    require(not off.any(), "quaternion", quaternion, f"have length 1, within {LENGTH_TOLERANCE:g}")
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.stack([roll, pitch, yaw], axis=-1)


def with_columns(name: str, values: ArrayLike, *counts: int) -> FloatArray:
    """Return an array; raises ArgumentError unless the length of its last axis is one of `counts`."""
    array = as_numbers(name, values)
    if array.ndim == 0 or array.shape[-1] not in counts:
        allowed = " or ".join(f"(..., {count})" for count in counts)
        raise ArgumentError(f"{name}: has shape {array.shape}; it must be {allowed}")
    return array
