"""Instructions and modelled cycles of a flight on an emulated core, and a search for a dearer step."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Final

import numpy as np
from pydantic import Field

from mambo_codegen.boards import FlashWait
from mambo_codegen.methods import method_of
from mambo_codegen.methods.one_norm.controller import OneNormStep
from mambo_codegen.settings.model import Settings
from mambo_sil.board.emulated import EmulatedController
from mambo_sil.board.firmware.elf import load
from mambo_sil.board.footprint.cycles import CycleModel, ModelledCycles
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import STEP_S
from mambo_sil.errors import FlightError
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.trajectories import Bernoulli

HARNESS: Final = (
    "nmpc_batch_init",
    "nmpc_batch_step",
    "nmpc_batch_instance_bytes",
    "nmpc_last_cost",
    "nmpc_last_iterations",
    "nmpc_has_converged",
    "nmpc_is_saturated",
)
"""Functions of the test harness, which are not part of a step."""


FLIGHT: Final = Bernoulli(2.0, 0.5)
"""The figure of eight of Table II, from rest at its centre: the first ticks have the largest errors."""


@dataclass(frozen=True, eq=False)
class CountedStep:
    """One step: its inputs, the instance before it, status, what it took; thrust is None with a height.

    `cycles` is None without a model of the core.
    """

    state: FloatArray
    target: FloatArray
    thrust: FloatArray | None
    before: bytes
    accepted: bool
    by_function: Counter[str]
    cycles: ModelledCycles | None

    @property
    def instructions(self) -> int:
        """All instructions of the step."""
        return self.by_function.total()


@dataclass(frozen=True)
class CycleCounts:
    """Modelled cycles of the same ticks without wait states, and the most of those and of the search's steps.

    `fewest` and `most_with_wait` are the bounds of the most expensive step: the least that the manual allows
    without wait states, and the most with a flash whose caches are empty when the step begins.
    """

    least: int
    mean: float
    most_met: int
    fewest: int
    most_with_wait: int

    @staticmethod
    def of(flown: Sequence[ModelledCycles], searched: Sequence[ModelledCycles]) -> "CycleCounts":
        """Summarise the ticks of the flight and the steps of the search."""
        usual = [one.without_wait.usual for one in flown]
        dearest = max((*flown, *searched), key=lambda one: one.without_wait.usual)
        return CycleCounts(
            least=min(usual),
            mean=float(np.mean(usual)),
            most_met=dearest.without_wait.usual,
            fewest=dearest.without_wait.fewest,
            most_with_wait=max(one.most for one in (*flown, *searched)),
        )


@dataclass(frozen=True)
class InstructionCounts:
    """Instructions of consecutive ticks of a flight, and the most of those and of the search's steps.

    `cycles` is None without a model of the core. `by_function` has the mean of each function over the ticks,
    largest first. Neither is in the record of the instructions in a summary.
    """

    ticks: int
    searched: int
    least: int
    mean: float
    most_met: int
    cycles: Annotated[CycleCounts | None, Field(exclude=True)] = None
    by_function: Annotated[dict[str, float], Field(exclude=True)] = field(default_factory=dict)


class CountingController:
    """One emulated controller that counts what each step takes; `steps` has all of them.

    `modelled` says whether cycles are modelled as well, with the wait states of `flash`.
    """

    def __init__(
        self,
        settings: Settings,
        elf: Path,
        core: str,
        *,
        modelled: bool = False,
        flash: FlashWait | None = None,
    ) -> None:
        self._emulated = EmulatedController(settings, elf, core, counting=True)
        self.settings = settings
        image = load(elf)
        self._name_of = lru_cache(None)(lambda address: image.name_of(address).partition("+")[0])
        self._model = CycleModel(image, core, flash) if modelled else None
        self.steps: list[CountedStep] = []

    def report_thrust(self, thrust_m_s2: FloatArray) -> None:
        """Tell a controller of the height what the drone got; it is not part of a step."""
        self._emulated.report_thrust(thrust_m_s2)

    def step(self, state: FloatArray, target: FloatArray, thrust: FloatArray | None = None) -> OneNormStep:
        """Step once with state (1, k), target (1, m) and, without a height, thrust over mass (1,)."""
        before = self._emulated.save()
        self._emulated.machine.take_executed()
        outcome: OneNormStep = self._emulated.step(state, target, thrust)
        executed = self._emulated.machine.take_executed().only(self._is_of_a_step)
        by_function: Counter[str] = Counter()
        for address, times in executed.times.items():
            by_function[self._name_of(address)] += times
        self.steps.append(
            CountedStep(
                state=state,
                target=target,
                thrust=thrust,
                before=before,
                accepted=not outcome.status[0],
                by_function=by_function,
                cycles=None if self._model is None else self._model.cycles(executed),
            )
        )
        return outcome

    def _is_of_a_step(self, address: int) -> bool:
        """Say whether an address of code or of its constants is not the harness's."""
        return self._name_of(address) not in HARNESS

    def retry(self, step: CountedStep, state: FloatArray, target: FloatArray) -> CountedStep:
        """Repeat an earlier step from the instance before it, with another state (1, k) and target (1, m)."""
        self._emulated.restore(step.before)
        self.step(state, target, step.thrust)
        return self.steps.pop()


def counted_flight(settings: Settings, ticks: int) -> Flight:
    """Return the flight of `ticks` updates of `FLIGHT` from its start."""
    period_s = STEP_S * max(1, round(settings.horizon.update_period_s / STEP_S))
    return Flight(FLIGHT, duration_s=(ticks - 1) * period_s, update_period_s=period_s)


def count_instructions(
    settings: Settings,
    elf: Path,
    core: str,
    ticks: int,
    search_steps: int,
    *,
    modelled: bool = False,
    flash: FlashWait | None = None,
) -> InstructionCounts:
    """Fly the `counted_flight`, then search from the most expensive of them.

    A refused tick returns early and does not count; raises FlightError if all are refused.
    """
    controller = CountingController(settings, elf, core, modelled=modelled, flash=flash)
    fly(counted_flight(settings, ticks), controller)
    flown = [step for step in controller.steps if step.accepted]
    if not flown:
        raise FlightError("the controller refuses every tick of the flight, which is beyond its [ranges]")
    totals = [step.instructions for step in flown]
    sums = sum((step.by_function for step in flown), Counter[str]())
    searched = _search(controller, flown, search_steps, limited=method_of(settings).limiting is not None)
    cycles, further = ([one.cycles for one in steps if one.cycles] for steps in (flown, searched))
    return InstructionCounts(
        ticks=len(flown),
        searched=search_steps,
        least=min(totals),
        mean=float(np.mean(totals)),
        most_met=max(step.instructions for step in (*flown, *searched)),
        cycles=CycleCounts.of(cycles, further) if cycles else None,
        by_function={name: total / len(flown) for name, total in sums.most_common()},
    )


def _search(
    controller: CountingController, flown: Sequence[CountedStep], search_steps: int, *, limited: bool
) -> list[CountedStep]:
    """Return the accepted steps of a search for more instructions from the most expensive tick on.

    Hill climbing: each step starts from the controller's instance at that tick, with its plan, and changes
    one component of the state; a change that costs at least as much is kept. With limits, which act for far
    and fast targets only, it may be a component of the target instead.
    """
    rng = np.random.default_rng(0)
    best = max(flown, key=lambda step: step.instructions)
    searched = []
    for _ in range(search_steps):
        state, target = best.state.copy(), best.target.copy()
        columns = state.shape[1]
        index = rng.integers(columns + (4 if limited else 0))
        if index < columns:
            state[0, index] += rng.normal() * 10.0 ** rng.uniform(-4, 0)
        else:
            target[0, index - columns] += rng.normal() * 10.0 ** rng.uniform(-1, 1)
        tried = controller.retry(best, state, target)
        if tried.accepted:
            searched.append(tried)
            if tried.instructions >= best.instructions:
                best = tried
    return searched
