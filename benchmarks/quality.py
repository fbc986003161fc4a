"""Effect of the search on flights: more iterations, the best iterate, other initial plans, the exact optimum.

Prints Markdown tables: each preset with true states and with sensors; then other effort weights. Searches
that are settings fly as compiled C in float32, others as the reference in float64 with a search of
`benchmarks.searches`. Takes about six minutes on two processors.
"""

import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Final

import numpy as np

from benchmarks.markdown import table
from benchmarks.ours import ONE_NORM
from benchmarks.searches import Searching, SearchingController, best_iterate, from_zero_moves, optimum
from mambo_codegen import boards
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.board.footprint.measure import measure_footprint
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.gusts import LIGHT_M_S
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.crashes import detect_crashes
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import PositionController
from mambo_sil.flight.metrics import measure
from mambo_sil.flight.scenario import Scenario, flight_of
from mambo_sil.flight.traces import SensedTrace, Trace

PRESETS: Final = ("table1", "mambo-1norm")
EFFORT_WEIGHTS: Final = (1.0, 100.0, 200.0, 300.0, 1000.0)
STARTS: Final = {"last_command": "last command", "plan": "last plan"}
EXACT: Final = "exact optimum"
BOARD: Final = "crazyflie"
BESIDE_M: Final = ((0.0, 0.0), (1e-3, 0.0), (0.0, 1e-3))
SEEDS: Final = 8
SENSED_S: Final = 40.0

TRUTH: Final = (
    *(Scenario(start_offset_m=(x, y, 0.0)) for x, y in BESIDE_M),
    Scenario(wind_m_s2=(0.5, 0.0)),
    Scenario(wind_m_s2=(0.0, 0.5)),
    Scenario(motor_lag_s=0.03),
)
"""100 s each: the Table II case, two that start 1 mm beside it, steady wind along x and y, a motor lag."""
SENSED: Final = tuple(
    Scenario(seed=seed, duration_s=SENSED_S, sensors="mambo-derotated", wind_speed_m_s=wind)
    for wind in (0.0, LIGHT_M_S)
    for seed in range(SEEDS)
)
"""Sensor noise, then sensor noise and gusts with the same seeds."""


@dataclass(frozen=True)
class Variant:
    """Settings, and a search that replaces the controller's, if any."""

    settings: Settings
    searching: Searching | None = None

    def controller(self, n: int) -> PositionController:
        """Return n controllers."""
        if self.searching is None:
            return CompiledController(self.settings, n)
        return SearchingController(self.settings, n, self.searching)


def entrants(preset: str) -> dict[str, Variant]:
    """Return a preset with each search, by title."""
    settings = presets.load(preset)
    kept = settings.optimizer.warm_start
    other = next(start for start in STARTS if start != kept)

    def tried(iterations: int, searching: Searching | None = None, start: str = kept) -> Variant:
        started = with_option(settings, "optimizer.warm_start", start)
        return Variant(with_option(started, "optimizer.iterations", iterations), searching)

    return {
        **{f"{k} iterations, from the {STARTS[kept]}": tried(k) for k in (5, 10, 20)},
        **{f"{k}, the best iterate": tried(k, best_iterate) for k in (5, 20)},
        **{f"{k}, from the {STARTS[other]}": tried(k, start=other) for k in (5, 20)},
        **{f"{k}, from zero moves": tried(k, from_zero_moves) for k in (5, 20)},
        EXACT: Variant(settings, optimum),
    }


def by_weight() -> dict[tuple[str, str], Variant]:
    """Return `mambo` with each effort weight, each with three searches, by two titles."""
    mambo = ONE_NORM
    several = {
        f"mambo, {weight:g}": with_option(mambo, "cost.effort_weight", weight) for weight in EFFORT_WEIGHTS
    }
    found = {}
    for title, settings in several.items():
        for k in (settings.optimizer.iterations, 20):
            found[title, f"{k} iterations"] = Variant(with_option(settings, "optimizer.iterations", k))
        found[title, EXACT] = Variant(settings, optimum)
    return found


def fly_world(variant: Variant, world: Sequence[Scenario]) -> Trace:
    """Fly all flights of a world as one batch."""
    flight = flight_of(world, variant.settings.horizon.update_period_s)
    return fly(flight, variant.controller(len(world)))


def instructions(variant: Variant) -> str:
    """Return mean and most met instructions of a step on the board, "-" for a search without C."""
    if variant.searching is not None:
        return "-"
    counts = measure_footprint(variant.settings, boards.load(BOARD)).counts
    return "-" if counts is None else f"{counts.mean:.0f}, {counts.most_met}"


def _digits(value: float) -> str:
    return f"{value:#.3g}".rstrip(".")


def _mean(values: FloatArray) -> str:
    """Format a mean and its standard error."""
    error = values.std(ddof=1) / np.sqrt(len(values))
    return f"{_digits(values.mean())} ± {error:.2g}"


def fly_with_true_states(variant: Variant) -> dict[str, str]:
    """Fly `TRUTH`; returns cells by column."""
    found, beside = measure(fly_world(variant, TRUTH)), len(BESIDE_M)
    iae, variation = found.iae_m_s, found.command_variation_rad
    return {
        "IAE": _digits(iae[0]),
        "started 1 mm off": ", ".join(map(_digits, iae[1:beside])),
        "ISE": _digits(found.ise_m2_s[0]),
        "ITAE": _digits(found.itae_m_s2[0]),
        "variation": f"{variation[0]:.4f}",
        "wind along x: IAE": _digits(iae[beside]),
        "along y": _digits(iae[beside + 1]),
        "motor lag: IAE": _digits(iae[beside + 2]),
        "motor lag: variation": f"{variation[-1]:.4f}",
    }


def fly_with_sensors(variant: Variant) -> dict[str, str]:
    """Fly `SENSED`; returns cells by column. "estimated" is the IAE of the estimated position."""
    trace = fly_world(variant, SENSED)
    assert isinstance(trace, SensedTrace)
    found, seen = measure(trace), measure(trace.as_seen())
    cells = {}
    for world, case in (("noise", slice(0, SEEDS)), ("gusts", slice(SEEDS, None))):
        cells[f"{world}: IAE"] = _mean(found.iae_m_s[case])
        cells[f"{world}: estimated"] = _mean(seen.iae_m_s[case])
        cells[f"{world}: variation"] = f"{found.command_variation_rad[case].mean():.4f}"
    return cells | {"crashed": f"{detect_crashes(trace).sum()}"}


def main() -> None:
    """Fly everything in parallel processes and print the tables."""
    searched = {preset: entrants(preset) for preset in PRESETS}
    weighted = by_weight()
    with_every_search = {one for several in searched.values() for one in several.values()}
    everyone = list(with_every_search.union(weighted.values()))
    with ProcessPoolExecutor(os.cpu_count(), get_context("spawn")) as pool:
        counted = {one: pool.submit(instructions, one) for one in with_every_search}
        truth = dict(zip(everyone, pool.map(fly_with_true_states, everyone), strict=True))
        sensed = dict(zip(everyone, pool.map(fly_with_sensors, everyone), strict=True))
        count = {one: counting.result() for one, counting in counted.items()}
    for preset, several in searched.items():
        rows = [
            {"search": title, "instructions: mean, most met": count[one]} | truth[one]
            for title, one in several.items()
        ]
        print(f"`{preset}`, with true states:\n\n{table(rows)}\n")
        rows = [{"search": title} | sensed[one] for title, one in several.items()]
        print(f"`{preset}`, with sensors:\n\n{table(rows)}\n")
    rows = [
        {"preset, effort weight": preset, "search": search}
        | {name: truth[one][name] for name in ("IAE", "variation")}
        | sensed[one]
        for (preset, search), one in weighted.items()
    ]
    print(f"Other effort weights:\n\n{table(rows)}")


if __name__ == "__main__":
    main()
