"""Run the tests of a room on every mutant of its Python, each in a fork of one process.

python -m tests.mutation.python_bench ROOM STRIDE TURN FILE   try one mutant in STRIDE, from number TURN on,
                                                               and write to FILE which no test notices

A process imports the tests once. A fork of it changes the code of functions and the values of constants in
place, and runs the tests that reach the changed lines, the quickest first, until one fails. Slow tests are
not run: the constants that flights depend on have tests of their own.
"""

import faulthandler
import gc
import json
import os
import resource
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from types import FrameType, FunctionType, ModuleType
from typing import Any, Final, TextIO

import pytest

from mambo_codegen import kept
from mambo_codegen.methods import method_of
from tests.mutation.python_mutants import PythonMutant, names_of, python_mutants

ROOT: Final = Path(__file__).parents[2]
SOURCE_ROOTS: Final = ("codegen", "sil")
PACKAGES: Final = ("mambo_codegen", "mambo_sil", "tests")
LIMIT_S: Final = 60
"""Processor time of the tests of a mutant: one that needs more never ends."""


@dataclass(frozen=True)
class Room:
    """Source, by patterns of paths, and the tests that are to notice its mutants."""

    source: tuple[str, ...]
    tests: tuple[str, ...]
    without: tuple[str, ...] = ()
    """Names of files that another room has, or that only draw or print."""
    longest_s: float = 1.5
    """Processor time, while lines are noted, of the longest test that is run on mutants."""

    @property
    def files(self) -> list[Path]:
        """The files of the source."""
        found = {path for pattern in self.source for path in ROOT.glob(pattern)}
        return sorted(path for path in found if path.name not in {"__init__.py", *self.without})


_METHODS: Final = "codegen/mambo_codegen/methods/**"
_CONSTANTS: Final = "tests/codegen/constants"
_MARGINS: Final = "sil/mambo_sil/experiment/margins"
_MARGIN_TESTS: Final = "tests/experiment/margins"
ROOMS: Final = {
    "fences": Room(
        source=("sil/mambo_sil/flight/fences.py",),
        tests=("tests/flight/test_fences.py",),
    ),
    "tracker": Room(
        source=(f"{_METHODS}/tracker_constants.py",),
        tests=(f"{_CONSTANTS}/test_tracker_constants.py", "tests/codegen/test_guard.py"),
    ),
    "limits": Room(
        source=(f"{_METHODS}/limits_constants.py",),
        tests=(f"{_CONSTANTS}/test_limits_constants.py", "tests/codegen/test_limits.py"),
    ),
    "height": Room(
        source=(f"{_METHODS}/height_constants.py",),
        tests=(f"{_CONSTANTS}/test_height_constants.py", f"{_CONSTANTS}/test_tracker_constants.py"),
    ),
    "inputs": Room(
        source=(f"{_METHODS}/constants.py",),
        tests=(
            *(f"{_CONSTANTS}/test_{name}.py" for name in ("numbers", "tracker_constants")),
            "tests/codegen/test_one_norm.py",
            "tests/codegen/test_limits.py",
            "tests/codegen/test_tilt_gain.py",
        ),
    ),
    "laws": Room(
        source=(f"{_METHODS}/*_constants.py", f"{_METHODS}/law.py"),
        tests=(
            *(f"{_CONSTANTS}/test_{name}_constants.py" for name in ("attitude", "limits", "height")),
            *(f"tests/codegen/test_{name}.py" for name in ("guard", "quadratic", "quadratic_settings")),
            "tests/codegen/test_thrust_vector.py",
        ),
        without=(
            *("tracker_constants.py", "limits_constants.py", "height_constants.py"),
            *("target_observer_constants.py", "tilt_gain_constants.py"),
        ),
    ),
    "target observer": Room(
        source=(f"{_METHODS}/target_observer_constants.py",),
        tests=(f"{_CONSTANTS}/test_target_observer_constants.py", "tests/codegen/test_target_observer.py"),
    ),
    "reach": Room(
        source=("codegen/mambo_codegen/numbers/reach.py",),
        tests=("tests/model/derive/test_reach.py", "tests/extensions/plan/test_limits.py"),
    ),
    "tilt gain": Room(
        source=(f"{_METHODS}/tilt_gain_constants.py",),
        tests=("tests/codegen/test_tilt_gain.py",),
    ),
    "derive": Room(
        source=("sil/mambo_sil/model/derive/*.py",),
        tests=tuple(f"tests/model/derive/test_{name}.py" for name in ("definitions", "reach", "settings")),
        without=("derived_margins.py", "derived_flight.py"),
    ),
    "design": Room(
        source=("sil/mambo_sil/model/derive/derived_margins.py",),
        tests=tuple(f"tests/model/derive/test_{name}.py" for name in ("derived_margins", "settings")),
        longest_s=4.0,
    ),
    "loops": Room((f"{_MARGINS}/loop_margins.py",), (f"{_MARGIN_TESTS}/test_loop_margins.py",)),
    "axes": Room(
        source=(f"{_MARGINS}/axis_margins.py",),
        tests=tuple(
            f"{_MARGIN_TESTS}/test_{name}.py" for name in ("axis_margins", "height", "margin_figures")
        ),
    ),
    "figures": Room(
        source=tuple(f"{_MARGINS}/{name}.py" for name in ("margin_figures", "margins_record")),
        tests=(f"{_MARGIN_TESTS}/test_margin_figures.py",),
    ),
    "drones": Room(
        source=(f"{_MARGINS}/corners.py", f"{_MARGINS}/many_drones.py"),
        tests=(f"{_MARGIN_TESTS}/test_corners.py", f"{_MARGIN_TESTS}/test_many_drones.py"),
    ),
    "hover": Room(
        source=(f"{_MARGINS}/hover_loop.py",),
        tests=tuple(
            f"{_MARGIN_TESTS}/test_{name}.py"
            for name in ("hover_loop", "close_loop", "axis_margins", "height")
        ),
    ),
    "linear drones": Room(
        source=tuple(f"{_MARGINS}/{name}.py" for name in ("drone_jacobians", "rebuild")),
        tests=tuple(f"{_MARGIN_TESTS}/test_{name}.py" for name in ("drone_jacobians", "linear")),
    ),
    "linear controllers": Room(
        source=(f"{_MARGINS}/controller_jacobian.py",),
        tests=tuple(f"{_MARGIN_TESTS}/test_{name}.py" for name in ("linear", "height", "hover_loop")),
    ),
    "measured": Room(
        source=tuple(f"{_MARGINS}/{name}.py" for name in ("margins_run", "response_file")),
        tests=tuple(
            f"{_MARGIN_TESTS}/test_{name}.py"
            for name in ("response_file", "axis_margins", "height", "command")
        ),
    ),
    "derived flight": Room(
        source=("sil/mambo_sil/model/derive/derived_flight.py",),
        tests=("tests/model/derive/test_derived_flight.py",),
        longest_s=4.0,
    ),
}


def mutants_of(room: Room) -> dict[Path, list[PythonMutant]]:
    """Return the mutants of each file of a room."""
    sources = (path for root in SOURCE_ROOTS for path in (ROOT / root).rglob("*.py"))
    names = frozenset[str]().union(*(names_of(path.read_text("utf-8")) for path in sources))
    return {path: python_mutants(path.name, path.read_text("utf-8"), names) for path in room.files}


class Bench:
    """A plugin of pytest that runs the collected tests on mutants, and writes which of these pass all."""

    def __init__(self, chosen: Sequence[tuple[Path, PythonMutant]], longest_s: float, answer: TextIO) -> None:
        self._chosen, self._longest_s, self._answer = chosen, longest_s, answer

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Run the tests on the source as it is, then on every mutant."""
        gc.freeze()  # a fork shares the memory that is not looked through for garbage
        files = frozenset(str(path) for path, _ in self._chosen)
        tests = [(item, *_in_a_fork(partial(_reached, session, item, files))) for item in session.items]
        tests = sorted((one for one in tests if one[1] < self._longest_s), key=lambda one: one[1])
        for path, mutant in self._chosen:
            reaching = [item for item, _, lines in tests if _reaches(lines.get(str(path), []), mutant)]
            if _in_a_fork(partial(_survives, session, path, mutant, reaching)):
                print(json.dumps(mutant.key), file=self._answer, flush=True)
        return True


def _in_a_fork(work: Callable[[], Any]) -> Any:
    """Return what `work` returns, as JSON has it, from a fork that prints nothing; None if that crashes.

    Raises RuntimeError if `work` raises an error.
    """
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        faulthandler.disable()  # a crash is an answer, not a report
        with Path(os.devnull).open("w") as nowhere:
            for printed in (1, 2):
                os.dup2(nowhere.fileno(), printed)
        resource.setrlimit(resource.RLIMIT_CPU, (LIMIT_S, LIMIT_S))
        try:
            found, code = json.dumps(work()), 0
        except BaseException:  # also what ends a process
            found, code = traceback.format_exc(), 1
        with os.fdopen(writing, "w") as answer:
            answer.write(found)
        os._exit(code)
    os.close(writing)
    with os.fdopen(reading) as answer:
        text = answer.read()
    status = os.waitpid(child, 0)[1]
    if os.WIFSIGNALED(status):
        return None
    if status:
        raise RuntimeError(text)
    return json.loads(text)


def _pass(session: pytest.Session, items: Sequence[pytest.Item]) -> bool:
    """Run tests until one fails; return whether none does."""
    for item, following in pairwise([*items, None]):
        assert item is not None
        session.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
        if session.testsfailed:
            return False
    return True


def _reached(
    session: pytest.Session, item: pytest.Item, files: frozenset[str]
) -> tuple[float, dict[str, list[int]]]:
    """Return the time of a test and the lines of files that it runs."""
    lines: dict[str, set[int]] = {file: set() for file in files}

    def note(frame: FrameType, _event: str, _argument: Any) -> Any:
        file = frame.f_code.co_filename
        if file not in files:
            return None
        lines[file].add(frame.f_lineno)
        return note

    start = time.process_time()
    sys.settrace(note)
    assert _pass(session, [item]), f"{item.nodeid} fails without a fault"
    sys.settrace(None)
    return time.process_time() - start, {file: sorted(found) for file, found in lines.items()}


def _reaches(lines: Sequence[int], mutant: PythonMutant) -> bool:
    """Return whether a test that runs these lines can notice a mutant: at the level of the module any can."""
    return mutant.lines is None or any(line in mutant.lines for line in lines)


def _survives(
    session: pytest.Session, path: Path, mutant: PythonMutant, items: Sequence[pytest.Item]
) -> bool:
    """Return whether a module can be imported with a mutant, and tests pass then."""
    module = import_module(_name_of(path))
    other = ModuleType(module.__name__)
    try:
        exec(compile(mutant.apply(path.read_text("utf-8")), str(path), "exec"), vars(other))
    except Exception:  # whatever a fault leads to
        return False
    _install(module, other)
    method_of.cache_clear()
    vars(kept)["write_cached"] = lambda *_: None  # what a mutant computes is not kept
    return _pass(session, items)


def _name_of(path: Path) -> str:
    """Return the name of the module in a file."""
    (root,) = (ROOT / name for name in SOURCE_ROOTS if path.is_relative_to(ROOT / name))
    return ".".join(path.relative_to(root).with_suffix("").parts)


def _install(module: ModuleType, other: ModuleType) -> None:
    """Change a module to what another one has, for all that have imported from it.

    Functions and methods get other code; other values are replaced wherever they have their name.
    """
    ours = [one for name, one in sys.modules.items() if name.partition(".")[0] in PACKAGES]
    for name, value in vars(other).items():
        there = vars(module).get(name)
        if name.startswith("__") or value is there:
            continue
        if isinstance(value, FunctionType):
            _recode(there, value)
        elif isinstance(value, type):
            for key, inner in list(vars(value).items()):
                _recode(_function_of(vars(there).get(key)), _function_of(inner))
        elif repr(value) != repr(there):
            for user in ours:
                if vars(user).get(name) is there:
                    setattr(user, name, value)


def _function_of(attribute: Any) -> Any:
    """Return the function of a method or property."""
    for name in ("fget", "func", "__func__"):
        attribute = getattr(attribute, name, attribute)
    return attribute


def _recode(there: Any, function: Any) -> None:
    if isinstance(function, FunctionType) and function.__code__ != there.__code__:
        there.__code__ = function.__code__


def main(name: str, stride: int, turn: int, answer: Path) -> None:
    """Write the keys of mutants of a room that no test notices, one in a line, as JSON."""
    room = ROOMS[name]
    chosen = [(path, one) for path, found in mutants_of(room).items() for one in found][turn::stride]
    with answer.open("w", encoding="utf-8") as file:
        code = pytest.main(
            ["-q", "-p", "no:cacheprovider", *room.tests], plugins=[Bench(chosen, room.longest_s, file)]
        )
    assert code == 0, code


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]))
