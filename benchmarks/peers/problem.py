"""The problem of the comparison, for peers in their own Python too: this module imports nothing of ours.

Eq 8 at psi = 0 with a thrust of 9.81 m/s2 and eq 11 subtracted, so that the state is the error x, vx, y, vy
of the drone against its target, and a move is roll, pitch:

    x'' = -9.81 pitch    y'' = 9.81 roll    |roll|, |pitch| <= 0.35

over 10 steps of 0.055 s, with two moves, the second of them held (Np 10, Nc 2), and the weights of Table I on
the position error and on the change of the moves.
"""

from typing import Final

import numpy as np
import numpy.typing as npt

Matrix = npt.NDArray[np.float64]

PREDICTION: Final = 10
CONTROL: Final = 2
STEP_S: Final = 0.055
GRAVITY_M_S2: Final = 9.81
TILT_RAD: Final = 0.35
TRACKING: Final = 2250.0
EFFORT: Final = 1.0

_HALF: Final = STEP_S * STEP_S / 2
A: Final = np.kron(np.eye(2), np.array([[1.0, STEP_S], [0.0, 1.0]]))
"""(4, 4) from the state to the next state."""
B: Final = GRAVITY_M_S2 * np.array([[0.0, -_HALF], [0.0, -STEP_S], [_HALF, 0.0], [STEP_S, 0.0]])
"""(4, 2) from roll and pitch to the next state."""
POSITIONS: Final = (0, 2)
"""Indices of the positions in the state."""
STATE_WEIGHTS: Final = np.array([TRACKING, 0.0, TRACKING, 0.0])
CHANGES: Final = np.eye(4) - np.eye(4, k=-2)
"""(4, 4) from the moves to their changes; the first two lack the last command."""


def move_at(step: int) -> int:
    """Return the first of the two indices of the move that holds at a step."""
    return 2 * min(step, CONTROL - 1)


def condensed() -> tuple[Matrix, Matrix]:
    """Return the predicted positions, (20, 4) from the state and (20, 4) from the moves."""
    free, forced = np.eye(4), np.zeros((4, 4))
    from_state, from_moves = [], []
    for step in range(PREDICTION):
        free, forced = A @ free, A @ forced
        forced[:, move_at(step) : move_at(step) + 2] += B
        from_state.append(free[POSITIONS, :])
        from_moves.append(forced[POSITIONS, :])
    return np.vstack(from_state), np.vstack(from_moves)


def quadratic() -> tuple[Matrix, Matrix]:
    """Return the Hessian (4, 4) of the quadratic cost, and its gradient (4, 4) by the state at zero moves."""
    from_state, from_moves = condensed()
    hessian: Matrix = 2 * (TRACKING * from_moves.T @ from_moves + EFFORT * CHANGES.T @ CHANGES)
    return hessian, 2 * TRACKING * from_moves.T @ from_state
