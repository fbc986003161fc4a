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


@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_moves_follow_decisions_and_step_sizes(scalar: str) -> None:
    """A decision that repeats the one before moves against the slope by the step size, up to the limit."""
    settings = SETTINGS[scalar]
    _, inner = step_watched(settings, OneNormController(OneNorm(settings), N).memory, *inputs(settings))
    decisions, sizes = inner.decisions(settings).astype(np.int64), inner.step_sizes_rad(settings)
    moved_rad = np.diff(inner.plan_rad.astype(np.float64), axis=0)
    assert np.array_equal(np.sign(moved_rad[0]), -decisions[0])  # from level, far from the limit
    assert sizes.dtype == inner.plan_rad.dtype
    onward = (decisions[1:-1] * decisions[:-2]) > 0
    inside = np.abs(inner.plan_rad[2:]) < settings.limits.tilt_rad * 0.99
    chosen = onward & inside
    assert chosen.sum() > N
    expected_rad = -decisions[1:-1] * sizes[1:-1].astype(np.float64)
    assert np.allclose(moved_rad[1:][chosen], expected_rad[chosen], rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_after_convergence_all_decisions_are_zero(scalar: str) -> None:
    """With a huge tolerance every cost after the first has converged."""
    settings = with_option(SETTINGS[scalar], "optimizer.tolerance", 1e6)
    step, inner = step_watched(settings, OneNormController(OneNorm(settings), N).memory, *inputs(settings))
    decisions = inner.decisions(settings)[:, (step.status == Status.OK) & (inner.cost[0] < 1e5)]
    assert decisions[0].any()
    assert not decisions[1:].any()
