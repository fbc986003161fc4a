"""The self-test names the first step with a wrong output; every small fault of its comparisons is noticed."""

import re
import subprocess
from pathlib import Path

import pytest

from mambo_codegen.bundle.render import render
from mambo_codegen.errors import BuildError
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.toolchain import Toolchain
from tests.mutation.mutants import Mutant, mutants
from tests.support.bundles import place
from tests.support.one_norm import ONE_NORM
from tests.support.tools import require

SELF_TEST = "nmpc_self_test.c"
CONTROLLER = ("nmpc.c",)
FLAGS = ("-std=c99", "-ffp-contract=off", "-w", "-I.")
SANITIZED = ("-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
RENAMED = ("-Dnmpc_step=wrong_step", "-Dnmpc_last_cost=wrong_last_cost")
OUTPUTS = 6
"""Status, two commands, cost, two gradients: the outputs that wrong_outputs.c makes wrong, one at a time."""
LIMIT_S = 20


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
        objects = [f"{number}.o" for number, _ in enumerate([*CONTROLLER, program])]
        for source, name in zip([*CONTROLLER, program], objects, strict=True):
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
