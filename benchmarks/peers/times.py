"""Time of an update on this machine, largest tilt planned and memory: ours and the peers.

Every contender is generated once, built portably and for this machine, and tried in a process of its own. One
process then times all of them: in every round each contender passes through each set of states. Table and
plot go to build/bench; docs/evidence/benchmarks.md has the plot. The row of a contender that fails states
the reason.
"""

import argparse
import ctypes
import os
import sys
import tempfile
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import trim_mean

from benchmarks.peers.host_builds import build, plans, silence, sizes
from benchmarks.peers.ours import ONE_NORM, PEERS_MODEL, bundle
from benchmarks.peers.programs import HERE, ROOT, NotHereError, Program, run_tool
from benchmarks.peers.setups import PEERS
from benchmarks.peers.times_report import COLD, FLAGS, Row, Timing, write_report
from mambo_codegen.errors import BuildError
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.toolchain import host_toolchain
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.trajectories import Bernoulli

Array = NDArray[np.float64]
Libraries = dict[tuple[str, str], Path]
"""By contender and flags."""
Inputs = NDArray[np.float32]
"""(n, 6): x (m), vx (m/s), y, vy of the drone less the target's; roll and pitch last commanded (rad)."""

COUNT: Final = 1000
_LAST_RAD: Final = 0.1
_WITHIN: Final = {"W": [0.5, 1.0], "T": [0.05, 0.1], "F": [0.005, 0.01]}
_NOISE: Final = [0.01, 0.05]
"""Of position (m) and velocity (m/s)."""
_SEED: Final = 1
_SETTLED_S: Final = 10.0

ROUNDS: Final = 8
_WARM_UP: Final = 50
_EMPTY: Final = ("nothing", "")
_COLD: Final = 100
"""Number of calls timed with cold caches."""
_SLOW_NS: Final = 20_000
_SLOW_COUNT: Final = 200
"""Number of states of each set for contenders that take longer than _SLOW_NS."""
_SWEPT_BYTES: Final = 64 << 20
_FOLDER: Final = ROOT / "build/bench"


def state_sets() -> dict[str, Inputs]:
    """Return the sets, (COUNT, 6) each."""
    random = np.random.default_rng(_SEED)
    sets = {}
    for name, within in _WITHIN.items():
        scale = [*within, *within, _LAST_RAD, _LAST_RAD]
        sets[name] = (random.uniform(-1, 1, (COUNT, 6)) * scale).astype(np.float32)
    sets["C"] = _flown(random)
    return sets


def _flown(random: np.random.Generator) -> Inputs:
    """Fly preset mambo for 10 s after it has settled, and add measurement noise."""
    flight = Flight(Bernoulli(2.0, 0.5), duration_s=_SETTLED_S + 0.01 * COUNT)
    trace: Any = fly(flight, CompiledController(presets.load("mambo")))
    error = np.concatenate([trace.position_m[..., :2], trace.velocity_m_s[..., :2]], -1) - trace.target
    x, y, vx, vy = error[-COUNT:, 0].T
    noise = random.standard_normal((COUNT, 4)) * (_NOISE * 2)
    seen = np.stack([x, vx, y, vy], 1) + noise
    return np.concatenate([seen, np.zeros((COUNT, 2))], 1).astype(np.float32)


def contenders() -> list[Program]:
    """Return ours and the peers."""
    alike, mambo = PEERS_MODEL, ONE_NORM
    return [
        bundle("ours", "mambo-nmpc, the peers' model", alike),
        bundle("ours-20", "the same, 20 iterations", with_option(alike, "optimizer.iterations", 20)),
        bundle("ours-float64", "the same, float64", with_option(alike, "code.scalar", "float64")),
        bundle("ours-fixed", "the same, fixed point", with_option(alike, "code.scalar", "fixed")),
        bundle("ours-mambo", "mambo-nmpc, mambo-1norm", mambo),
        *PEERS,
    ]


def _plan_sets(library: Path, sets: dict[str, Inputs]) -> dict[str, Any]:
    """Plan for the states of W, each on its own, and along C."""
    silence()
    return {name: plans(library, sets[name], follows=name == "C") for name in ("W", "C")}


def prepare(program: Program, sets: dict[str, Inputs], work: Path) -> tuple[Row, Libraries]:
    """Generate, build and try a contender; returns its row without times, and libraries."""
    row, folder = Row(program), work / program.name
    try:
        folder.mkdir()
        row = replace(row, versions=program.write(folder / "c"))
        libraries = {
            (program.name, flags): build(program, folder / "c", flags, folder / f"{number}.so")
            for number, flags in enumerate(FLAGS)
        }
    except (NotHereError, BuildError) as error:
        return replace(row, absent=str(error)), {}
    library = libraries[program.name, FLAGS[0]]
    try:
        with ProcessPoolExecutor(1) as pool:
            tried = pool.submit(_plan_sets, library, sets).result()
    except BrokenProcessPool:
        return replace(row, absent="crashes"), {}
    code, ram = sizes(library)
    memory = {
        "contender": program.title,
        "largest tilt": f"{max(np.abs(plan).max() for plan, _ in tried.values()):.4f}",
        "code": f"{code:,}",
        "RAM": f"{ram:,}",
        "heap": _describe_heap(tried["W"][1]),
    }
    return replace(row, memory=memory), libraries


def _describe_heap(calls: list[int]) -> str:
    if any(calls[1:]):
        return f"{np.mean(calls[1:]):.0f} calls per update"
    return "set-up only" if calls[0] else "no"


def time_all(
    timer: Path, libraries: Libraries, sets: dict[str, Inputs], rounds: int
) -> tuple[dict[Any, Timing], Timing]:
    """Return the times of every library less those of an empty call, and of the empty call.

    This process is pinned to one core.
    """
    silence()
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    measure = ctypes.CDLL(str(timer)).timing_measure
    room = np.ones(_SWEPT_BYTES, np.uint8)
    calls: dict[Any, Any] = {key: ctypes.CDLL(str(path)).run for key, path in libraries.items()}
    calls[_EMPTY] = None

    def one_pass(run: Any, inputs: Inputs, *, follows: bool, cold: bool = False) -> Array:
        taken, moves = np.zeros(len(inputs)), np.zeros((len(inputs), 4), np.float32)
        swept = (_address(room), ctypes.c_size_t(room.nbytes)) if cold else (None, ctypes.c_size_t(0))
        measure(run, _address(inputs), len(inputs), int(follows), *swept, _address(taken), _address(moves))
        return taken

    counts = {}
    for key, run in calls.items():
        tried = [one_pass(run, inputs[:_SLOW_COUNT], follows=name == "C") for name, inputs in sets.items()]
        is_slow = max(float(np.median(ns)) for ns in tried) > _SLOW_NS
        counts[key] = _SLOW_COUNT if is_slow else len(sets["C"])
    hot: dict[Any, dict[str, list[Array]]] = {key: {name: [] for name in sets} for key in calls}
    for _ in range(rounds):
        for name, inputs in sets.items():
            for key, run in calls.items():
                one_pass(run, inputs[:_WARM_UP], follows=name == "C")
                hot[key][name].append(one_pass(run, inputs[: counts[key]], follows=name == "C"))
    timings = {}
    for key, run in calls.items():
        by_state = {name: trim_mean(passes, 0.25, axis=0) for name, passes in hot[key].items()}
        by_state[COLD] = one_pass(run, sets["C"][:_COLD], follows=True, cold=True)
        timings[key] = {name: np.percentile(ns, [50, 99]) for name, ns in by_state.items()}
    empty = timings.pop(_EMPTY)
    for timing in timings.values():
        timing.update({name: ns - empty[name][0] for name, ns in timing.items()})
    return timings, empty


def _address(array: NDArray[Any]) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)


def _describe_machine(rounds: int, loads: Iterable[float]) -> str:
    models = [line for line in Path("/proc/cpuinfo").read_text("utf-8").splitlines() if "model name" in line]
    model = models[0].partition(":")[2].strip() if models else "unknown processor"
    load = " and ".join(f"{value:.1f}" for value in loads)
    return (
        f"{model}, {os.cpu_count()} cores, load {load} before and after; "
        f"{host_toolchain().identity().partition(chr(10))[0]}; {rounds} rounds."
    )


def main() -> None:
    """Measure ours and every peer; write table, CSV and plot, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="passes through every set")
    rounds = parser.parse_args().rounds
    try:
        sets = state_sets()
    except BuildError as error:
        sys.exit(str(error))
    with tempfile.TemporaryDirectory(prefix="mambo-nmpc-") as place:
        work = Path(place)
        print("generating, building, trying", file=sys.stderr)
        with ProcessPoolExecutor() as pool:
            prepared = list(pool.map(partial(prepare, sets=sets, work=work), contenders()))
        rows = [row for row, _ in prepared]
        libraries = {key: path for _, built in prepared for key, path in built.items()}
        timer = work / "timing.so"
        line = [*host_toolchain().command, "-O2", "-shared", "-fPIC", str(HERE / "timing.c")]
        run_tool([*line, "-o", str(timer)])
        print("timing", file=sys.stderr)
        before = os.getloadavg()[0]
        try:
            with ProcessPoolExecutor(1) as pool:
                timings, empty = pool.submit(time_all, timer, libraries, sets, rounds).result()
        except BrokenProcessPool:
            sys.exit("a contender crashed while it was timed")
        machine = _describe_machine(rounds, (before, os.getloadavg()[0]))
    rows = [
        replace(row, times={flags: ns for (name, flags), ns in timings.items() if name == row.program.name})
        for row in rows
    ]
    print(write_report(rows, machine, empty, _FOLDER))


if __name__ == "__main__":
    main()
