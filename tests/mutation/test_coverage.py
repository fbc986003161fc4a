"""The verification cases run every line and branch of the generated C, except those with a reason."""

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from mambo_codegen.bundle.render import render
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_sil.verify.check import Subject
from tests.mutation.reasons import Key, is_explained, plain, survivors
from tests.support.cases import SCALARS, settings_case
from tests.support.one_norm import ONE_NORM
from tests.support.subjects import played_fault, subject
from tests.support.tools import require

REASONS = survivors("coverage_gaps.txt")
MAMBO = ONE_NORM
SETTINGS = {name: presets.load(name) for name in ("mambo-1norm", "table1", "table1-printed")} | {
    "fixed": with_option(MAMBO, "code.scalar", "fixed", "test"),
    "case 7": settings_case(7, "float64"),
}


def counts(its: Subject) -> dict[tuple[str, int], tuple[int, list[int]]]:
    """Play the cases; return {(file, line number): (runs, how often each branch was taken)}.

    Several objects contain the functions of a header: their counts are added.
    """
    require("gcov", "gcc")
    # Functions that are inlined in any case have their branches once for each call.
    assert played_fault(its, "--coverage", "-O0", "-Dalways_inline=unused") is None
    command = ["gcov", "--json-format", "--branch-probabilities", "--stdout"]
    objects = [str(path) for path in its.folder.glob("*.gcda")]
    done = subprocess.run([*command, *objects], cwd=its.folder, capture_output=True, text=True, check=True)
    lines: dict[tuple[str, int], tuple[int, list[int]]] = {}
    documents: list[Any] = [json.loads(line) for line in done.stdout.splitlines()]
    for file in (file for document in documents for file in document["files"]):
        path = Path(file["file"])
        if path.is_relative_to(its.bundle) and path.parent.name != "fuzz":
            name = path.relative_to(its.bundle).as_posix()
            for line in file["lines"]:
                taken = [branch["count"] for branch in line["branches"]]
                runs, before = lines.get((name, line["line_number"]), (0, [0] * len(taken)))
                summed = [sum(pair) for pair in zip(before, taken, strict=True)]
                lines[name, line["line_number"]] = (runs + line["count"], summed)
    return lines


def gaps(its: Subject) -> Iterator[Key]:
    """Yield every line that no case runs, and every branch that no case takes."""
    for (file, number), (runs, branches) in counts(its).items():
        line = plain((its.bundle / file).read_text("utf-8").splitlines()[number - 1])
        if runs == 0:
            yield file, line, "never run"
        else:
            yield from (
                (file, line, f"branch {index} never taken")
                for index, taken in enumerate(branches)
                if taken == 0
            )


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize("name", SETTINGS)
def test_every_line_runs_and_every_branch_is_taken(name: str, tmp_path: Path) -> None:
    """Whatever the settings; the counting build has the bits of the reference."""
    its = subject(SETTINGS[name], tmp_path)
    assert [gap for gap in gaps(its) if not is_explained(gap, REASONS, its.settings)] == []


@pytest.mark.long
def test_a_dead_line_and_its_branch_are_gaps(tmp_path: Path) -> None:
    """A condition that no input meets, and what it guards."""
    guard = "        if (!is_good_state(state))"
    dead = f"    if (status == NMPC_BAD_THRUST) {{\n        return NMPC_BAD_COMMAND;\n    }}\n{guard}"
    found = {(line, what) for _, line, what in gaps(subject(MAMBO, tmp_path, ("nmpc.c", guard, dead)))}
    assert ("return NMPC_BAD_COMMAND;", "never run") in found
    assert any(line == "if (status == NMPC_BAD_THRUST) {" for line, _ in found)


def test_every_reason_is_of_a_line_that_is_generated() -> None:
    """A row whose line is gone is removed."""
    bundles = [
        render(with_option(settings, "code.scalar", scalar, "test"), with_digest=False)
        for settings in (*map(presets.load, presets.names()), SETTINGS["case 7"])
        for scalar in SCALARS
    ]
    for file, line, _ in REASONS:
        assert any(line in plain(files.get(file, "")) for files in bundles), line
