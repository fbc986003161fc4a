"""What a better search buys in flight: more iterations, the best iterate, another start, the exact optimum.

Prints Markdown tables: a preset that sees the truth, the same through sensors and estimators, and the exact
optimum with other effort weights. Settings fly as compiled C in float32; what is no setting flies as the
reference in float64, with another search (`benchmarks.optimum`). Some five minutes on two processors.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any, Final

import numpy as np

from benchmarks.optimum import Searching, SearchingController, best_iterate, from_level, optimum
from codegen import boards, presets
from codegen.settings import Settings
from sil.arrays import FloatArray
from sil.campaign.flights import crashed
from sil.compiled import CompiledController
from sil.footprint import measure_footprint
from sil.gusts import LIGHT_M_S
from sil.loop import PositionController, fly
from sil.metrics import Metrics, measure
from sil.scenario import Scenario, flight_of
from sil.traces import SensedTrace

BOARD: Final = "crazyflie"
SEEDS: Final = 8
SENSED_S: Final = 40.0
MILLIMETRE: Final = 1e-3

TABLE_2: Final = tuple(
    Scenario(start_offset_m=(x, y, 0.0)) for x, y in ((0.0, 0.0), (MILLIMETRE, 0.0), (0.0, MILLIMETRE))
)
"""The Table II case, 100 s; the two others start a millimetre beside, to show what chance does."""
TRUTH: Final = (
    *TABLE_2,
    Scenario(wind_m_s2=(0.5, 0.0)),
    Scenario(wind_m_s2=(0.0, 0.5)),
    Scenario(motor_lag_s=0.03),
)
SENSED: Final = tuple(
    Scenario(seed=seed, duration_s=SENSED_S, sensors="mambo-derotated", wind_speed_m_s=wind)
    for wind in (0.0, LIGHT_M_S)
    for seed in range(SEEDS)
)
"""Noise alone, then noise and gusts, of the same seeds."""


@dataclass(frozen=True)
class Entrant:
    """A preset, and how it is changed or searched otherwise.

    iterations, warm_start, effort_weight: None leaves that of the preset.
    """

    preset: str
    title: str
    iterations: int | None = None
    warm_start: str | None = None
    effort_weight: float | None = None
    searching: Searching | None = None

    def settings(self) -> Settings:
        """Return the settings it flies with."""
        settings = presets.load(self.preset)
        optimizer = {"iterations": self.iterations, "warm_start": self.warm_start}
        return settings.model_copy(
            update={
                "optimizer": settings.optimizer.model_copy(update=_given(optimizer)),
                "cost": settings.cost.model_copy(update=_given({"effort_weight": self.effort_weight})),
            }
        )

    def controller(self, n: int) -> PositionController:
        """Return n controllers."""
        if self.searching is None:
            return CompiledController(self.settings(), n)
        return SearchingController(self.settings(), n, self.searching)


def _given(values: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value is not None}


@dataclass(frozen=True)
class Flown:
    """What became of the flights of a world; `seen_iae_m_s` is as the estimators show it."""

    metrics: Metrics
    seen_iae_m_s: FloatArray
    crashed: int


def fly_world(entrant: Entrant, world: Sequence[Scenario]) -> Flown:
    """Fly all flights of a world at once."""
    flight = flight_of(world, entrant.settings().horizon.update_period_s)
    trace = fly(flight, entrant.controller(len(world)))
    seen = trace.as_seen() if isinstance(trace, SensedTrace) else trace
    return Flown(measure(trace), measure(seen).iae_m_s, int(crashed(trace).sum()))


def instructions(entrant: Entrant) -> str:
    """Count the instructions of a step on the board, mean and most; of what has C."""
    if entrant.searching is not None:
        return "-"
    counts = measure_footprint(entrant.settings(), boards.load(BOARD)).counts
    return "-" if counts is None else f"{counts.mean:.0f}, {counts.most}"


def entrants(preset: str) -> list[Entrant]:
    """Return a preset as it is, and with every other search."""
    kept = presets.load(preset).optimizer.warm_start
    other = {"plan": "last_command", "last_command": "plan"}[kept]
    beside = f"from the {other.replace('_', ' ').replace('plan', 'last plan')}"
    return [
        *(Entrant(preset, f"{k} iterations", k) for k in (5, 10, 20)),
        *(Entrant(preset, f"best of {k}", k, searching=best_iterate) for k in (5, 20)),
        *(Entrant(preset, f"{k}, {beside}", k, other) for k in (5, 20)),
        *(Entrant(preset, f"{k}, from level", k, searching=from_level) for k in (5, 20)),
        Entrant(preset, "exact optimum", searching=optimum),
    ]
