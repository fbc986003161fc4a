"""The exact optimizer against an independent program, and the loop that its commands close."""

import itertools

import numpy as np
import pytest

from mambo_codegen.methods.quadratic.arithmetic import QuadraticArithmetic
from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.methods.quadratic.optimizer import QuadraticOptimizer
from mambo_codegen.settings.model import Settings
from tests.support.quadratic import (
    ANGLES,
    TWO_MOVES,
    Array,
    axis_of,
    settings_of,
    settling_steps,
    two_move_cost,
)

FEW, MANY = range(4), range(50)


def drawn(index: int) -> Settings:
    """Draw the settings number `index`, of two moves, for which a simulated cost settles in a second."""
    rng = np.random.default_rng(index)
    values = TWO_MOVES | {
        "code.scalar": "float64",
        "horizon.update_period_s": float(rng.choice([0.005, 0.01, 0.02, 0.05])),
        "horizon.ramp_s": float(rng.uniform(0.1, 0.8)),
        "limits.tilt_rad": float(rng.choice([0.05, 0.35, 1.2])),
        "cost.response_time_s": float(10.0 ** rng.uniform(-1.2, -0.3)),
        "cost.velocity_weight_s": float(rng.choice([0.0, 0.1, 0.5])),
    }
    for angle in ANGLES:
        values |= {
            f"model.{angle}_lag_s": float(10.0 ** rng.uniform(-2, -0.3)),
            f"model.{angle}_delay_s": float(rng.choice([0.0, 0.02, 0.1])),
            f"model.{angle}_integral_1_s": float(rng.choice([0.3, 1.0, 5.0])),
        }
    return settings_of(values)


def enumerated_minimum(curvature: Array, free: Array, limit: float) -> Array:
    """Return the first move (n,) of the minima in the box, of n quadratic programs with minima `free` (n, 2).

    Every active set is solved; of those whose moves lie in the box the cheapest is taken.
    """
    gradient = -(free @ curvature)
    best, move = np.full(len(free), np.inf), np.zeros(len(free))
    for active in itertools.product((-1, 0, 1), repeat=2):
        held = np.array(active) != 0
        moves = np.tile(limit * np.array(active, np.float64), (len(free), 1))
        if not held.all():
            inner = np.ix_(~held, ~held)
            pushed = gradient[:, ~held] + (moves[:, held] @ curvature[np.ix_(held, ~held)])
            moves[:, ~held] = -np.linalg.solve(curvature[inner], pushed.T).T
        inside = np.all(np.abs(moves) <= limit * (1 + 1e-14), axis=1)
        cost = 0.5 * np.einsum("ni,ij,nj->n", moves, curvature, moves) + np.einsum(
            "ni,ni->n", gradient, moves
        )
        better = inside & (cost < best)
        best, move = np.where(better, cost, best), np.where(better, moves[:, 0], move)
    assert np.all(np.isfinite(best))
    return move


def compare_with_a_simulated_program(settings: Settings, n: int, seed: int) -> None:
    """Minimise from n states, within, at and far beyond the limits, and compare with all active sets."""
    method = Quadratic(settings)
    limits = method.attitude.command_limit_m_step2
    optimizer = QuadraticOptimizer(method, QuadraticArithmetic(method), limits)
    rng = np.random.default_rng(seed)
    sizes = 10.0 ** rng.uniform(-2, 1.5, (n, 1, 1)) * limits[None, :, None]
    largest = np.abs(method.law.rows).max(axis=1)
    states = sizes * rng.normal(0, 1, (n, 2, 8)) / np.where(largest > 0, largest, 1)
    states *= rng.choice([0.0, 1.0, 1.0], states.shape)
    states[:, :, 3] = 0.0  # the cost does not decide what is taken of the jerk
    found = optimizer.minimize(states)
    for index, angle in enumerate(ANGLES):
        axis, limit = axis_of(settings, angle), limits[index]
        curvature, slope = two_move_cost(axis, settling_steps(settings))
        rows = -np.linalg.solve(curvature, slope) * axis.scale
        free = states[:, index] @ rows.T
        expected = enumerated_minimum(curvature, free, limit)
        beyond = {tuple(signs) for signs in np.sign(free) * (np.abs(free) > limit)}
        assert len(beyond) == 9
        rounding = 1e-8 * np.sum(np.abs(states[:, index] * rows[0]), axis=1)
        assert np.all(np.abs(found[:, index] - expected) <= (1e-8 * limit) + rounding)
        assert np.mean(np.abs(expected) < limit) > 0.1


@pytest.mark.parametrize("index", FEW)
def test_the_minimum_is_that_of_every_active_set(index: int) -> None:
    """10,000 states of each settings, with a cost that was simulated and no closed form."""
    compare_with_a_simulated_program(drawn(index), 10_000, index)


@pytest.mark.sampled(4)
@pytest.mark.long
@pytest.mark.parametrize("index", MANY)
def test_a_hundred_thousand_minima_are_those_of_every_active_set(index: int) -> None:
    """With each of 50 settings."""
    compare_with_a_simulated_program(drawn(index), 100_000, 1000 + index)


def test_one_move_is_the_clamped_law() -> None:
    """With one free move the command is the Riccati gain's, cut off at the limit."""
    settings = settings_of(TWO_MOVES | {"horizon.ramp_s": 0.0, "code.scalar": "float64"})
    method = Quadratic(settings)
    limits = method.attitude.command_limit_m_step2
    optimizer = QuadraticOptimizer(method, QuadraticArithmetic(method), limits)
    states = np.random.default_rng(0).normal(0, 1, (5000, 2, 8)) * [0.3, 0.01, 1e-3, 1e-5, *[1e-3] * 4]
    free = np.einsum("nak,ak->na", states, method.law.rows[:, 0])
    assert 0.1 < np.mean(np.abs(free) > limits) < 0.9
    assert optimizer.minimize(states) == pytest.approx(np.clip(free, -limits, limits), rel=1e-12, abs=1e-16)
