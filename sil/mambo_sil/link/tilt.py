"""Roll and pitch of one direction of the thrust, seen from two headings.

An autopilot turns its thrust to where a quaternion points in the world, and the heading after that, slower:
roll and pitch of a set-point are those of its own heading, not of the drone's.
"""

import math


def turned_tilt(roll_rad: float, pitch_rad: float, turn_rad: float) -> tuple[float, float]:
    """Return roll and pitch, Z-Y-X, at a heading that is `turn_rad` further: the thrust points as before."""
    sine, cosine = math.sin(turn_rad), math.cos(turn_rad)
    ahead, right = math.cos(roll_rad) * math.sin(pitch_rad), -math.sin(roll_rad)
    down = math.cos(roll_rad) * math.cos(pitch_rad)
    ahead, right = cosine * ahead + sine * right, cosine * right - sine * ahead
    return math.asin(min(max(-right, -1.0), 1.0)), math.atan2(ahead, down)
