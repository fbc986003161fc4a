"""Headings of a plan: polynomials of degree 7 from one point's heading to the next, at rest at the points."""

import math
from collections.abc import Sequence

import numpy as np

from mambo_sil.api.set_points import HEADING_RATE_RAD_S
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import TrajectoryError
from mambo_sil.flight.polynomials import COEFFICIENTS
from mambo_sil.plan.hermite import FROM_ENDS, TURN_PEAK
from mambo_sil.plan.points import PlanPoint

START, END = 0, 4
"""Of the eight numbers that make a piece, its first and its last value."""


def headings_of(points: Sequence[PlanPoint], duration_s: FloatArray, *, closed: bool) -> FloatArray:
    """Return the coefficients (n, 8) of the heading in each piece; a point without one keeps the last.

    Raises `TrajectoryError` for a turn that is too quick for the thrust that carries the drone.
    """
    through = [*points, points[0]] if closed else list(points)
    headings_rad = [through[0].yaw_rad or 0.0]
    for point in through[1:]:
        last_rad = headings_rad[-1]
        turn_rad = 0.0 if point.yaw_rad is None else math.remainder(point.yaw_rad - last_rad, math.tau)
        headings_rad.append(last_rad + turn_rad)
    found = np.zeros((len(duration_s), COEFFICIENTS))
    for piece, piece_s in enumerate(duration_s.tolist()):
        turn_rad = headings_rad[piece + 1] - headings_rad[piece]
        if TURN_PEAK * abs(turn_rad) / piece_s > HEADING_RATE_RAD_S:
            shortest_s = TURN_PEAK * abs(turn_rad) / HEADING_RATE_RAD_S
            raise TrajectoryError(
                f"points {piece + 1} to {piece + 2}: a turn by {abs(turn_rad):.2f} rad in {piece_s:.2f} s is "
                f"quicker than {HEADING_RATE_RAD_S:g} rad/s; {shortest_s:.2f} s would do, or a smaller turn"
            )
        ends = np.zeros(COEFFICIENTS)
        ends[START], ends[END] = headings_rad[piece], headings_rad[piece + 1]
        found[piece] = FROM_ENDS @ ends / piece_s ** np.arange(COEFFICIENTS)
    return found
