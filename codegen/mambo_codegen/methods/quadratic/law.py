"""Constants of the quadratic cost's exact minimum, for each axis of the heading.

Along right and forward the drone's error obeys, in seconds and metres,

    e' = v,  v' = a + w,  w' = -j,  j' = -j / 1 s

with a from `attitude_constants.py`, w the disturbance less the target's acceleration, and j
the target's jerk. The cost is the sum over all control steps of

    e^2 + (weight v)^2 + (response^3 (u_k - u_k-1) / T_s)^2

without end: behind the free moves the Riccati equation gives the cost to go. The first free move is the
command of this control step; the second, if there is one, is reached by a ramp. Their minimum is linear in
the state, [e, v, w, j, a, i, c, u_k-1]; the limits of the command cut it off.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.quadratic.attitude_constants import AttitudeLoop, attitude_loops
from mambo_codegen.methods.quadratic.riccati import Matrix, feedback_gain, hold, mp, solve_riccati, sum_costs
from mambo_codegen.methods.rate_feedback import lag_refusals
from mambo_codegen.settings.key import Refusal
from mambo_codegen.settings.sections import Cost, Sections

STATES: Final = ("e", "v", "w", "j", "a", "i", "c", "u")
MOVED: Final = ("e", "v", "a", "i", "c", "u")
"""The states that the command moves."""
_COMMAND: Final = 7
MOST_OUTAGE_STEPS: Final = 250
"""The controller counts the control steps of an outage in one byte."""

_JERK_POLE_1_S: Final = 1
_DISTURBANCE_POLE_1_S: Final = "0.001"


@dataclass(frozen=True)
class LawConstants:
    """Constants of the law, float64, for lengths in m and times in steps of an update period.

    moves:          1, or 2 with a ramp.
    rows:           (2, moves, 8) the unlimited minimum, the free moves in m/step^2, from the state; axis 0 is
                    right (roll), axis 1 forward (pitch).
    ratios:         (2,) H12/H11 of the second derivatives H of the cost by two moves: by how much the best
                    first move falls when the second rises; 0 for one move.
    spectral_radius: (2,) of the closed loop without limits.
    """

    moves: int
    rows: NDArray[np.float64]
    ratios: NDArray[np.float64]
    spectral_radius: NDArray[np.float64]


def law_constants(settings: Sections) -> LawConstants:
    """Derive the constants of the law."""
    laws = _laws(settings)
    return LawConstants(
        moves=laws[0].rows.shape[0],
        rows=np.array([law.rows for law in laws]),
        ratios=np.array([law.ratio for law in laws]),
        spectral_radius=np.array([law.spectral_radius for law in laws]),
    )


def second_derivatives(settings: Sections) -> NDArray[np.float64]:
    """Return the second derivatives of the cost by the free moves, (2, 2, 2) for both axes of two moves.

    Raises ValueError for one move, whose minimum does not depend on them.
    """
    laws = _laws(settings)
    if laws[0].curvature is None:
        raise ValueError("there is one free move")
    return np.array([law.curvature for law in laws])


def closed_loops(settings: Sections) -> NDArray[np.float64]:
    """Return the transition of the states `MOVED` in a control step under the law, (2, 6, 6) in SI units."""
    return np.array([law.closed_loop for law in _laws(settings)])


def _laws(settings: Sections) -> list["_Law"]:
    horizon = settings.horizon
    return [
        _law(horizon.update_period_s, horizon.ramp_s, settings.cost, loop)
        for loop in attitude_loops(settings.model, settings.damping)
    ]


@lru_cache(maxsize=128)
def _law(update_period_s: float, ramp_s: float, cost: Cost, loop: AttitudeLoop) -> "_Law":
    return _Law(update_period_s, ramp_s, cost, loop)


class _Law:
    """The law along one axis."""

    def __init__(self, update_period_s: float, ramp_s: float, cost: Cost, loop: AttitudeLoop) -> None:
        period_s = mp.mpf(update_period_s)
        self._transition, self._input = _model(loop, period_s)
        self._state_cost = mp.zeros(8)
        self._state_cost[0, 0] = mp.mpf(1)
        self._state_cost[1, 1] = mp.mpf(cost.velocity_weight_s) ** 2
        self._input_cost = mp.matrix([[(mp.mpf(cost.response_time_s) ** 3 / period_s) ** 2]])
        self._to_go = solve_riccati(self._transition, self._input, self._state_cost, self._input_cost)
        self.curvature: list[list[float]] | None = None
        ramp = round(ramp_s / update_period_s)
        rows, ratio = self._two_moves(ramp) if ramp else self._one_move()
        scale = _scale(loop, period_s)
        self.rows = np.array(
            [[float(rows[move, k] * scale[k]) for k in range(8)] for move in range(rows.rows)]
        )
        self.ratio = float(ratio)
        self.closed_loop = self._closed_loop(rows)
        self.spectral_radius = float(np.max(np.abs(np.linalg.eigvals(self.closed_loop))))

    def _one_move(self) -> tuple[Matrix, Any]:
        rows = -feedback_gain(self._transition, self._input, self._input_cost, self._to_go)
        rows[0, _COMMAND] += 1
        return rows, mp.mpf(0)

    def _two_moves(self, ramp: int) -> tuple[Matrix, Any]:
        """Sum the cost over both moves as a quadratic form of state and moves, and minimise it."""
        form = mp.zeros(10)
        form[:8, :8] = self._to_go
        first, second = mp.zeros(1, 10), mp.zeros(1, 10)
        first[8], first[_COMMAND] = mp.mpf(1), mp.mpf(-1)
        second[9], second[8] = mp.mpf(1) / ramp, mp.mpf(-1) / ramp
        for change, steps in ((second, ramp), (first, 1)):
            transition, cost = mp.eye(10), mp.zeros(10)
            transition[:8, :8] = self._transition
            transition[:8, :] += self._input * change
            cost[:8, :8] = self._state_cost
            cost += self._input_cost[0] * (change.T * change)
            form = sum_costs(transition, cost, form, steps)
        curvature = form[8:, 8:]
        self.curvature = [[float(curvature[row, column]) for column in (0, 1)] for row in (0, 1)]
        return -(mp.inverse(curvature) * form[8:, :8]), curvature[0, 1] / curvature[0, 0]

    def _closed_loop(self, rows: Matrix) -> NDArray[np.float64]:
        """Return the transition of the states that the command moves, without its limits."""
        change = rows[0, :].copy()
        change[_COMMAND] -= 1
        loop = self._transition + (self._input * change)
        moved = [STATES.index(name) for name in MOVED]
        return np.array([[float(loop[row, column]) for column in moved] for row in moved])


def _model(loop: AttitudeLoop, period_s: Any) -> tuple[Matrix, Matrix]:
    """Return how the state answers a change of the command, (8, 8) and (8, 1)."""
    rates, inputs = mp.zeros(7), mp.zeros(7, 1)
    rates[0, 1] = rates[1, 2] = rates[1, 4] = mp.mpf(1)
    rates[2, 2] = -mp.mpf(_DISTURBANCE_POLE_1_S)
    rates[2, 3] = mp.mpf(-1)
    rates[3, 3] = mp.mpf(-_JERK_POLE_1_S)
    rates[4:, 4:], inputs[4:, 0] = loop.rates(period_s)
    transition, command = hold(rates, inputs, period_s)
    joint, change = mp.eye(8), mp.zeros(8, 1)
    joint[:7, :7], joint[:7, 7] = transition, command
    change[:7, 0], change[7] = command, mp.mpf(1)
    return joint, change


def _scale(loop: AttitudeLoop, period_s: Any) -> list[Any]:
    """Return the factors from rows for SI units to rows for steps: moves in m/step^2, the jerk in m/step^3.

    The integral part counts as an acceleration.
    """
    share = loop.integral_1_s
    integral = 1 / share if share else mp.mpf(0)
    one = mp.mpf(1)
    return [period_s**2, period_s, one, 1 / period_s, one, integral, one, one]


def refusals(settings: Sections) -> list[Refusal]:
    """Return why a controller with a quadratic cost cannot have `settings`."""
    refused = lag_refusals(settings, needs_lag=True)
    horizon, model = settings.horizon, settings.model
    for angle in ("roll", "pitch"):
        trim_rad, gain = getattr(model, f"{angle}_trim_rad"), getattr(model, f"{angle}_gain")
        if abs(trim_rad) >= gain * settings.limits.tilt_rad:
            rule = f"must be less than model.{angle}_gain times limits.tilt_rad"
            refused.append(Refusal("model", f"{angle}_trim_rad", rule))
    if round(settings.observer.outage_s / horizon.update_period_s) > MOST_OUTAGE_STEPS:
        rule = f"must be at most {MOST_OUTAGE_STEPS} times horizon.update_period_s"
        refused.append(Refusal("observer", "outage_s", rule))
    if horizon.ramp_s and horizon.ramp_s < 2 * horizon.update_period_s:
        refused.append(Refusal("horizon", "ramp_s", "must be 0 or at least 2 update periods"))
    if refused:
        return refused
    try:
        radius = float(np.max(law_constants(settings).spectral_radius))
    except ValueError:
        radius = math.inf
    if not radius < 1:
        rule = (
            f"gives an unstable loop (spectral radius {radius:.4f}) with cost.response_time_s = "
            f"{settings.cost.response_time_s:g}; write a shorter ramp or a longer response time"
        )
        refused.append(Refusal("horizon", "ramp_s", rule))
    return refused
