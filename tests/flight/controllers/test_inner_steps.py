"""The optimizer's inner steps: watching them changes no bit, and they are those that the plan shows."""

from typing import Any

import numpy as np
import pytest

from mambo_codegen.methods.one_norm.controller import OneNormController, OneNormMemory, OneNormStep
from mambo_codegen.methods.one_norm.method import OneNorm
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.flight.controllers.inner_steps import InnerSteps, WatchedController
from mambo_sil.verify.step_inputs import random_inputs
from tests.support.cases import SCALARS
from tests.support.one_norm import ONE_NORM

MAMBO = ONE_NORM
SETTINGS = {scalar: with_option(MAMBO, "code.scalar", scalar) for scalar in SCALARS}
N = 300


def inputs(settings: Settings) -> tuple[Any, Any, Any]:
    """Draw state, target and thrust of N steps."""
    drawn = random_inputs(settings, N, np.random.default_rng(0))
    return drawn.state, drawn.target, drawn.thrust


def step_watched(
    settings: Settings, memory: OneNormMemory, state: Any, target: Any, thrust: Any
) -> tuple[OneNormStep, InnerSteps]:
    """OneNormStep N reference controllers once from `memory`; returns the step and its iterations."""
    watched = WatchedController(settings, N)
    watched.controller.memory = memory
    step = watched.step(state, target, thrust)
    return step, watched.steps[-1]


@pytest.mark.parametrize("settings", [*SETTINGS.values(), presets.load("table1")], ids=[*SETTINGS, "table1"])
def test_watching_changes_no_bit(settings: Settings) -> None:
    """The watched step is the step, and the last iteration it saw is the one that the step reports."""
    plain = OneNormController(OneNorm(settings), N)
    for _ in range(2):
        memory = plain.memory
        expected = plain.step(*inputs(settings))
        step, inner = step_watched(settings, memory, *inputs(settings))
        for name in ("status", "command_rad", "cost", "gradient", "plan_rad", "iterations", "converged"):
            assert getattr(step, name).tobytes() == getattr(expected, name).tobytes(), name
        good = step.status == Status.OK
        assert len(inner.cost) == settings.optimizer.iterations
        assert np.array_equal(inner.cost[-1][good], step.cost[good])
        assert np.array_equal(inner.gradient[-1][good], step.gradient[good])


@pytest.mark.parametrize("scalar", SCALARS)
def test_step_sizes_are_the_changes_of_the_plan(scalar: str) -> None:
    """Each iteration moves the plan against the slope by its step size, up to the limit, or undoes a move."""
    settings = with_option(SETTINGS[scalar], "limits.tilt_rad", 0.02)
    _, inner = step_watched(settings, OneNormController(OneNorm(settings), N).memory, *inputs(settings))
    plan, sizes = inner.plan_rad, inner.step_sizes_rad(settings)
    limit = plan.dtype.type(OneNorm(settings).tilt_limit_rad)
    forward = np.clip(plan - inner.decisions(settings) * sizes, -limit, limit)
    np.testing.assert_array_equal(plan[1], forward[0])
    shrank = (np.diff(sizes, axis=0) < 0)[:-1]
    np.testing.assert_array_equal(plan[2:], np.where(shrank, plan[:-2], forward[1:-1]))
    assert np.count_nonzero(shrank) > 20
    assert np.any(np.abs(plan) == limit)


@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_after_convergence_all_decisions_are_zero(scalar: str) -> None:
    """With a huge tolerance every cost after the first has converged."""
    settings = with_option(SETTINGS[scalar], "optimizer.tolerance", 1e6)
    step, inner = step_watched(settings, OneNormController(OneNorm(settings), N).memory, *inputs(settings))
    decisions = inner.decisions(settings)[:, (step.status == Status.OK) & (inner.cost[0] < 1e5)]
    assert decisions[0].any()
    assert not decisions[1:].any()
