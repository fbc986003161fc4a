"""Eq 12 as a linear program, and controllers that minimise it by other searches.

For a given yaw and thrust the predicted errors are affine in the moves, with attitude lag too. Eq 12 is then
the 1-norm of affine rows, a linear program that HiGHS solves exactly. The rows come from an independent
discretisation of the model (matrix exponential); every step asserts that they give the reference's cost.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm
from scipy.optimize import linprog
from scipy.sparse import block_diag

from mambo_codegen.design import Design
from mambo_codegen.methods.one_norm.arithmetic import arithmetic
from mambo_codegen.methods.one_norm.horizon import shortened_lags_s
from mambo_codegen.methods.one_norm.optimizer import Evaluate, Rprop, Search
from mambo_codegen.reference import ReferenceController, Status, Step
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings

Array = NDArray[np.float64]

TOLERANCES: Final = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
"""The smallest that HiGHS accepts."""


@dataclass(frozen=True)
class Problems:
    """Minimise |slope moves + offset|_1 with |moves| <= limit_rad, for n controllers in one update.

    slope:  (n, rows, 2 * control) per rad: weighted errors x, y of each step, then changes of moves.
    offset: (n, rows) the same at zero moves.
    """

    slope: Array
    offset: Array
    limit_rad: float

    def rows(self, moves_rad: ArrayLike) -> Array:
        """Return the weighted errors and changes (n, rows) of `moves_rad` (n, control, 2)."""
        moves = np.asarray(moves_rad, np.float64).reshape(len(self.slope), -1, 1)
        return np.asarray((self.slope @ moves)[..., 0] + self.offset)

    def cost(self, moves_rad: ArrayLike) -> Array:
        """Return eq 12 (n,)."""
        return np.asarray(np.abs(self.rows(moves_rad)).sum(axis=1))

    def evaluate(self, moves_rad: Array) -> tuple[Array, Array]:
        """Return eq 12 (n,) and its subgradient (n, control, 2)."""
        rows = self.rows(moves_rad)
        gradient = np.sign(rows)[:, None] @ self.slope
        return np.abs(rows).sum(axis=1), gradient.reshape(moves_rad.shape)

    def optima(self) -> Array:
        """Return optimal moves (n, control, 2), from one linear program for all n controllers.

        It solves the dual: maximise offset . y - limit |slope' y|_1 over -1 <= y <= 1. The moves are the
        multipliers of its equations, slope' y = over - under.
        """
        n, rows, moves = self.slope.shape
        signs = np.hstack([-np.eye(moves), np.eye(moves)])
        limits = np.full((n, 2 * moves), self.limit_rad)
        unit = np.abs(self.slope).max()  # the tolerances are absolute
        solved = linprog(
            np.concatenate([-self.offset / unit, limits], axis=1).ravel(),
            A_eq=block_diag([np.hstack([slope.T / unit, signs]) for slope in self.slope], format="csr"),
            b_eq=np.zeros(n * moves),
            bounds=np.tile([(-1.0, 1.0)] * rows + [(0.0, np.inf)] * 2 * moves, (n, 1)),
            method="highs-ds",
            options=TOLERANCES,
        )
        assert solved.status == 0, solved.message
        found: Array = solved.eqlin.marginals.reshape(n, -1, 2)
        assert np.allclose(self.cost(found).sum(), -unit * solved.fun, rtol=1e-7, atol=1e-6)
        return found


class CostModel:
    """Eqs 8-11 for given settings; supports `position_update = "exact"` and no target acceleration only."""

    def __init__(self, settings: Settings) -> None:
        horizon, model = settings.horizon, settings.model
        assert model.position_update == "exact"
        assert settings.target.acceleration == "none"
        self._settings = settings
        self._yaw_sign = 1.0 if model.yaw_convention == "printed" else -1.0
        self._times_s = horizon.prediction_step_s * np.arange(1, horizon.prediction + 1)
        self._held = np.minimum(np.arange(horizon.prediction), horizon.control - 1)
        responses = [self._response(lag_s) for lag_s in shortened_lags_s(settings)]
        self._of_angle = np.stack([angle for angle, _ in responses], axis=-1)
        self._of_moves = np.stack([moves for _, moves in responses], axis=-1)
        change = np.eye(horizon.control) - np.eye(horizon.control, k=-1)
        self._change = settings.cost.effort_weight * np.kron(change, np.eye(2))

    def _response(self, lag_s: float) -> tuple[Array, Array]:
        """Return displacements at unit thrust: per initial tilt (steps,), per move (steps, control)."""
        flow = np.zeros((4, 4))  # position, velocity, angle, command
        flow[0, 1] = flow[1, 2] = 1.0
        if lag_s > 0:
            flow[2, 2:] = [-1.0 / lag_s, 1.0 / lag_s]
        step = expm(flow * self._settings.horizon.prediction_step_s)
        columns = np.zeros((4, 1 + self._settings.horizon.control))
        columns[2, 0] = lag_s > 0
        places = []
        for move in self._held:
            columns[3] = np.arange(-1, self._settings.horizon.control) == move
            if lag_s == 0:
                columns[2] = columns[3]
            columns = step @ columns
            places.append(columns[0].copy())
        responses = np.array(places)
        return responses[:, 0], responses[:, 1:]

    def problems(
        self, state: ArrayLike, target: ArrayLike, thrust: ArrayLike, last_rad: ArrayLike
    ) -> Problems:
        """Return the problems of one update: state (n, 7), target (n, 4), thrust (n,), command (n, 2)."""
        states, last = np.asarray(state, np.float64), np.asarray(last_rad, np.float64)
        offset = states[:, :4] - np.asarray(target, np.float64)[:, :4]
        sine, cosine = np.sin(states[:, 6]), np.cos(states[:, 6])
        turn = np.array([[self._yaw_sign * sine, -cosine], [cosine, self._yaw_sign * sine]])
        gain = (turn * np.asarray(thrust, np.float64)).transpose(2, 0, 1)
        n, weight = len(states), self._settings.cost.tracking_weight
        slope = weight * np.einsum("nxa,ija->nixja", gain, self._of_moves).reshape(n, 2 * len(self._held), -1)
        free = offset[:, None, :2] + self._times_s[:, None] * offset[:, None, 2:]
        free += np.einsum("nxa,ia,na->nix", gain, self._of_angle, states[:, 4:6])
        first = np.zeros((n, len(self._change)))
        first[:, :2] = -self._settings.cost.effort_weight * last
        return Problems(
            np.concatenate([slope, np.broadcast_to(self._change, (n, *self._change.shape))], axis=1),
            np.concatenate([weight * free.reshape(n, -1), first], axis=1),
            self._settings.limits.tilt_rad,
        )


Searching = Callable[[Settings, Problems, Array], Array]
"""(settings, problems, initial moves (n, control, 2)) -> chosen moves (n, control, 2)."""


def optimum(settings: Settings, problems: Problems, start_rad: Array) -> Array:
    """Choose the optimum, whatever the initial moves."""
    del settings, start_rad
    return problems.optima()


def rprop(settings: Settings) -> Rprop:
    """Return the search of the reference controller."""
    return Rprop(settings, arithmetic(Design(settings)))


def from_zero_moves(settings: Settings, problems: Problems, start_rad: Array) -> Array:
    """Search with RPROP from zero moves instead of the last plan."""
    return rprop(settings).minimize(problems.evaluate, np.zeros_like(start_rad)).moves_rad


def best_iterate(settings: Settings, problems: Problems, start_rad: Array) -> Array:
    """Search with RPROP and choose the plan of least cost among all iterates, the last one included."""
    met: list[tuple[Array, Array]] = []

    def evaluate(moves_rad: Array) -> tuple[Array, Array]:
        cost, gradient = problems.evaluate(moves_rad)
        met.append((cost, moves_rad))
        return cost, gradient

    evaluate(rprop(settings).minimize(evaluate, start_rad).moves_rad)
    costs, plans = (np.stack(column) for column in zip(*met, strict=True))
    return np.asarray(plans[np.argmin(costs, axis=0), np.arange(len(start_rad))])


class SearchingController(ReferenceController):
    """n reference controllers in float64 that choose their moves by `searching`."""

    def __init__(self, settings: Settings, n: int, searching: Searching) -> None:
        float64 = with_option(settings, "code.scalar", "float64")
        super().__init__(Design(float64), n, self._choose_moves)
        self._searching = searching
        self._model = CostModel(settings)

    def step(self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike) -> Step:
        """Compute the next commands; asserts that `Problems` has the reference's cost."""
        known = np.nan_to_num(np.asarray(state, np.float64))  # a lost flight is refused anyway
        self._problems = self._model.problems(
            known, target, thrust_acceleration_m_s2, self.memory.command_rad
        )
        step = super().step(state, target, thrust_acceleration_m_s2)
        good = step.status == Status.OK
        assert np.allclose(step.cost[good], self._problems.cost(step.plan_rad)[good], rtol=1e-9, atol=1e-9)
        return step

    def _choose_moves(self, _: Rprop, evaluate: Evaluate, start_rad: Array) -> Search:
        moves = self._searching(self.settings, self._problems, start_rad)
        cost, gradient = evaluate(moves)
        n = len(moves)
        return Search(moves, cost, gradient, np.zeros(n, np.int64), np.zeros(n, np.bool_))
