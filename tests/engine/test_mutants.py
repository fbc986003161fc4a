"""Every small fault of the engine's C changes a flight, except those with a reason."""

import os
import resource
from collections.abc import Mapping
from pathlib import Path
from tempfile import mkdtemp
from typing import Final

import pytest

from mambo_nmpc.codegen.errors import BuildError
from mambo_nmpc.sil.controllers.pd import PdController
from mambo_nmpc.sil.engine import library
from mambo_nmpc.sil.engine.simulate import fly_compiled
from mambo_nmpc.sil.flight.scenario import flight_of
from tests.support.mutants import Mutant, mutants
from tests.support.scenarios import COUPLED, SENSED, TAKE_OFF, TRUTH
from tests.support.tools import toolchain

PERIOD_S: Final = 0.01
LIMIT_S: Final = 2
"""Processor time of a mutant; the flights take a tenth of a second."""
_FLAGS: Final = ("-O0", "-w", "-fsanitize=bounds", "-fsanitize-undefined-trap-on-error")
BATCHES: Final = [TRUTH, SENSED, COUPLED, TAKE_OFF]
FILES: Final = [
    name for name in (*library.SOURCES, *library.HEADERS) if name not in ("engine.h", "records.h")
]
REASONS: Final[Mapping[tuple[str, str, str], str]] = {}
"""Why a mutant computes the same, by file, line and change."""


def digests(path: Path) -> list[str]:
    """Fly every batch in the engine at `path`; return the digests of all flights."""
    engine = library.ffi.dlopen(str(path))
    flights = [flight_of(batch, PERIOD_S) for batch in BATCHES]
    traces = [fly_compiled(engine, flight, PdController()) for flight in flights]
    return [trace.digest(index) for trace in traces for index in range(trace.flights)]


def build(files: Mapping[str, str], folder: Path) -> Path:
    """Compile the engine in `files` in a new folder, since a library is loaded once; raises BuildError."""
    place = Path(mkdtemp(dir=folder))
    for name, text in files.items():
        (place / name).write_text(text, "utf-8")
    toolchain("gcc").run([*library.FLAGS, *_FLAGS, *library.SOURCES, "-o", "engine.so", "-lm"], place)
    return place / "engine.so"


def survives(path: Path, expected: list[str]) -> bool:
    """Return whether the engine at `path` flies as expected; it may also crash or hang."""
    child = os.fork()
    if child == 0:
        resource.setrlimit(resource.RLIMIT_CPU, (LIMIT_S, LIMIT_S))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        os._exit(0 if digests(path) == expected else 1)
    return os.waitpid(child, 0)[1] == 0


@pytest.mark.long
@pytest.mark.parametrize("name", FILES)
def test_every_fault_changes_a_flight(name: str, tmp_path: Path) -> None:
    """Operators, constants, indices, conditions and statements of one file."""
    files = library.texts()
    expected = digests(build(files, tmp_path))
    found = mutants(name, files[name])
    assert found
    survivors = [mutant.key for mutant in found if alive(mutant, files, tmp_path, expected)]
    assert set(survivors) == {key for key in REASONS if key[0] == name}


def alive(mutant: Mutant, files: dict[str, str], folder: Path, expected: list[str]) -> bool:
    """Return whether a mutant compiles and flies as expected."""
    try:
        path = build(files | {mutant.file: mutant.apply(files[mutant.file])}, folder)
    except BuildError:
        return False
    return survives(path, expected)
