"""Pieces of degree 7 between knots: position, velocity, acceleration and jerk at both ends of each.

A course of n pieces has n + 1 knots (n + 1, 4, 3), the derivatives 0 to 3 along x, y, z, and durations (n,).
Within a piece the time runs from 0 to 1 (tau). All derivatives up to the jerk are continuous.
"""

from math import perm
from typing import Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.polynomials import COEFFICIENTS, Piece, PiecesInSpace

ORDERS: Final = 5
"""Position to snap."""
ENDS: Final = np.tile(np.arange(4), 2)
"""Order of each of the eight numbers that make a piece along an axis: four at its start, four at its end."""


def _from_ends() -> FloatArray:
    """Return the coefficients of tau (8, 8) per derivative at the ends, in units of the piece's duration."""
    ends = np.zeros((COEFFICIENTS, COEFFICIENTS))
    for order in range(4):
        ends[order, order] = perm(order, order)
        ends[4 + order] = [perm(power, order) for power in range(COEFFICIENTS)]
    return np.asarray(np.linalg.inv(ends))


FROM_ENDS: Final = _from_ends()

TURN_PEAK: Final = 35.0 / 16.0
"""Largest rate of a piece at rest at both ends, over its mean one."""


def basis(tau: FloatArray) -> FloatArray:
    """Return derivatives by tau, per derivative at the ends, at the times tau (s,): (ORDERS, s, 8)."""
    powers = np.zeros((ORDERS, len(tau), COEFFICIENTS))
    for order in range(ORDERS):
        for power in range(order, COEFFICIENTS):
            powers[order, :, power] = perm(power, order) * tau ** (power - order)
    return np.asarray(powers @ FROM_ENDS)


def ends_of(knots: FloatArray, duration_s: FloatArray) -> FloatArray:
    """Return the derivatives by tau at both ends of each piece (n, 8, 3)."""
    ends = np.concatenate([knots[:-1], knots[1:]], axis=1)
    return np.asarray(ends * (duration_s[:, np.newaxis] ** ENDS)[:, :, np.newaxis])


def per_second(duration_s: FloatArray) -> FloatArray:
    """Return the factors (ORDERS, n) from derivatives by tau to those by time."""
    return np.asarray(duration_s ** -np.arange(ORDERS, dtype=float)[:, np.newaxis])


def motion(knots: FloatArray, duration_s: FloatArray, tau: FloatArray) -> FloatArray:
    """Return position to snap at the times tau (s,) of each piece: (ORDERS, n, s, 3)."""
    by_tau = np.einsum("ksj,njc->knsc", basis(tau), ends_of(knots, duration_s))
    return np.asarray(by_tau * per_second(duration_s)[:, :, np.newaxis, np.newaxis])


def pieces_of(knots: FloatArray, duration_s: FloatArray) -> PiecesInSpace:
    """Return a course as polynomials of the time, whose axes are north, east and height."""
    by_tau = np.einsum("pj,njc->npc", FROM_ENDS, ends_of(knots, duration_s))
    by_time = by_tau / (duration_s[:, np.newaxis] ** np.arange(COEFFICIENTS))[:, :, np.newaxis]
    return PiecesInSpace(
        tuple(
            Piece(
                float(piece_s), *(tuple(map(float, axis)) for axis in (rows[:, 0], -rows[:, 1], rows[:, 2]))
            )
            for piece_s, rows in zip(duration_s, by_time, strict=True)
        )
    )
