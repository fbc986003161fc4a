"""Headings of a plan: polynomials of degree 7 from one point's heading to the next, at rest at the points."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import comb

from mambo_extensions.plan import LEAST_RATE
from mambo_extensions.plan.course import PlannedCourse
from mambo_extensions.plan.hermite import FROM_ENDS, TURN_PEAK
from mambo_extensions.plan.points import PlanPoint
from mambo_sil.api.set_points import HEADING_RATE_RAD_S
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import TrajectoryError
from mambo_sil.flight.polynomials import COEFFICIENTS

START, END = 0, 4
"""Of the eight numbers that make a piece, its first and its last value."""


def first_heading(points: Sequence[PlanPoint], *, closed: bool) -> float:
    """Return the heading at the first point: without one 0, or in a closed lap the last one given."""
    given = [point.yaw_rad for point in points if point.yaw_rad is not None]
    if points[0].yaw_rad is not None:
        return points[0].yaw_rad
    return given[-1] if closed and given else 0.0


def headings_of(points: Sequence[PlanPoint], course: PlannedCourse, rate: float = 1.0) -> FloatArray:
    """Return the coefficients (n, 8) of the heading in each piece; a point without one keeps the last.

    rate: speed of the course over that of the quickest one.

    Raises `TrajectoryError` for a turn that is too quick for the thrust that carries the drone.
    """
    closed, leg_s = course.choice.closed, course.leg_s
    headings_rad = [first_heading(points, closed=closed)]
    for point in [*points, points[0]][1:] if closed else points[1:]:
        last_rad = headings_rad[-1]
        turn_rad = 0.0 if point.yaw_rad is None else math.remainder(point.yaw_rad - last_rad, math.tau)
        headings_rad.append(last_rad + turn_rad)
    turns_rad = np.abs(np.diff(headings_rad))
    over = TURN_PEAK * turns_rad / leg_s / HEADING_RATE_RAD_S
    if over.max() > 1.0:
        leg = int(over.argmax())
        slower = math.floor(100.0 * rate / over[leg]) / 100.0
        cure = "a smaller turn" if slower < LEAST_RATE else f"--rate {slower:.2f}"
        raise TrajectoryError(
            f"points {leg + 1} to {(leg + 1) % len(points) + 1}: a turn by "
            f"{turns_rad[leg]:.2f} rad in {leg_s[leg]:.2f} s is quicker than "
            f"{HEADING_RATE_RAD_S:g} rad/s; {cure} would do"
        )
    ends = np.zeros((len(leg_s), COEFFICIENTS))
    ends[:, START], ends[:, END] = headings_rad[:-1], headings_rad[1:]
    of_legs = ends @ FROM_ENDS.T / leg_s[:, np.newaxis] ** np.arange(COEFFICIENTS)
    of_pieces = course.choice.leg
    since_s = np.cumsum(course.duration_s) - course.duration_s
    return _later(of_legs[of_pieces], since_s - since_s[course.choice.points[of_pieces]])


def _later(coefficients: FloatArray, time_s: FloatArray) -> FloatArray:
    """Return the coefficients (n, 8) of polynomials of the time since (n,)."""
    power = np.arange(COEFFICIENTS)
    rise = np.maximum(power - power[:, np.newaxis], 0)
    factor = comb(power, power[:, np.newaxis]) * time_s[:, np.newaxis, np.newaxis] ** rise
    return np.asarray(np.einsum("nkj,nj->nk", factor, coefficients))
