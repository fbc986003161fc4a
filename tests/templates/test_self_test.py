"""The self-test names the first step with a wrong output; it notices a wrong constant, sign or comparison."""

import re
import subprocess
from pathlib import Path

import pytest

from mambo_codegen.bundle.flags import COMPILE_FLAGS
from mambo_codegen.bundle.render import render
from mambo_codegen.errors import BuildError
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.toolchain import Toolchain
from tests.mutation.mutants import Mutant, mutants
from tests.support.bundles import place
from tests.support.one_norm import ONE_NORM
from tests.support.quadratic import EVERYTHING
from tests.support.tools import require

SELF_TEST = "nmpc_self_test.c"
CONTROLLER = "nmpc.c"
FLAGS = ("-std=c99", "-ffp-contract=off", "-w", "-I.")
SANITIZED = ("-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
RENAMED = ("-Dnmpc_step=wrong_step", "-Dnmpc_last_cost=wrong_last_cost")
OUTPUTS = 6
"""Status, two commands, cost, two gradients: the outputs that wrong_outputs.c makes wrong, one at a time."""
LIMIT_S = 20
_NUMBER = re.compile(r"-?\d+\.\d+(?:e-?\d+)?f")
_TABLE = re.compile(r"^static const nmpc_real_t (\w+)(?:\[\w+\])+ = \{(.*?)\};$", re.MULTILINE | re.DOTALL)
TABLES = {"tilt_rows", "integral_rows", "lagged_rows", "move_rows", "move_ratios"}


class Bench:
    """Builds the self-test of a bundle, or a mutant of it, against the controller with wrong outputs."""

    def __init__(self, scalar: str, folder: Path) -> None:
        files = render(with_option(ONE_NORM, "code.scalar", scalar), with_digest=False)
        self.text = files[SELF_TEST]
        (steps,) = re.findall(r"#define NMPC_SELF_TEST_STEPS (\d+)", self.text)
        self.steps = int(steps)
        self._folder = place(files, folder / "controller")
        self._gcc = Toolchain((require("gcc", "gcc"),))
        program = Path(__file__).with_name("wrong_outputs.c")
        objects = [f"{number}.o" for number, _ in enumerate([CONTROLLER, program])]
        for source, name in zip([CONTROLLER, program], objects, strict=True):
            self._gcc.run([*FLAGS, *SANITIZED, "-c", str(source), "-o", name], self._folder)
        self._objects = objects

    def passes(self, mutant: Mutant | None = None) -> bool:
        """Whether each output, wrong in the first step, the last, or from the second on, is found there."""
        text = self.text if mutant is None else mutant.apply(self.text)
        (self._folder / SELF_TEST).write_text(text, "utf-8")
        line = [*FLAGS, *SANITIZED, *RENAMED, SELF_TEST, *self._objects, "-o", "wrong"]
        try:
            self._gcc.run(line, self._folder)
        except BuildError:
            return False
        last = self.steps - 1
        return all(
            self._results(first, to) == [first + 1] * OUTPUTS
            for first, to in ((0, 0), (1, last), (last, last))
        )

    def _results(self, first: int, last: int) -> list[int] | None:
        """Return the result for each wrong output; None after a crash, or if the right controller fails."""
        line = [str(self._folder / "wrong"), str(first), str(last)]
        try:
            done = subprocess.run(line, capture_output=True, text=True, check=True, timeout=LIMIT_S)
        except (subprocess.CalledProcessError, subprocess.TimeoutExpired):
            return None
        right, *wrong = done.stdout.split()
        return [int(result) for result in wrong] if right == "0" and "?" not in done.stdout else None

    def mutants(self) -> list[Mutant]:
        """Return the mutants of the function nmpc_self_test."""
        start = self.text.index("int nmpc_self_test(nmpc_t *scratch)\n{")
        end = self.text.index("\n}\n", start)
        return [mutant for mutant in mutants(SELF_TEST, self.text) if start < mutant.start < end]


@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", ["float32", "float64", "fixed"])
def test_the_first_step_with_a_wrong_output_is_named(scalar: str, tmp_path: Path) -> None:
    """Status, roll, pitch, cost and both gradients, each alone; 0 for the right controller."""
    assert Bench(scalar, tmp_path).passes()


@pytest.mark.long
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_every_fault_of_the_comparisons_is_noticed(scalar: str, tmp_path: Path) -> None:
    """All mutants of the function; the message has the lines of those that survive."""
    bench = Bench(scalar, tmp_path)
    found = bench.mutants()
    assert len(found) > 10
    assert [mutant.wrong_line for mutant in found if bench.passes(mutant)] == []


@pytest.fixture(scope="module")
def files() -> dict[str, str]:
    """Render the bundle once."""
    return render(EVERYTHING)


class SelfTest:
    """Builds the program whose result says whether a bundle's self-test notices."""

    def __init__(self, files: dict[str, str], folder: Path) -> None:
        (digest,) = re.findall(r"#define NMPC_SELF_TEST_DIGEST (\w+)", "\n".join(files.values()))
        self._folder = place(files, folder)
        self._gcc = require("gcc", "gcc")
        self._sources = sorted(path for path in files if re.fullmatch(r"[^/]*\.c", path))
        (folder / "run.c").write_text(
            '#include "nmpc.h"\n#include "nmpc_self_test.h"\n'
            "int main(void) { static nmpc_t self; unsigned long digest = 0; int i;\n"
            "    if (nmpc_self_test(&self) != 0) { return 1; }\n"
            "    for (i = 0; i < NMPC_SELF_TEST_EPISODES; i++) {\n"
            "        digest = nmpc_self_test_episode(&self, i, digest);\n    }\n"
            f"    return (digest == {digest}) ? 0 : 2; }}\n",
            "utf-8",
        )
        self._objects = {source: self._compile(source, "right") for source in [*self._sources, "run.c"]}

    def _compile(self, source: str, folder: str) -> str:
        """Compile a source and return its object; not optimised, which has the same bits in less time."""
        name = f"{folder}/{Path(source).stem}.o"
        (self._folder / folder).mkdir(exist_ok=True)
        flags = [*COMPILE_FLAGS, "-O0", "-w", "-c", source, "-o", name]
        subprocess.run([self._gcc, *flags], cwd=self._folder, check=True, capture_output=True)
        return name

    def result(self, changed: dict[str, str]) -> int:
        """Return 0 if the self-test and its digest pass with the `changed` files."""
        before = {path: (self._folder / path).read_text("utf-8") for path in changed}
        place(changed, self._folder)
        headers = any(path.endswith(".h") for path in changed)
        rebuilt = self._sources if headers else list(changed)
        objects = self._objects | {source: self._compile(source, "wrong") for source in rebuilt}
        line = [self._gcc, *objects.values(), "-o", "run"]
        subprocess.run(line, cwd=self._folder, check=True, capture_output=True)
        code = subprocess.run(["./run"], cwd=self._folder, check=False, timeout=60).returncode
        place(before, self._folder)
        return code


@pytest.mark.long
def test_the_self_test_notices_every_constant_of_every_table(files: dict[str, str], tmp_path: Path) -> None:
    """Each number of the rows and ratios, and of the attitude model, larger by a millionth."""
    bench = SelfTest(files, tmp_path)
    assert bench.result({}) == 0
    unnoticed, count = [], 0
    text = files[CONTROLLER]
    tables = [table for table in _TABLE.finditer(text) if table[1] in TABLES]
    for table in tables:
        for number in _NUMBER.finditer(text, *table.span(2)):
            if float(number[0][:-1]) == 0:
                continue
            count += 1
            larger = f"({number[0]} * 1.000001f)"
            changed = text[: number.start()] + larger + text[number.end() :]
            if bench.result({CONTROLLER: changed}) == 0:
                unnoticed.append(f"{table[1]}: {number[0]}")
    assert {table[1] for table in tables} == TABLES
    assert count == 2 * ((2 * 8) + 1 + 4 + 4 + 2)
    assert unnoticed == []


@pytest.mark.long
def test_the_self_test_notices_a_wrong_sign_anywhere_in_the_step(
    files: dict[str, str], tmp_path: Path
) -> None:
    """Each plus made a minus and the other way round, from the attitude model to the interface.

    The self-test makes steps only: it does not set a command in place of the last one, turn a heading or
    shift the frame.
    """
    bench = SelfTest(files, tmp_path)
    unnoticed, count = [], 0
    text = files[CONTROLLER]
    start = text.index("/* ---- Attitude")
    others = [
        range(found.start(), text.index("\n}\n", found.start()))
        for found in re.finditer(
            r"^.* (attitude_change_command|nmpc_set_command|nmpc_slew_heading|\w+_shift|\w+er_turn)\(",
            text,
            re.MULTILINE,
        )
    ]
    for mutant in mutants(CONTROLLER, text):
        if {text[mutant.start : mutant.end].strip(), mutant.wrong.strip()} != {"+", "-"}:
            continue
        if mutant.start < start or any(mutant.start in other for other in others):
            continue
        count += 1
        if bench.result({CONTROLLER: mutant.apply(text)}) == 0:
            unnoticed.append(mutant.wrong_line)
    assert count > 30
    assert unnoticed == []
