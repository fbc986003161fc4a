"""Small faults of the engine's C change a flight or a block, except those with a reason.

python -m tests.engine.test_mutants FILE ...   try every fault of some files and print which are not noticed
"""

import faulthandler
import hashlib
import os
import resource
import sys
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
import pytest

from mambo_nmpc.codegen.errors import BuildError
from mambo_nmpc.sil.controllers.compiled import CompiledController
from mambo_nmpc.sil.controllers.pd import pd_controller
from mambo_nmpc.sil.engine.build import HEADERS, SOURCES, ffi, texts
from mambo_nmpc.sil.engine.evaluation import evaluate_compiled
from mambo_nmpc.sil.engine.simulate import fly_compiled
from mambo_nmpc.sil.flight.loop import Flight
from mambo_nmpc.sil.flight.names import PD_NAMES
from mambo_nmpc.sil.flight.scenario import flight_of
from mambo_nmpc.sil.flight.trajectories import Hover
from mambo_nmpc.sil.plant.airframe import NOMINAL
from mambo_nmpc.sil.sensors.instruments import NOISES, Sensors
from tests.support.engine_reasons import reason
from tests.support.engines import TICKS, build, estimates, injected, tabulate, truths
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
from tests.support.mutants import Mutant, mutants
from tests.support.one_norm import ONE_NORM
from tests.support.scenarios import BATCHES

PERIOD_S: Final = 0.01
STRIDE: Final = 12
"""The test tries one fault in so many; all of them take twenty minutes."""
LIMIT_S: Final = 2
"""Processor time of a mutant; the flights take a tenth of a second."""
FLAGS: Final = (
    *("-O0", "-w", "-ftrivial-auto-var-init=pattern"),
    *("-fsanitize=bounds", "-fsanitize-undefined-trap-on-error"),
)
"""A variable without a value is not 0, and a read beside an array is a crash."""
FILES: Final = sorted({*SOURCES, *HEADERS} - {"engine.h", "loop.h", "records.h"})


def digests(path: Path) -> list[str]:
    """Return the digests of all flights in the engine at `path`, and of its blocks on any numbers."""
    engine: Any = ffi.dlopen(str(path))
    flights = [flight_of(batch, PERIOD_S) for batch in BATCHES.values()]
    traces = [fly_compiled(engine, flight, pd_controller(name)) for name in PD_NAMES for flight in flights]
    settings = ONE_NORM
    traces += [
        fly_compiled(engine, flight, CompiledController(settings, flight.flights)) for flight in flights[:2]
    ]
    faulty, reweighted = faulty_controller(settings, FAULTS, CHANGES, PATIENCE)
    traces.append(fly_compiled(engine, faulty_flight(FAULTS), faulty))
    found = [trace.digest(index) for trace in traces for index in range(trace.flights)]
    sensed = Flight(Hover(), duration_s=1.0, sensors=Sensors(derotated=True))
    draws = np.random.default_rng(1).standard_normal((TICKS, NOISES))
    blocks = [tabulate(path), estimates(path, sensed, truths(), draws)]
    blocks += [injected(path, fault, any_inputs()) for fault in SHOWN]
    found += [str(reweighted.answers), str(engine.engine_fastest_lanes())]
    found += [bits(evaluate_compiled(engine, each, LIMIT_RAD, NOMINAL)) for each in evaluated()]
    return [*found, *(hashlib.sha256(block.tobytes()).hexdigest() for block in blocks)]


def survives(path: Path, expected: list[str]) -> bool:
    """Return whether the engine at `path` computes what is expected; it may also crash or hang."""
    child = os.fork()
    if child == 0:
        faulthandler.disable()  # a crash is an answer, not a report
        with Path(os.devnull).open("w") as nowhere:
            os.dup2(nowhere.fileno(), 2)
        resource.setrlimit(resource.RLIMIT_CPU, (LIMIT_S, LIMIT_S))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        os._exit(0 if digests(path) == expected else 1)
    return os.waitpid(child, 0)[1] == 0


def alive(mutant: Mutant, files: Mapping[str, str], expected: list[str]) -> bool:
    """Return whether a mutant compiles and computes what is expected, in two lanes and in one."""
    changed = dict(files) | {mutant.file: mutant.apply(files[mutant.file])}
    with TemporaryDirectory() as folder:
        try:
            paths = (build(changed, Path(folder), *FLAGS, lanes=lanes) for lanes in (2, 1))
            return all(survives(path, expected) for path in paths)
        except BuildError:
            return False


def unnoticed(name: str, stride: int) -> list[Mutant]:
    """Return which of the faults of one file, one in `stride`, change nothing."""
    files = texts()
    with TemporaryDirectory() as folder:
        paths = [build(files, Path(folder), *FLAGS, lanes=lanes) for lanes in (1, 2)]
        expected, same = map(digests, paths)
    assert same == expected
    found = mutants(name, files[name])[::stride]
    assert found
    return [mutant for mutant in found if alive(mutant, files, expected)]


@pytest.mark.long
@pytest.mark.parametrize("name", FILES)
def test_a_fault_changes_a_flight(name: str) -> None:
    """Operators, constants, indices, conditions and statements."""
    assert [mutant.key for mutant in unnoticed(name, STRIDE) if reason(mutant.key) is None] == []


if __name__ == "__main__":
    for file in sys.argv[1:] or FILES:
        for one in unnoticed(file, 1):
            print(one.key, reason(one.key) or f"NO REASON: {one.wrong_line}", sep=": ", flush=True)
