"""The course of least snap through points at given times: the integral of the squared snap is least."""

import numpy as np
from numpy.typing import NDArray

from mambo_extensions.plan.hermite import ENDS, basis
from mambo_sil.drone.plant.arrays import FloatArray


def least_snap(
    knots: FloatArray, duration_s: FloatArray, free: NDArray[np.bool_], *, closed: bool
) -> FloatArray:
    """Return knots (n + 1, 4, 3) whose free derivatives are those of least snap; the others stay.

    free:   (n + 1, 4) which derivatives are free, along all axes.
    closed: the last knot is the first one.
    """
    count = len(duration_s)
    owner = np.arange(4 * (count + 1))
    if closed:
        owner[-4:] = owner[:4]
    price = np.zeros((len(owner), len(owner)))
    nodes, weights = np.polynomial.legendre.leggauss(4)  # exact up to degree 7; the squared snap has 6
    snap = basis((nodes + 1.0) / 2.0)[4]
    of_piece = np.einsum("s,sj,sk->jk", weights / 2.0, snap, snap)
    for piece, piece_s in enumerate(duration_s):
        scale = piece_s**ENDS
        rows = owner[4 * piece : 4 * piece + 8]
        price[np.ix_(rows, rows)] += of_piece * np.outer(scale, scale) / piece_s**7
    flat = knots.reshape(-1, 3).copy()
    chosen = np.flatnonzero(free.ravel() & (owner == np.arange(len(owner))))
    fixed = np.setdiff1d(owner, chosen)
    flat[chosen] = -np.linalg.solve(price[np.ix_(chosen, chosen)], price[np.ix_(chosen, fixed)] @ flat[fixed])
    return flat[owner].reshape(knots.shape)
