"""Iterations until a plan is near the optimum, and what they take: `python -m benchmarks.iterations`.

It prints the excess of the plan's cost over the exact optimum (a linear program) by iterations, for the
peers' model and preset mambo; then the time of an update beside DAQP with slacks, in one process in turns as
in `benchmarks.times`, and the instructions on a board. docs/evidence/benchmarks.md explains the tables.
"""

import os
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from benchmarks.markdown import table
from benchmarks.ours import ONE_NORM, PEERS_MODEL, bundle
from benchmarks.peers_setups import PEERS
from benchmarks.programs import BENCHMARKS, run_tool
from benchmarks.searches import Array, CostModel
from benchmarks.states import Inputs, state_sets
from benchmarks.times import prepare, time_all
from mambo_codegen import boards
from mambo_codegen.reference import Step
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_codegen.toolchain import host_toolchain
from mambo_sil.board.footprint.counts import FLIGHT
from mambo_sil.board.footprint.measure import measure_footprint
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.loop import Flight, fly

ITERATIONS: Final = (5, 10, 20, 40, 60, 100)
"""100 is the largest setting."""
TIMED: Final = (5, 20, 40, 100)
NEAR: Final = 0.01
"""Excess over the optimum that counts as solved."""
ROUNDS: Final = 4
FLAGS: Final = "-O2"
_FLIGHT_S: Final = 100.0
_SAMPLE: Final = {"W": 5, "T": 5, "F": 5, "C": 5, "flight": 20}
"""Every how many states the optimum is computed."""
_SLACKS: Final = "daqp-slacks"


class RecordingController:
    """One compiled controller that records input, last command (2,) and plan (control, 2) of every step."""

    def __init__(self, settings: Settings) -> None:
        self._compiled = CompiledController(settings)
        self._last_rad: Array = np.zeros(2)
        self._rows: list[tuple[Array, ...]] = []

    def start_from(self, last_rad: Array) -> None:
        """Make `last_rad` (2,) the last command and the plan."""
        self._compiled.reset(last_rad[None])
        self._last_rad = last_rad

    @property
    def last_rad(self) -> Array:
        """The last command (2,)."""
        return self._last_rad

    def step(self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike) -> Step:
        """Compute the next command from state (1, 7), target (1, 4) and thrust_acceleration_m_s2 (1,)."""
        step: Step = self._compiled.step(state, target, thrust_acceleration_m_s2)
        given = [np.array(each, np.float64)[0] for each in (state, target, thrust_acceleration_m_s2)]
        self._rows.append((*given, self._last_rad, np.array(step.plan_rad[0], np.float64)))
        self._last_rad = np.array(step.command_rad[0], np.float64)
        return step

    def excess(self, settings: Settings, every: int) -> Array:
        """Return the excess of the cost of every `every`-th plan over the optimum for the same input."""
        state, target, thrust, last, plan = map(np.stack, zip(*self._rows[::every], strict=True))
        problems = CostModel(settings).problems(state, target, thrust, last)
        found: Array = problems.cost(plan) / problems.cost(problems.optima()) - 1
        return found


def excess_of_set(settings: Settings, name: str, inputs: Inputs) -> Array:
    """Plan for the states of a set, along C with the controller's own last command; return the excess."""
    controller = RecordingController(settings)
    for x, vx, y, vy, *last in inputs.astype(np.float64):
        if name != "C":
            controller.start_from(np.array(last))
        tilt = controller.last_rad
        controller.step([[x, y, vx, vy, *tilt, 0.0]], np.zeros((1, 4)), [9.81])
    return controller.excess(settings, _SAMPLE[name])


def excess_of_flight(settings: Settings) -> Array:
    """Fly the Table II case with true states, and return the excess."""
    controller = RecordingController(settings)
    fly(Flight(FLIGHT, duration_s=_FLIGHT_S), controller)
    return controller.excess(settings, _SAMPLE["flight"])


def describe(excess: Array) -> str:
    """Return median and 90th percentile of the excess, and the share of states within `NEAR`."""
    median, high = np.percentile(100 * excess, [50, 90])
    return f"{_digits(median)} / {_digits(high)} %, {100 * np.mean(excess <= NEAR):.0f} %"


def _digits(value: float) -> str:
    return f"{value:,.0f}" if value >= 10 else f"{value:.2g}"


def quality_row(settings: Settings, sets: dict[str, Inputs], iterations: int) -> dict[str, str]:
    """Return the cells of one number of iterations."""
    float64 = with_option(settings, "code.scalar", "float64")
    tried = with_option(float64, "optimizer.iterations", iterations)
    cells = {"iterations": f"{iterations}"}
    cells |= {name: describe(excess_of_set(tried, name, inputs)) for name, inputs in sets.items()}
    return cells | {"flight": describe(excess_of_flight(tried))}


def times_table(sets: dict[str, Inputs]) -> str:
    """Time the peers' model at `TIMED` iterations and DAQP with slacks, and count instructions."""
    variants = {f"ours-{k}": with_option(PEERS_MODEL, "optimizer.iterations", k) for k in TIMED}
    programs: list[Any] = [bundle(name, name, settings) for name, settings in variants.items()]
    programs += [peer for peer in PEERS if peer.name == _SLACKS]
    with tempfile.TemporaryDirectory(prefix="mambo-nmpc-") as place:
        work = Path(place)
        prepared = list(map(partial(prepare, sets=sets, work=work), programs))
        libraries = {key: path for _, built, _ in prepared for key, path in built.items() if key[1] == FLAGS}
        timer = work / "timing.so"
        line = [*host_toolchain().command, "-O2", "-shared", "-fPIC", str(BENCHMARKS / "timing.c")]
        run_tool([*line, "-o", str(timer)])
        with ProcessPoolExecutor(1) as pool:
            timings, _ = pool.submit(time_all, timer, libraries, sets, ROUNDS).result()
    rows = []
    for name, settings in variants.items():
        counts = measure_footprint(settings, boards.load("crazyflie")).counts
        row = {
            "iterations": f"{settings.optimizer.iterations}",
            "instructions, Cortex-M4F": "-" if counts is None else f"{counts.mean:.0f}",
        }
        ours, slacks = timings[name, FLAGS], timings.get((_SLACKS, FLAGS))
        for one in sets:
            row[f"{one}, ns"] = f"{ours[one][0]:,.0f}"
            row[f"DAQP over this, {one}"] = "-" if slacks is None else f"{slacks[one][0] / ours[one][0]:.2g}"
        rows.append(row)
    return table(rows)


def main() -> None:
    """Print the tables."""
    sets = state_sets()
    for title, settings in (("the peers' model", PEERS_MODEL), ("mambo-1norm", ONE_NORM)):
        rows = [quality_row(settings, sets, iterations) for iterations in ITERATIONS]
        print(f"{title}, above the optimum, median / 90 %, and states within 1 %:\n\n{table(rows)}\n")
    before = os.getloadavg()[0]
    times = times_table({name: sets[name] for name in ("W", "C")})
    print(f"{FLAGS}, {ROUNDS} rounds, load {before:.1f} and {os.getloadavg()[0]:.1f}:\n\n{times}")


if __name__ == "__main__":
    main()
