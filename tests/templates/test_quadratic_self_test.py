"""The self-test of a quadratic cost notices a wrong constant or sign."""

import re
import subprocess
from pathlib import Path

import pytest

from mambo_codegen.bundle.flags import COMPILE_FLAGS
from mambo_codegen.bundle.render import render
from tests.mutation.mutants import mutants
from tests.support.bundles import place
from tests.support.quadratic import EVERYTHING
from tests.support.tools import require

CONTROLLER = "nmpc.c"

_NUMBER = re.compile(r"-?\d+\.\d+(?:e-?\d+)?f")
_TABLE = re.compile(r"^static const nmpc_real_t (\w+)(?:\[\w+\])+ = \{(.*?)\};$", re.MULTILINE | re.DOTALL)
TABLES = {"tilt_rows", "integral_rows", "lagged_rows", "move_rows", "move_ratios"}


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
