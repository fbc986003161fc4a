"""Exact instruction counts of control steps on an emulated core, and a search for the worst case."""

from collections import Counter
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.controllers.emulated import EmulatedController
from mambo_nmpc.sil.firmware.elf import load
from mambo_nmpc.sil.flight.traces import Trace
from mambo_nmpc.sil.plant.arrays import FloatArray

HARNESS: Final = (
    "nmpc_batch_init",
    "nmpc_batch_step",
    "nmpc_batch_instance_bytes",
    "nmpc_last_cost",
    "nmpc_last_iterations",
    "nmpc_has_converged",
)
"""Functions of the test harness, which are not part of a step."""


@dataclass(frozen=True)
class InputSequence:
    """Inputs of k consecutive steps of one controller: state (k, 7), target (k, 4), thrust (k,), m/s2."""

    state: FloatArray
    target: FloatArray
    thrust: FloatArray

    def __add__(self, other: "InputSequence") -> "InputSequence":
        return InputSequence(
            np.concatenate([self.state, other.state]),
            np.concatenate([self.target, other.target]),
            np.concatenate([self.thrust, other.thrust]),
        )


@dataclass(frozen=True)
class InstructionCounts:
    """Instructions of the accepted steps; `by_function` has the mean of each function, largest first."""

    steps: int
    least: int
    mean: float
    most: int
    by_function: Annotated[dict[str, float], Field(exclude=True)] = field(default_factory=dict)
    """Mean of a step, most first; not in a summary."""


class CountingController:
    """One emulated controller that counts the instructions of each step."""

    def __init__(self, settings: Settings, elf: Path, core: str) -> None:
        self._emulated = EmulatedController(settings, elf, core, counting=True)
        image = load(elf)
        self._name_of = lru_cache(None)(image.name_of)

    def step(self, state: FloatArray, target: FloatArray, thrust: float) -> tuple[int, Counter[str]]:
        """Step once with state (7,), target (4,), thrust; returns the status and the counts by function."""
        self._emulated.machine.take_counts()
        outcome = self._emulated.step(state[None], target[None], [thrust])
        by_function: Counter[str] = Counter()
        for address, instructions in self._emulated.machine.take_counts().items():
            name = self._name_of(address).partition("+")[0]
            if name not in HARNESS:
                by_function[name] += instructions
        return int(outcome.status[0]), by_function


def sample_flight(trace: Trace, every: int) -> InputSequence:
    """Return every `every`-th controller input of the first flight of a trace."""
    chosen = slice(0, None, every)
    state = np.concatenate(
        [trace.position_m[chosen, 0, :2], trace.velocity_m_s[chosen, 0, :2], trace.euler_rad[chosen, 0]],
        axis=1,
    )
    return InputSequence(state, trace.target[chosen, 0], trace.thrust_acceleration_m_s2[chosen, 0])


def draw_inputs(settings: Settings, count: int) -> InputSequence:
    """Draw random inputs: errors from millimetres to the input ranges, on a log scale, and any heading."""
    rng = np.random.default_rng(0)
    ranges = settings.ranges
    scale = 10.0 ** rng.uniform(-3, 3, (count, 1))
    bounds = np.array([ranges.position_m] * 2 + [ranges.velocity_m_s] * 2)
    target = np.clip(rng.normal(0, 1, (count, 4)), -bounds, bounds)
    state = np.clip(target + scale * rng.normal(0, 1, (count, 4)), -bounds, bounds)
    attitude = rng.uniform(-1, 1, (count, 3)) * [0.5, 0.5, 1000.0]
    low, high = ranges.thrust_acceleration_min_m_s2, ranges.thrust_acceleration_max_m_s2
    return InputSequence(np.concatenate([state, attitude], axis=1), target, rng.uniform(low, high, count))


def count_instructions(
    settings: Settings, elf: Path, core: str, inputs: InputSequence, search_steps: int
) -> InstructionCounts:
    """Count the steps of `inputs`, then search from the most expensive for `search_steps` more.

    The search (hill climbing) changes one state component at a time and keeps inputs that cost at least as
    much. Refused inputs return early and are excluded.
    """
    controller = CountingController(settings, elf, core)
    totals: list[int] = []
    sums: Counter[str] = Counter()

    def cost(state: NDArray[np.float64], target: NDArray[np.float64], thrust: float) -> int:
        status, by_function = controller.step(state, target, thrust)
        if status != 0:
            return 0
        sums.update(by_function)
        totals.append(by_function.total())
        return totals[-1]

    costs = [
        cost(state, target, float(thrust))
        for state, target, thrust in zip(inputs.state, inputs.target, inputs.thrust, strict=True)
    ]
    rng = np.random.default_rng(0)
    start = int(np.argmax(costs))
    state, target, thrust = inputs.state[start], inputs.target[start], float(inputs.thrust[start])
    best = costs[start]
    for _ in range(search_steps):
        tried = state.copy()
        tried[rng.integers(7)] += rng.normal() * 10.0 ** rng.uniform(-4, 0)
        found = cost(tried, target, thrust)
        if found >= best:
            state, best = tried, found
    return InstructionCounts(
        steps=len(totals),
        least=min(totals),
        mean=float(np.mean(totals)),
        most=max(totals),
        by_function={name: total / len(totals) for name, total in sums.most_common()},
    )
