"""The reference is the paper: checked against eqs 8-12 and RPROP written down a second time, naively."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.reference import ReferenceController, cost
from mambo_nmpc.codegen.reference.arithmetic import arithmetic
from mambo_nmpc.codegen.reference.predictor import Predictor
from mambo_nmpc.codegen.settings.model import Settings
from tests.support.cases import settings_case

Array = NDArray[np.float64]

SHORT = [index for index in range(40) if settings_case(index, "float64").horizon.prediction <= 20]


class Situation:
    """A random state, target and thrust, a last command, weights, and moves to judge."""

    def __init__(self, settings: Settings, rng: np.random.Generator, last: Array, scale: float = 1.0) -> None:
        design, self.settings, self.last = Design(settings), settings, last
        self.state = scale * rng.normal(0, 1, 7) * [1, 1, 1, 1, 0.3, 0.3, 3]
        self.target = scale * rng.normal(0, 1, 4)
        self.thrust = rng.uniform(5, 15)
        self.moves = rng.uniform(-0.3, 0.3, (settings.horizon.control, 2))
        self.weights = np.array([settings.cost.tracking_weight, settings.cost.effort_weight])
        self._predictor = Predictor(design, arithmetic(design))
        self._prediction = self._predictor.prepare(
            self.state[None], self.target[None], np.array([self.thrust])
        )

    def reference(self, moves: Array) -> tuple[float, Array]:
        """Return the reference's cost and gradient (control, 2) at `moves`."""
        costs, gradients = cost.evaluate(
            self._predictor,
            self._prediction,
            self.weights[None],
            moves[None],
            self.last[None],
        )
        return float(costs[0]), gradients[0]

    def naive_cost(self) -> float:
        """Return eq 12 over a roll-out."""
        change = np.diff(np.vstack([self.last, self.moves]), axis=0)
        errors = rolled_out(self.settings, self.state, self.target, self.thrust, self.moves)
        return float(self.weights[0] * np.abs(errors).sum() + self.weights[1] * np.abs(change).sum())


def rolled_out(settings: Settings, state: Array, target: Array, thrust: float, moves: Array) -> Array:
    """Step eqs 8-11 along the horizon; with attitude lag, integrate them: errors (prediction, 2)."""
    model, step_s = settings.model, settings.horizon.prediction_step_s
    sign = 1 if model.yaw_convention == "printed" else -1
    sine, cosine = np.sin(state[6]), np.cos(state[6])
    gain = thrust * np.array([[sign * sine, -cosine], [cosine, sign * sine]])
    lags = np.array([model.roll_lag_s, model.pitch_lag_s])
    position, velocity, angle, goal = state[0:2], state[2:4], state[4:6], target[0:2]
    errors = []
    for index in range(settings.horizon.prediction):
        command = moves[min(index, len(moves) - 1)]
        if lags.any():

            def flow(_: float, y: Array, command: Array = command) -> Array:
                angles = np.where(lags > 0, y[4:6], command)
                rates = np.where(lags > 0, (command - y[4:6]) / np.where(lags > 0, lags, 1), 0)
                return np.concatenate([y[2:4], gain @ angles, rates])

            start = np.concatenate([position, velocity, angle])
            end = solve_ivp(flow, (0, step_s), start, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
            position, velocity, angle = end[0:2], end[2:4], end[4:6]
        else:
            acceleration = gain @ command
            factor = step_s / 2 if model.position_update == "printed" else step_s**2 / 2
            position = position + step_s * velocity + factor * acceleration
            velocity = velocity + step_s * acceleration
        goal = goal + step_s * target[2:4]
        errors.append(position - goal)
    return np.array(errors)


@pytest.mark.parametrize("index", SHORT)
def test_the_cost_is_that_of_a_roll_out(index: int) -> None:
    """Constant tables and stepping the model say the same, with and without lag, exact and printed."""
    rng = np.random.default_rng(index)
    for _ in range(3):
        situation = Situation(settings_case(index, "float64"), rng, last=rng.uniform(-0.3, 0.3, 2))
        assert situation.reference(situation.moves)[0] == pytest.approx(situation.naive_cost(), rel=1e-10)


@pytest.mark.parametrize("index", SHORT)
def test_the_gradient_is_that_of_the_cost(index: int) -> None:
    """Away from its kinks, the cost changes with each move as the gradient says."""
    rng = np.random.default_rng(index)
    situation = Situation(settings_case(index, "float64"), rng, last=rng.uniform(-0.3, 0.3, 2))
    gradient = situation.reference(situation.moves)[1]
    for move in np.ndindex(situation.moves.shape):
        offset = np.zeros_like(situation.moves)
        offset[move] = 1e-6
        above, below = (situation.reference(situation.moves + way * offset)[0] for way in (1, -1))
        assert gradient[move] == pytest.approx(
            (above - below) / 2e-6, rel=1e-4, abs=1e-6 * situation.weights.max()
        )


def textbook_rprop(
    settings: Settings, evaluate: Callable[[Array], tuple[float, Array]], moves: Array
) -> tuple[Array, float, int, bool]:
    """Return moves, last cost, updates and convergence, one component after the other."""
    optimizer, limit = settings.optimizer, settings.limits.tilt_rad
    moves, before = moves.copy(), moves.copy()
    step, stored = np.full_like(moves, optimizer.initial_step_rad), np.zeros_like(moves)
    costs: list[float] = []
    converged, updates = False, 0
    for _ in range(optimizer.iterations):
        value, gradient = evaluate(moves)
        converged = converged or (bool(costs) and abs(value - costs[-1]) < optimizer.tolerance)
        costs.append(value)
        if converged:
            continue
        updates += 1
        for k in np.ndindex(moves.shape):
            agreement = np.sign(stored[k]) * np.sign(gradient[k])
            if agreement < 0:
                step[k] = np.maximum(step[k] * optimizer.decrease, optimizer.step_min_rad)
                moves[k] = before[k] if optimizer.variant == "rprop+" else moves[k]
                stored[k] = 0
                continue
            if agreement > 0:
                step[k] = np.minimum(step[k] * optimizer.increase, optimizer.step_max_rad)
            before[k] = moves[k]
            moves[k] = np.clip(moves[k] - np.sign(gradient[k]) * step[k], -limit, limit)
            stored[k] = gradient[k]
    return moves, costs[-1], updates, converged


@pytest.mark.parametrize("index", range(60))
def test_the_search_is_rprop(index: int) -> None:
    """Five consecutive steps: plan, cost, updates and convergence equal those of the textbook."""
    settings = settings_case(index, "float64")
    rng = np.random.default_rng(index)
    controller = ReferenceController(Design(settings))
    plan, last = np.zeros((settings.horizon.control, 2)), np.zeros(2)
    for _ in range(5):
        situation = Situation(settings, rng, last, scale=0.2)
        start = plan if settings.optimizer.warm_start == "plan" else np.tile(last, (len(plan), 1))
        expected = textbook_rprop(settings, situation.reference, start)
        step = controller.step(situation.state[None], situation.target[None], [situation.thrust])
        assert step.status[0] == 0
        assert np.array_equal(step.plan_rad[0], expected[0])
        assert (step.cost[0], step.iterations[0], step.converged[0]) == expected[1:]
        plan, last = expected[0], expected[0][0]
