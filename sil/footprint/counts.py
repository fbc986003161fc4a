"""Exact instruction counts of one control step on an emulated core, and a search for the worst input."""

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
"""Functions that run around a step and are not part of it."""


@dataclass(frozen=True)
class InputSequence:
    """Inputs of consecutive steps of one controller: state (k, 7), target (k, 4), thrust (k,)."""

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
    """Instructions of the good steps among those counted."""

    steps: int
    least: int
    mean: float
    most: int
    by_function: Annotated[dict[str, float], Field(exclude=True)] = field(default_factory=dict)
    """Mean of a step, most first; not in a summary."""


class CountingController:
    """One emulated controller whose instructions are counted, step by step."""

    def __init__(self, settings: Settings, elf: Path, core: str) -> None:
        self._emulated = EmulatedController(settings, elf, core, counting=True)
        image = load(elf)
        self._name_of = lru_cache(None)(image.name_of)

    def step(self, state: FloatArray, target: FloatArray, thrust: float) -> tuple[int, Counter[str]]:
        """Step once; returns the status and the instructions by function."""
        self._emulated.machine.counted()
        outcome = self._emulated.step(state[None], target[None], [thrust])
        by_function: Counter[str] = Counter()
        for address, instructions in self._emulated.machine.counted().items():
            name = self._name_of(address).partition("+")[0]
            if name not in HARNESS:
                by_function[name] += instructions
        return int(outcome.status[0]), by_function


def in_flight(trace: Trace, every: int) -> InputSequence:
    """Take every so many-th input that the first flight of a trace gave its controller."""
    chosen = slice(0, None, every)
    state = np.concatenate(
        [trace.position_m[chosen, 0, :2], trace.velocity_m_s[chosen, 0, :2], trace.euler_rad[chosen, 0]],
        axis=1,
    )
    return InputSequence(state, trace.target[chosen, 0], trace.thrust_acceleration_m_s2[chosen, 0])


def spread(settings: Settings, count: int) -> InputSequence:
    """Draw inputs from millimetres off the target to the ends of all ranges, heading anywhere."""
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
    """Count the steps of `inputs`, then climb from the most expensive one for `search_steps` more.

    The climb changes one input at a time and keeps what costs more, or as much: the maximum is searched
    for, not met by chance. Refused inputs, which cost next to nothing, do not count.
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
