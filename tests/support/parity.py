"""Compare the outcomes of two controllers bit for bit."""

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.methods.one_norm.controller import OneNormStep
from mambo_codegen.settings.model import Settings
from mambo_sil.verify.step_inputs import StepInputs, random_steps

FIELDS = ("status", "command_rad", "cost", "gradient", "plan_rad", "iterations", "converged")


class Controller(Protocol):
    """What reference and compiled controller share."""

    def reset(self, command_rad: ArrayLike) -> NDArray[np.int64]:
        """Start over."""

    def set_weights(self, weights: ArrayLike) -> NDArray[np.int64]:
        """Replace the weights."""

    def step(self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike) -> OneNormStep:
        """Compute the next commands."""


def inputs_of_steps(settings: Settings, n: int, steps: int, seed: int) -> list[StepInputs]:
    """Draw the inputs of consecutive steps of n controllers."""
    return random_steps(settings, n, steps, np.random.default_rng(seed))


class Run(NamedTuple):
    """What a controller answered: the statuses of its setters, and the outcome of every step."""

    setters: list[NDArray[np.int64]]
    steps: list[OneNormStep]


def run(controller: Controller, inputs: list[StepInputs], seed: int) -> Run:
    """Step a fresh controller through `inputs`, reset and reweighted halfway, bad values among the good."""
    rng = np.random.default_rng(seed)
    setters: list[NDArray[np.int64]] = []
    steps: list[OneNormStep] = []
    for index, case in enumerate(inputs):
        if index == len(inputs) // 2:
            n = len(case.thrust)
            command = rng.uniform(-1.5, 1.5, (n, 2))
            command[::5, 0] = rng.choice([np.nan, np.inf, 4.0, -4.0], len(command[::5]))
            weights = 10.0 ** rng.uniform(-2, 6, (n, 2))
            weights[3::7] = rng.choice([0.0, 1e6], weights[3::7].shape)
            weights[::7, 1] = rng.choice([-1.0, np.nan, np.inf, 1.1e6], len(weights[::7]))
            setters += [controller.reset(command), controller.set_weights(weights)]
        steps.append(controller.step(case.state, case.target, case.thrust))
    return Run(setters, steps)


def differences(a: Run, b: Run) -> dict[str, int]:
    """Count by field the values that differ in any bit; empty when there are none."""
    counts = {
        name: count_differing([getattr(s, name) for s in a.steps], [getattr(s, name) for s in b.steps])
        for name in FIELDS
    }
    counts["setters"] = count_differing(a.setters, b.setters)
    return {name: count for name, count in counts.items() if count}


def count_differing(ours: list[NDArray[Any]], theirs: list[NDArray[Any]]) -> int:
    """Count the values of equally many arrays that differ in any bit."""
    return sum(_differing(a, b) for a, b in zip(ours, theirs, strict=True))


def _differing(a: NDArray[Any], b: NDArray[Any]) -> int:
    assert a.dtype == b.dtype
    assert a.shape == b.shape
    if a.tobytes() == b.tobytes():
        return 0
    raw = [np.ascontiguousarray(values).view(np.uint8).reshape(-1, a.dtype.itemsize) for values in (a, b)]
    return int(np.any(raw[0] != raw[1], axis=1).sum())
