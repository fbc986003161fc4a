"""How good a plan is: its cost over the least there is for the same input, which HiGHS finds (through SciPy).

The problem is that of `benchmarks/peers_setups.py`, with or without the lag of the attitude loops; an input
(6,) is the error x, vx, y, vy and the last command, which is also the tilt that a lag starts from.
"""

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, sparse

from benchmarks.peers_programs import Cost
from benchmarks.peers_setups import CONTROL, EFFORT, GRAVITY_M_S2, PREDICTION, STEP_S, TILT_RAD, TRACKING

Array = NDArray[np.float64]
Lags = tuple[float, float]
"""Of roll and pitch, in s; zero is none."""

_INPUTS: Final = 6
_MOVES: Final = 2 * CONTROL
_WEIGHTS: Final = np.concatenate([np.full(2 * PREDICTION, TRACKING), np.full(_MOVES, EFFORT)])


def predicted(lags_s: Lags) -> tuple[Array, Array]:
    """Return the predicted positions x, y of every step: (20, 6) from the input, (20, 4) from the moves."""
    every = np.eye(_INPUTS + _MOVES)
    x, vx, y, vy, roll, pitch = every[:_INPUTS]
    positions = []
    for step in range(PREDICTION):
        move = _INPUTS + 2 * min(step, CONTROL - 1)
        roll, roll_speed, roll_shift = _turned(roll, every[move], lags_s[0])
        pitch, pitch_speed, pitch_shift = _turned(pitch, every[move + 1], lags_s[1])
        x = x + STEP_S * vx - GRAVITY_M_S2 * pitch_shift
        vx = vx - GRAVITY_M_S2 * pitch_speed
        y = y + STEP_S * vy + GRAVITY_M_S2 * roll_shift
        vy = vy + GRAVITY_M_S2 * roll_speed
        positions += [x, y]
    rows = np.array(positions)
    return rows[:, :_INPUTS], rows[:, _INPUTS:]


def _turned(tilt: Array, move: Array, lag_s: float) -> tuple[Array, Array, Array]:
    """Let a tilt settle on a move for a step: the tilt then, its integral, and the integral of that."""
    decay = math.exp(-STEP_S / lag_s) if lag_s else 0.0
    lack_s = lag_s * (1 - decay)
    lack_s2 = lag_s * (STEP_S - lack_s)
    to_turn = move - tilt
    return (
        move - decay * to_turn,
        STEP_S * move - lack_s * to_turn,
        STEP_S * STEP_S / 2 * move - lack_s2 * to_turn,
    )


def _residuals(lags_s: Lags) -> tuple[Array, Array]:
    """Return what the cost weighs, errors and changes of moves: from the input, and from the moves."""
    from_input, from_moves = predicted(lags_s)
    before = np.zeros((_MOVES, _INPUTS))
    before[:2, 4:] = np.eye(2)
    changes = np.eye(_MOVES) - np.eye(_MOVES, k=-2)
    return np.vstack([from_input, -before]), np.vstack([from_moves, changes])


def costs(kind: Cost, lags_s: Lags, inputs: Array, moves: Array) -> Array:
    """Return the cost (n,) of plans `moves` (n, 4) for `inputs` (n, 6)."""
    from_input, from_moves = _residuals(lags_s)
    left = inputs @ from_input.T + moves @ from_moves.T
    sized = np.abs(left) if kind == "1-norm" else np.square(left)
    found: Array = sized @ _WEIGHTS
    return found


def best(kind: Cost, lags_s: Lags, inputs: Array) -> Array:
    """Return the plans (n, 4) within the limit that cost least for `inputs` (n, 6)."""
    from_input, rows = _residuals(lags_s)
    solve = _least_sum if kind == "1-norm" else _least_squares
    return np.array([solve(rows, -(from_input @ one)) for one in inputs])


def _least_sum(rows: Array, right: Array) -> Array:
    """Minimise the weighted sum of sizes: a linear program with a slack for each."""
    slack = -sparse.identity(len(rows))
    found: Any = optimize.linprog(
        np.concatenate([np.zeros(_MOVES), _WEIGHTS]),
        sparse.vstack([sparse.hstack([rows, slack]), sparse.hstack([-rows, slack])]),
        np.concatenate([right, -right]),
        bounds=[(-TILT_RAD, TILT_RAD)] * _MOVES + [(0, None)] * len(rows),
        method="highs",
    )
    plan: Array = found.x[:_MOVES]
    return plan


def _least_squares(rows: Array, right: Array) -> Array:
    """Minimise the weighted sum of squares; HiGHS takes no tighter tolerance than this active-set method."""
    root = np.sqrt(_WEIGHTS)
    found: Any = optimize.lsq_linear(
        rows * root[:, None], right * root, (-TILT_RAD, TILT_RAD), method="bvls", tol=1e-14
    )
    plan: Array = found.x
    return plan


def above(kind: Cost, lags_s: Lags, inputs: Array, plans: Array) -> Array:
    """Return by what share (n,) the cost of `plans` (n, 4), cut to the limit, is above the least."""
    inputs, plans = inputs.astype(np.float64), plans.astype(np.float64)
    least = costs(kind, lags_s, inputs, best(kind, lags_s, inputs))
    found: Array = costs(kind, lags_s, inputs, np.clip(plans, -TILT_RAD, TILT_RAD)) / least - 1
    return found
