"""The benchmarks compare equal controllers and equal problems."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks import optimum, problem
from benchmarks.host_builds import build, plans
from benchmarks.ours import PEERS_MODEL, Ours, bundle, rollout
from benchmarks.programs import Cost
from benchmarks.searches import Array
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.support.one_norm import ONE_NORM
from tests.support.tools import require


def random_inputs(n: int) -> Array:
    """Return errors and last commands (n, 6) of three magnitudes."""
    scale = np.array([0.5, 1.0, 0.5, 1.0, 0.1, 0.1]) * 10.0 ** -(np.arange(n) % 3)[:, None]
    inputs: Array = np.random.default_rng(0).uniform(-1, 1, (n, 6)) * scale
    return inputs


def plan_all(program: Ours, folder: Path) -> list[Array]:
    """Return the plans (n, 4) of a build, with a reset before each input, and without."""
    program.write(folder)
    library = build(program, folder, "-O0", folder / "library.so")
    return [plans(library, random_inputs(600), follows=follows)[1] for follows in (False, True)]


@pytest.mark.parametrize("chosen", [presets.load("table1"), ONE_NORM], ids=["no lag", "lag"])
def test_plain_roll_out_plans_what_the_generated_c_plans(chosen: Settings, tmp_path: Path) -> None:
    """In double both have the same plans, with and without lag, with and without warm start."""
    require("gcc", "gcc")
    settings = with_option(chosen, "code.scalar", "float64", "test")
    ours = plan_all(bundle("ours", "", settings), tmp_path / "ours")
    plain = plan_all(rollout("plain", "", settings), tmp_path / "plain")
    for mine, theirs in zip(ours, plain, strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-6)
        assert np.ptp(mine, axis=0).min() > 0.1


def test_optimum_is_of_the_problem_of_the_peers() -> None:
    """Its rows are the weighted errors and changes of the peers' condensed problem."""
    inputs = random_inputs(30)
    found = optimum.problems(PEERS_MODEL, inputs)
    from_state, from_moves = problem.condensed()
    before = np.hstack([inputs[:, 4:], np.zeros((30, 2))])
    weights = np.repeat([problem.TRACKING, problem.EFFORT], [20, 4])
    rows = np.vstack([from_moves, problem.CHANGES])
    offset = np.hstack([inputs[:, :4] @ from_state.T, -before])
    np.testing.assert_allclose(
        found.slope, np.tile(weights[:, None] * rows, (30, 1, 1)), rtol=1e-12, atol=1e-12
    )
    np.testing.assert_allclose(found.offset, weights * offset, rtol=1e-12, atol=1e-9)
    assert found.limit_rad == problem.TILT_RAD


@pytest.mark.parametrize("kind", ["1-norm", "quadratic"])
@pytest.mark.parametrize("settings", [PEERS_MODEL, ONE_NORM], ids=["no lag", "lag"])
def test_no_neighbour_of_the_optimum_costs_less(kind: Cost, settings: Settings) -> None:
    """Both costs are convex, so a plan that no small step within the limit improves is optimal."""
    inputs = random_inputs(30)
    best = optimum.solve(kind, settings, inputs)
    least = optimum.costs(kind, settings, inputs, best)
    steps = np.random.default_rng(1).choice([-1e-3, 0.0, 1e-3], (100, *best.shape))
    for step in steps:
        moved = np.clip(best + step, -problem.TILT_RAD, problem.TILT_RAD)
        assert np.all(optimum.costs(kind, settings, inputs, moved) >= least * (1 - 1e-9))
