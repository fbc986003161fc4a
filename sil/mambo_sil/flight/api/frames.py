"""Frames of other programs, and how their vectors and angles become ours.

Ours is NED with a body that is forward, right, down. Angles are Z-Y-X: yaw, then pitch, then roll.

| frame | world                                 | body                | who                 |
|-------|---------------------------------------|---------------------|---------------------|
| NED   | x north, y east, z down               | forward, right, down | PX4, ours           |
| ENU   | x east, y north, z up                 | forward, left, up   | ROS (REP 103)       |
| NWU   | x north or ahead, y west or left, z up | forward, left, up   | Crazyflie, RotorPy  |
"""

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from mambo_sil.drone.plant.arrays import FloatArray

FrameName = Literal["NED", "ENU", "NWU"]


def horizontal_to_ned(frame: FrameName, vectors: ArrayLike) -> FloatArray:
    """Return x and y in NED (..., 2) of vectors (..., 2) or (..., 3) in another world frame."""
    x, y = np.moveaxis(np.asarray(vectors, np.float64)[..., :2], -1, 0)
    match frame:
        case "NED":
            return np.stack([x, y], axis=-1)
        case "ENU":
            return np.stack([y, x], axis=-1)
        case "NWU":
            return np.stack([x, -y], axis=-1)


def attitude_to_ned(frame: FrameName, attitude_rad: ArrayLike) -> FloatArray:
    """Return roll, pitch, yaw (..., 3) in NED of those in another frame."""
    roll, pitch, yaw = np.moveaxis(np.asarray(attitude_rad, np.float64), -1, 0)
    match frame:
        case "NED":
            return np.stack([roll, pitch, yaw], axis=-1)
        case "ENU":
            return np.stack([roll, -pitch, math.pi / 2.0 - yaw], axis=-1)
        case "NWU":
            return np.stack([roll, -pitch, -yaw], axis=-1)


def command_in_frame(frame: FrameName, command_rad: ArrayLike) -> FloatArray:
    """Return commands of roll and pitch (..., 2) with the signs of another frame's body."""
    roll, pitch = np.moveaxis(np.asarray(command_rad, np.float64), -1, 0)
    return np.stack([roll, pitch if frame == "NED" else -pitch], axis=-1)


def attitude_of_quaternion(quaternion: ArrayLike) -> FloatArray:
    """Return roll, pitch, yaw (..., 3) of unit quaternions [x, y, z, w] (..., 4), in their own frame."""
    x, y, z, w = np.moveaxis(np.asarray(quaternion, np.float64), -1, 0)
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.stack([roll, pitch, yaw], axis=-1)
