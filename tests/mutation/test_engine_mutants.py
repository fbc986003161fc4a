"""Small faults of the engine's C change a flight or a block, except those with a reason.

python -m tests.mutation.test_engine_mutants FILE ...   try every fault of files, print which go unnoticed
"""

import ctypes
import faulthandler
import hashlib
import operator
import os
import re
import resource
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
import pytest

from mambo_codegen.errors import BuildError
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.sensors.instruments import NOISES, Sensors
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.pd import pd_controller
from mambo_sil.flight.engine.engine_library import FLAGS as ENGINE_FLAGS
from mambo_sil.flight.engine.engine_library import HEADERS, LANES, LIBRARIES, SOURCES, ffi, texts
from mambo_sil.flight.engine.evaluate import evaluate_compiled
from mambo_sil.flight.engine.simulate import fly_compiled
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.names import PD_NAMES
from mambo_sil.flight.scenario import flight_of
from mambo_sil.flight.trajectories import Hover
from mambo_sil.results.shared_library import LIBRARY_FLAGS
from tests.mutation.mutants import Mutant, mutants
from tests.mutation.reasons import Key, survivors
from tests.mutation.schemata import CHOSEN, ORIGINAL, can_share, refused_numbers, with_mutants
from tests.support.engines import BLOCKS, TICKS, estimates, injected, tabulate, truths
from tests.support.evaluations import LIMIT_RAD, bits
from tests.support.evaluations import traces as evaluated
from tests.support.faults import (
    CHANGES,
    FAULTS,
    PATIENCE,
    SHOWN,
    any_inputs,
    faulty_controller,
    faulty_flight,
)
from tests.support.height_settings import height_settings
from tests.support.one_norm import ONE_NORM
from tests.support.scenarios import BATCHES
from tests.support.tools import toolchain

REASONS: Final = survivors("engine_survivors.txt")
PERIOD_S: Final = 0.01
STRIDE: Final = 72
"""The test tries one fault in so many; all of them take ten minutes."""
LIMIT_S: Final = 2
"""Processor time of a mutant; the flights take a tenth of a second."""
FLAGS: Final = (
    *(*ENGINE_FLAGS, "-O0", "-w", "-ftrivial-auto-var-init=pattern"),
    *("-fsanitize=bounds", "-fsanitize-undefined-trap-on-error"),
)
"""A variable without a value is not 0, and a read beside an array is a crash."""
LOOP_AND_BLOCKS: Final = "loop_and_blocks.c"
INCLUDES: Final = f'#include "loop.c"\n#include "blocks.c"\nint {CHOSEN};\n'
"""Both include most headers. The variable chooses one of the faults of an engine that has many."""
UNITS: Final = (LOOP_AND_BLOCKS, *(name for name in SOURCES if name != "loop.c"))
LANES_TRIED: Final = (2, 1)
LEVER_ERROR_M: Final = (0.03, -0.02, 0.05)
"""How far a flight is seen from where its controller was told."""
FILES: Final = sorted({*SOURCES, *HEADERS} - {"engine.h", "loop.h", "records.h"})


def reason(key: Key) -> str | None:
    """Return why the fault `key` changes nothing, or None if no reason is known."""
    name, line, change = key
    length = re.fullmatch(r"(\d+) -> (\d+)( #\d+)?", change)
    if length and re.search(rf"\b(?:double|real_t|lanes_t) \w+\[{length[1]}\](;| = )", line):
        is_longer = int(length[2]) > int(length[1])
        return "a longer array" if is_longer else "reads or writes beside an array, which no flight shows"
    if name == "sensors.h" and not line.startswith("for") and re.fullmatch(r"<=? -> <=?( #\d+)?", change):
        return "two numbers that are equal"
    return REASONS.get(key)


def digests(path: Path) -> Iterator[str]:
    """Yield the digests of all flights in the engine at `path`, and of its blocks on any numbers.

    What is quick, and shows faults that no flight shows, comes first.
    """
    engine: Any = ffi.dlopen(str(path))
    flights = [flight_of(batch, PERIOD_S) for batch in BATCHES.values()]
    lifted = [
        flight_of(BATCHES[name], PERIOD_S)
        for name in ("space", "flown in space", "truth", "take-off", "late thrust", "flown take-off")
    ]
    settings = ONE_NORM
    told = flights[0]
    elsewhere = replace(told, duration_s=0.5, vehicle=replace(told.vehicle, lever_error_m=LEVER_ERROR_M))
    traces = (
        fly_compiled(engine, flight, controller)
        for flight, controller in (
            *((flight, pd_controller(name, flight)) for name in PD_NAMES for flight in (elsewhere, *flights)),
            *((flight, CompiledController(settings, flight.flights)) for flight in flights[:2]),
            *((flight, CompiledController(height_settings(), flight.flights)) for flight in lifted),
        )
    )
    for each in evaluated():
        yield bits(evaluate_compiled(engine, each, LIMIT_RAD, NOMINAL))
    for fault in SHOWN:
        yield hashlib.sha256(injected(path, fault, any_inputs()).tobytes()).hexdigest()
    for trace in traces:
        yield from (trace.digest(index) for index in range(trace.flights))
    for kind, changes in ((settings, CHANGES), (height_settings(), ())):
        faulty, adjusted = faulty_controller(kind, FAULTS, changes, PATIENCE)
        trace = fly_compiled(engine, faulty_flight(FAULTS), faulty)
        yield from (trace.digest(index) for index in range(trace.flights))
        yield str(adjusted.answers)
    yield str(engine.engine_fastest_lanes())
    sensed = Flight(Hover(), duration_s=1.0, sensors=Sensors(derotated=True))
    draws = np.random.default_rng(1).standard_normal((TICKS, NOISES))
    yield hashlib.sha256(tabulate(path).tobytes()).hexdigest()
    yield hashlib.sha256(estimates(path, sensed, truths(), draws).tobytes()).hexdigest()


def survives(path: Path, expected: list[str], number: int = ORIGINAL) -> bool:
    """Return whether the engine at `path` computes what is expected; it may also crash or hang.

    `number` is that of its fault, if it has many.
    """
    child = os.fork()
    if child == 0:
        faulthandler.disable()  # a crash is an answer, not a report
        with Path(os.devnull).open("w") as nowhere:
            os.dup2(nowhere.fileno(), 2)
        resource.setrlimit(resource.RLIMIT_CPU, (LIMIT_S, LIMIT_S))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        ctypes.c_int.in_dll(ctypes.CDLL(str(path)), CHOSEN).value = number
        os._exit(0 if all(map(operator.eq, digests(path), expected)) else 1)  # ends at the first difference
    return os.waitpid(child, 0)[1] == 0


class Bench:
    """Builds the engine with one file changed at a time; what does not include that file is compiled once."""

    def __init__(self, folder: Path) -> None:
        self.files = texts()
        self._folder = folder
        for name, text in (self.files | {"blocks.c": BLOCKS, LOOP_AND_BLOCKS: INCLUDES}).items():
            (folder / name).write_text(text, "utf-8")
        for lanes in LANES_TRIED:
            for unit in UNITS:
                self._compile(unit, lanes)
        expected, same = ([*digests(self._link(f"right-{lanes}.so", lanes))] for lanes in LANES_TRIED)
        assert same == expected
        self._expected = expected

    def unnoticed(self, found: Sequence[Mutant]) -> list[Mutant]:
        """Return which faults of one file change nothing.

        Those that can share an engine are tried in one, of which most of the C is compiled once; what goes
        unnoticed there is tried alone.
        """
        name = found[0].file
        shared = [mutant for mutant in found if can_share(self.files[name], mutant)]
        numbered = dict(enumerate(shared, ORIGINAL + 1))
        while refused := self._build_shared(name, numbered):
            numbered = {number: mutant for number, mutant in numbered.items() if number not in refused}
        engine = self._folder / "shared.so"
        assert survives(engine, self._expected), "the engine without a fault computes something else too"
        noticed = {
            mutant for number, mutant in numbered.items() if not survives(engine, self._expected, number)
        }
        return [mutant for mutant in found if mutant not in noticed and self.alive(mutant)]

    def _build_shared(self, name: str, numbered: Mapping[int, Mutant]) -> set[int]:
        """Build an engine that has faults of one file; return the numbers of those that gcc refuses."""
        (self._folder / name).write_text(with_mutants(self.files[name], numbered), "utf-8")
        line = ["gcc", *FLAGS, *LIBRARY_FLAGS, *LANES[LANES_TRIED[0]], *UNITS, "-o", "shared.so", *LIBRARIES]
        done = subprocess.run(line, cwd=self._folder, capture_output=True, text=True, check=False)
        (self._folder / name).write_text(self.files[name], "utf-8")
        refused = refused_numbers(done.stderr)
        assert refused or done.returncode == 0, done.stderr
        return refused

    def alive(self, mutant: Mutant) -> bool:
        """Return whether a mutant compiles and computes what is expected, in two lanes and in one."""
        file = self._folder / mutant.file
        units = [unit for unit in UNITS if mutant.file in self._included(unit)]
        file.write_text(mutant.apply(self.files[mutant.file]), "utf-8")
        try:
            return all(self._survives(units, lanes) for lanes in LANES_TRIED)
        except BuildError:
            return False
        finally:
            file.write_text(self.files[mutant.file], "utf-8")

    def _survives(self, changed: Sequence[str], lanes: int) -> bool:
        for unit in changed:
            self._compile(unit, lanes, "changed")
        return survives(self._link("wrong.so", lanes, changed), self._expected)

    def _compile(self, unit: str, lanes: int, kind: str = "right") -> None:
        self._gcc(*LANES[lanes], "-c", unit, "-o", f"{kind}-{lanes}-{unit}.o")

    def _link(self, name: str, lanes: int, changed: Sequence[str] = ()) -> Path:
        objects = (f"{'changed' if unit in changed else 'right'}-{lanes}-{unit}.o" for unit in UNITS)
        self._gcc(*objects, "-o", name, *LIBRARIES)
        return self._folder / name

    def _gcc(self, *arguments: str) -> None:
        toolchain("gcc").run([*FLAGS, *LIBRARY_FLAGS, *arguments], self._folder)

    def _included(self, name: str) -> set[str]:
        """Return a file and all that it includes."""
        found = re.findall(r'^#include "(.*)"$', (self._folder / name).read_text("utf-8"), re.MULTILINE)
        return {name}.union(*map(self._included, found))


def unnoticed(bench: Bench, name: str, stride: int) -> list[Mutant]:
    """Return which of the faults of one file, one in `stride`, change nothing."""
    found = mutants(name, bench.files[name])[::stride]
    assert found
    return bench.unnoticed(found)


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """Compile the engine as it is, in one lane and in two."""
    return Bench(tmp_path_factory.mktemp("engine"))


def test_every_reason_is_of_a_fault_that_there_is() -> None:
    """A row whose line is gone is removed."""
    files = texts()
    assert REASONS.keys() <= {mutant.key for name in FILES for mutant in mutants(name, files[name])}


@pytest.mark.long
@pytest.mark.parametrize("name", FILES)
def test_a_fault_changes_a_flight(name: str, bench: Bench) -> None:
    """Operators, constants, indices, conditions and statements."""
    assert [mutant.key for mutant in unnoticed(bench, name, STRIDE) if reason(mutant.key) is None] == []


if __name__ == "__main__":
    with TemporaryDirectory() as place:
        for file in sys.argv[1:] or FILES:
            for one in unnoticed(Bench(Path(place)), file, 1):
                print(one.key, reason(one.key) or f"NO REASON: {one.wrong_line}", sep=": ", flush=True)
