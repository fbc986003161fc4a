"""The linear program of `benchmarks.quality` equals the controller's problem, and its solution is optimal."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.quality import PRESETS, entrants
from benchmarks.searches import (
    CostModel,
    Problems,
    SearchingController,
    best_iterate,
    from_zero_moves,
    optimum,
    rprop,
)
from mambo_codegen.design import Design
from mambo_codegen.reference import ReferenceController
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.support.cases import settings_case
from tests.support.one_norm import ONE_NORM

Inputs = tuple[NDArray[Any], NDArray[Any], NDArray[Any]]

N = 16
DRAWN = {
    index: with_option(settings, "target.acceleration", "none")  # which the linear program does not know
    for index, settings in ((index, settings_case(index, "float64")) for index in range(30))
    if settings.model.position_update == "exact"
}


def inputs(rng: np.random.Generator, farthest_m: float = 1.0) -> Inputs:
    """Draw states, targets and thrusts, with errors of 0.001 to 1 times `farthest_m`, at any heading."""
    target = rng.normal(0, 1, (N, 4))
    apart = farthest_m * 10.0 ** rng.uniform(-3, 0, (N, 1)) * rng.normal(0, 1, (N, 4))
    attitude = rng.uniform(-1, 1, (N, 3)) * [0.4, 0.4, 3.0]
    state = np.concatenate([target + apart, attitude], axis=1)
    return state, target, rng.uniform(5, 15, N)


@pytest.mark.parametrize("index", DRAWN)
def test_rows_have_the_cost_and_slope_of_the_reference(index: int) -> None:
    """Cost and gradient of the rows equal the reference's, for any settings, plan and last command."""
    rng = np.random.default_rng(index)
    seen: list[Problems] = []

    def anywhere(settings: Settings, problems: Problems, start_rad: NDArray[Any]) -> NDArray[Any]:
        seen.append(problems)
        limit = settings.limits.tilt_rad
        return rng.uniform(-limit, limit, start_rad.shape)

    controller = SearchingController(DRAWN[index], N, anywhere)
    for _ in range(2):
        step = controller.step(*inputs(rng))
        cost, gradient = seen[-1].evaluate(step.plan_rad)
        good = step.status == 0  # the others are out of these settings' ranges
        assert np.any(good)
        least = 1e-9 * np.abs(gradient).max()
        np.testing.assert_allclose(cost[good], step.cost[good], rtol=1e-9)
        np.testing.assert_allclose(gradient[good], step.gradient[good], rtol=1e-9, atol=least)
        np.testing.assert_array_equal(seen[-1].cost(step.plan_rad), cost)


@pytest.mark.parametrize("settings", [presets.load("table1"), ONE_NORM], ids=["no lag", "lag"])
def test_no_plan_is_cheaper_than_the_optimum(settings: Settings) -> None:
    """The optimum is within the limit and costs no more than the controller's plan and nearby plans."""
    rng = np.random.default_rng(1)
    controller, model = ReferenceController(Design(settings), N), CostModel(settings)
    limit = settings.limits.tilt_rad
    last = np.zeros((N, 2))
    for _ in range(3):
        known = inputs(rng)
        problems, step = model.problems(*known, last), controller.step(*known)
        last = step.command_rad
        best = problems.optima()
        least = problems.cost(best) * (1 - 1e-8)
        assert np.all(np.abs(best) <= limit * (1 + 1e-9))
        assert np.all(least <= problems.cost(step.plan_rad))
        for size in (1e-3, 1e-1):
            beside = np.clip(best + size * rng.normal(0, 1, best.shape), -limit, limit)
            assert np.all(least <= problems.cost(beside))


def test_searches_are_ordered_by_what_they_find() -> None:
    """The best iterate costs no more than first and last, the optimum no more than the best iterate."""
    settings, rng = ONE_NORM, np.random.default_rng(2)
    problems = CostModel(settings).problems(*inputs(rng), rng.uniform(-0.2, 0.2, (N, 2)))
    level = np.zeros((N, settings.horizon.control, 2))
    best_rad = optimum(settings, problems, level)
    for start in (level, best_rad):
        last = problems.cost(rprop(settings).minimize(problems.evaluate, start).moves_rad)
        best = problems.cost(best_iterate(settings, problems, start))
        assert np.all(best <= np.minimum(last, problems.cost(start)))
        assert np.all(problems.cost(best_rad) <= best * (1 + 1e-8))
        assert np.any(best < last) == (start is best_rad)
    from_best = from_zero_moves(settings, problems, best_rad)
    np.testing.assert_array_equal(from_best, rprop(settings).minimize(problems.evaluate, level).moves_rad)


@pytest.mark.parametrize("name", PRESETS)
def test_the_first_row_is_the_preset_as_it_is(name: str) -> None:
    """The first row is the preset unchanged; the others differ from it only in the search."""
    first, *others = entrants(name).values()
    assert first.settings == presets.load(name)
    assert first.searching is None
    for other in others:
        rest = {"optimizer"}
        assert other.settings.model_dump(exclude=rest) == first.settings.model_dump(exclude=rest)
        assert other not in (first, *(one for one in others if one is not other))
