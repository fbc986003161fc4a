"""Time of an update on this machine and quality of its plan: ours, a plain roll-out and the peers.

    python -m benchmarks.times                          # the peers are installed beside us
    python -m benchmarks.times --python DIR/bin/python  # the peers are installed elsewhere

Every contender is generated once, built portably and for this machine, and tried in a process of its own. One
process then times all of them: in every round each contender passes through each set of states. Table and
plot go to a folder; docs/benchmarks.md explains them. The row of a contender that fails states the reason.
"""

import argparse
import ctypes
import os
import sys
import tempfile
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from benchmarks import peers_setups as problem
from benchmarks.host_builds import NATIVE, PORTABLE, build, plans, silence, sizes
from benchmarks.optimum import excess
from benchmarks.ours import bundle_program, peers_model, place_bundle, place_rollout, rollout_program
from benchmarks.peers_c import NotHereError, generate, run_tool
from benchmarks.peers_programs import Program, host_programs
from benchmarks.states import Inputs, state_sets
from benchmarks.times_report import FLAGS, Row, Timing, write_report
from mambo_nmpc.codegen.errors import BuildError
from mambo_nmpc.codegen.settings import presets
from mambo_nmpc.codegen.settings.controller_toml import with_option
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.codegen.toolchain import host_toolchain

Array = NDArray[np.float64]
Libraries = dict[tuple[str, str], Path]
"""By contender and name of the flags."""

ROUNDS: Final = 8
_WARM_UP: Final = 50
_COLD: Final = 100
"""Number of calls timed with cold caches."""
_SLOW_NS: Final = 20_000
_SLOW_COUNT: Final = 200
"""Number of states of each set for contenders that take longer than _SLOW_NS."""
_SWEPT_BYTES: Final = 64 << 20
_SAMPLE: Final = 5
"""Every _SAMPLE-th plan is compared with the optimum."""
_SAME_RAD: Final = 1e-6
_BUILDS: Final = {"portable": PORTABLE, "native": NATIVE}


@dataclass(frozen=True)
class Contender:
    """A program to measure: `write` puts its C into a folder and returns the versions of its packages.

    Its plans are compared with the optimum of the problem of `settings`.
    """

    name: str
    program: Program
    write: Callable[[Path], dict[str, str]]
    settings: Settings


def contenders(python: str) -> list[Contender]:
    """Return ours, the roll-outs, and the peers installed in `python`."""
    alike, mambo = peers_model(), presets.load("mambo")
    variants = {
        "ours": ("mambo-nmpc, the peers' model", alike),
        "ours-20": ("the same, 20 iterations", with_option(alike, "optimizer.iterations", 20, "bench")),
        "ours-float64": ("the same, float64", with_option(alike, "code.scalar", "float64", "bench")),
        "ours-fixed": ("the same, fixed point", with_option(alike, "code.scalar", "fixed", "bench")),
        "mambo": ("mambo-nmpc, preset mambo", mambo),
    }
    found = [
        Contender(name, bundle_program(title, settings), partial(_place, place_bundle, settings), settings)
        for name, (title, settings) in variants.items()
    ]
    for name, title, settings in (
        ("rollout", "the peers' model, plain roll-out", alike),
        ("rollout-mambo", "preset mambo, plain roll-out", mambo),
    ):
        write = partial(_place, place_rollout, settings)
        found.append(Contender(name, rollout_program(title, settings), write, settings))
    peers = host_programs(*problem.literals())
    return found + [Contender(peer.name, peer, partial(generate, python, peer), alike) for peer in peers]


def _place(place: Callable[[Settings, Path], None], settings: Settings, folder: Path) -> dict[str, str]:
    place(settings, folder)
    return {}


def _plan_sets(library: Path, sets: dict[str, Inputs]) -> dict[str, Any]:
    """Plan for the states of W, each on its own, and along C."""
    silence()
    return {name: plans(library, sets[name], follows=name == "C") for name in ("W", "C")}


def _prepare(contender: Contender, sets: dict[str, Inputs], work: Path) -> tuple[Row, Libraries, Any]:
    """Generate, build and try a contender; returns its row without times, libraries, and plans by set."""
    program, folder = contender.program, work / contender.name
    row = Row(contender.name, program.title, program.cost, program.scalar)
    try:
        folder.mkdir()
        versions = contender.write(folder / "c")
        libraries = {
            (contender.name, name): build(program, folder / "c", flags, folder / f"{name}.so")
            for name, flags in _BUILDS.items()
        }
    except (NotHereError, BuildError) as error:
        return replace(row, absent=str(error)), {}, None
    library = libraries[contender.name, "portable"]
    try:
        with ProcessPoolExecutor(1) as pool:
            tried = pool.submit(_plan_sets, library, sets).result()
    except BrokenProcessPool:
        return replace(row, absent="crashes"), {}, None
    above = {}
    if program.cost != "quadratic, other problem":
        for name, (last, planned, _) in tried.items():
            inputs = np.concatenate([sets[name][:, :4], last], 1)
            shares = excess(program.cost, contender.settings, inputs[::_SAMPLE], planned[::_SAMPLE])
            above[name] = (float(np.median(shares)), float(np.percentile(shares, 99)))
    heap = tried["W"][2]
    row = replace(
        row,
        versions=versions,
        sizes=sizes(library),
        heap_first=heap[0],
        heap_after=float(np.mean(heap[1:])),
        above=above,
        tilt_rad=max(float(np.abs(planned).max()) for _, planned, _ in tried.values()),
    )
    return row, libraries, {name: planned for name, (_, planned, _) in tried.items()}


def _time_all(timing: Path, libraries: Libraries, sets: dict[str, Inputs], rounds: int) -> dict[Any, Timing]:
    """Time every library, and as "nothing" an empty call, in ns, with this process pinned to one core."""
    silence()
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    measure = ctypes.CDLL(str(timing)).timing_measure
    room = np.ones(_SWEPT_BYTES, np.uint8)
    calls: dict[Any, Any] = {key: ctypes.CDLL(str(path)).run for key, path in libraries.items()}
    calls["nothing", ""] = None

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
        cold = one_pass(run, sets["C"][:_COLD], follows=True, cold=True)
        by_state = {name: _midmean(np.array(passes)) for name, passes in hot[key].items()}
        timings[key] = Timing(
            {name: (float(np.median(ns)), float(np.percentile(ns, 99))) for name, ns in by_state.items()},
            float(np.median(cold)),
        )
    return timings


def _midmean(passes: Array) -> Array:
    """Return for each state (n,) the mean of the middle half of its rounds (rounds, n)."""
    ordered, quarter = np.sort(passes, axis=0), len(passes) // 4
    middle: Array = ordered[quarter : len(passes) - quarter].mean(axis=0)
    return middle


def _address(array: NDArray[Any]) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)


def _count_same(planned: dict[str, Any], one: str, other: str) -> str:
    """Return the number of states in which two contenders have the same plan."""
    if not (planned.get(one) and planned.get(other)):
        return "not compared"
    agree = np.concatenate(
        [np.abs(planned[one][name] - planned[other][name]).max(axis=1) < _SAME_RAD for name in planned[one]]
    )
    return f"{np.count_nonzero(agree):,} of {len(agree):,}"


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
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--python", default=sys.executable, help="the Python that has the peers")
    parser.add_argument("--output", "-o", type=Path, default=Path("build/bench"), help="folder to write into")
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="passes through every set")
    arguments = parser.parse_args()
    try:
        sets = state_sets()
    except BuildError as error:
        sys.exit(str(error))
    with tempfile.TemporaryDirectory(prefix="mambo-nmpc-") as place:
        work = Path(place)
        print("generating, building, trying", file=sys.stderr)
        with ProcessPoolExecutor() as pool:
            prepare = partial(_prepare, sets=sets, work=work)
            prepared = list(pool.map(prepare, contenders(arguments.python)))
        rows = [row for row, _, _ in prepared]
        libraries = {key: path for _, built, _ in prepared for key, path in built.items()}
        planned = {row.name: plans_found for row, _, plans_found in prepared}
        timing = work / "timing.so"
        source = resources.files("benchmarks").joinpath("timing.c")
        run_tool([*host_toolchain().command, "-O2", "-shared", "-fPIC", str(source), "-o", str(timing)])
        print("timing", file=sys.stderr)
        before = os.getloadavg()[0]
        try:
            with ProcessPoolExecutor(1) as pool:
                timings = pool.submit(_time_all, timing, libraries, sets, arguments.rounds).result()
        except BrokenProcessPool:
            sys.exit("a contender crashed while it was timed")
        machine = _describe_machine(arguments.rounds, (before, os.getloadavg()[0]))
    nothing = timings.pop(("nothing", ""))
    rows = [
        replace(row, times={name: timings[row.name, name].less(nothing) for name in FLAGS})
        if not row.absent
        else row
        for row in rows
    ]
    agreement = {
        "the peers' model": _count_same(planned, "ours", "rollout"),
        "preset mambo": _count_same(planned, "mambo", "rollout-mambo"),
    }
    print(write_report(rows, machine, agreement, nothing, arguments.output))


if __name__ == "__main__":
    main()
