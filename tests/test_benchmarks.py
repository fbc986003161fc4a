"""What the benchmarks compare: one controller written twice, one problem stated three times."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchmarks import optimum, peers_setups
from benchmarks.host_builds import build, plans
from benchmarks.ours import bundle_program, place_bundle, place_rollout, rollout_program
from benchmarks.peers_programs import Cost, Program
from codegen import presets
from codegen.settings import Settings
from codegen.settings.controller_toml import with_option
from tests.support.tools import require

NO_LAG = (0.0, 0.0)


def random_inputs(n: int) -> optimum.Array:
    """Return errors and last commands (n, 6), a third each far, near and very near."""
    scale = np.array([0.5, 1.0, 0.5, 1.0, 0.1, 0.1]) * 10.0 ** -(np.arange(n) % 3)[:, None]
    inputs: optimum.Array = np.random.default_rng(0).uniform(-1, 1, (n, 6)) * scale
    return inputs


def planned(
    settings: Settings,
    place: Callable[[Settings, Path], None],
    program: Callable[[str, Settings], Program],
    folder: Path,
) -> list[optimum.Array]:
    """Return the plans (n, 4) of a build, started over for each input, and flying on."""
    place(settings, folder)
    library = build(program("", settings), folder, ("-O0",), folder / "library.so")
    return [plans(library, random_inputs(600), follows=follows)[1] for follows in (False, True)]


@pytest.mark.parametrize("preset", ["table1", "mambo"])
def test_plain_roll_out_plans_what_the_generated_c_plans(preset: str, tmp_path: Path) -> None:
    """Without tables, with and without lag, cold and warm: in double, no sign falls otherwise."""
    require("gcc", "gcc")
    settings = with_option(presets.load(preset), "code.scalar", "float64", "test")
    ours = planned(settings, place_bundle, bundle_program, tmp_path / "ours")
    plain = planned(settings, place_rollout, rollout_program, tmp_path / "plain")
    for mine, theirs in zip(ours, plain, strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-6)
        assert np.ptp(mine, axis=0).min() > 0.1


def test_optimum_is_of_the_problem_of_the_peers() -> None:
    """Without lag, the predicted positions are those that the peers condense."""
    from_input, from_moves = optimum.predicted(NO_LAG)
    from_state, from_their_moves = peers_setups.condensed()
    np.testing.assert_array_equal(from_input, np.hstack([from_state, np.zeros((20, 2))]))
    np.testing.assert_array_equal(from_moves, from_their_moves)


@pytest.mark.parametrize("kind", ["1-norm", "quadratic"])
@pytest.mark.parametrize("lags_s", [NO_LAG, (0.27, 0.15)])
def test_no_neighbour_of_the_optimum_costs_less(kind: Cost, lags_s: optimum.Lags) -> None:
    """Both costs are convex: what no step improves, near the limit too, is the least there is."""
    inputs = random_inputs(30)
    best = optimum.best(kind, lags_s, inputs)
    least = optimum.costs(kind, lags_s, inputs, best)
    steps = np.random.default_rng(1).choice([-1e-3, 0.0, 1e-3], (100, *best.shape))
    for step in steps:
        moved = np.clip(best + step, -peers_setups.TILT_RAD, peers_setups.TILT_RAD)
        assert np.all(optimum.costs(kind, lags_s, inputs, moved) >= least * (1 - 1e-9))
