"""Check: the project's cases run every line and take every branch of the C, or the reason is listed."""

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from mambo_nmpc.codegen.errors import BuildError
from mambo_nmpc.sil.firmware.doctor import command_version
from mambo_nmpc.sil.verify import replay
from mambo_nmpc.sil.verify.cases import cases
from mambo_nmpc.sil.verify.check import Outcome, Result, Subject
from mambo_nmpc.sil.verify.tools import missing as missing_tool
from tests.support.coverage_reasons import REASONS
from tests.support.reasons import plain, reason_for, row

FLAGS: Final = ("--coverage", "-O0")


def check(subject: Subject) -> Result:
    """Play the cases on a build that counts; its bits are the reference's, so counting changed nothing."""
    tools = {tool: command_version(tool) or "" for tool in ("gcc", "gcov")}
    missing = replay.missing("gcc", FLAGS, subject.folder) or missing_tool("gcov", "gcc")
    if missing:
        return Result(Outcome.INCOMPLETE, missing, tools=tools)
    tapes, expected = cases(subject.settings)
    tapes_file = subject.folder / "tapes.bin"
    replay.write_tapes(subject.settings, tapes, tapes_file)
    try:
        program = replay.build(subject, "gcc", FLAGS, subject.folder)
    except BuildError as error:
        return Result(Outcome.FAILED, f"does not build: {error}", tools=tools)
    played = replay.play(program, tapes_file, subject.settings, tapes)
    fault = replay.fault(played, expected)
    if fault:
        return Result(Outcome.FAILED, f"the build that counts: {fault}", tools=tools)
    lines = _counts(subject)
    (subject.folder / "coverage.json").write_text(json.dumps(list(lines.values()), indent=1))
    return _result(subject, list(lines.values()), tools)


def _counts(subject: Subject) -> dict[tuple[str, int], dict[str, Any]]:
    """Return for each line of the bundle's C how often it ran, and how often each of its branches was taken.

    A function of a header is in every object that calls it: the counts add up.
    """
    objects = [str(path) for path in sorted(subject.folder.glob("*.gcda"))]
    done = subprocess.run(
        ["gcov", "--json-format", "--branch-probabilities", "--stdout", *objects],
        cwd=subject.folder,
        capture_output=True,
        text=True,
        check=True,
    )
    bundle = subject.bundle.resolve()
    lines: dict[tuple[str, int], dict[str, Any]] = {}
    for document in done.stdout.splitlines():
        for file in json.loads(document)["files"]:
            path = Path(file["file"]).resolve()
            if not path.is_relative_to(bundle) or path.parent.name == "fuzz":
                continue
            text = path.read_text("utf-8").splitlines()
            name = path.relative_to(bundle).as_posix()
            for line in file["lines"]:
                number = line["line_number"]
                entry = lines.setdefault(
                    (name, number),
                    {
                        "file": name,
                        "number": number,
                        "line": text[number - 1].strip(),
                        "count": 0,
                        "branches": [],
                    },
                )
                entry["count"] += line["count"]
                taken = [branch["count"] for branch in line["branches"]]
                entry["branches"] = [
                    sum(pair) for pair in zip(taken, entry["branches"] or [0] * len(taken), strict=True)
                ]
    return dict(sorted(lines.items()))


def _gaps(lines: list[dict[str, Any]]) -> Iterator[tuple[dict[str, Any], str]]:
    """Yield every line that no case ran, every branch that no case took, and which of them it is."""
    for line in lines:
        if line["count"] == 0:
            yield line, "never run"
        else:
            for branch, taken in enumerate(line["branches"]):
                if taken == 0:
                    yield line, f"branch {branch} never taken"


def _result(subject: Subject, lines: list[dict[str, Any]], tools: dict[str, str]) -> Result:
    prefix = subject.settings.code.prefix
    explained, unexplained, rows = [], [], []
    for line, what in _gaps(lines):
        key = plain(line["file"], prefix), plain(line["line"], prefix), what
        gap = f"{line['file']}:{line['number']}: {what}: {line['line']}"
        reason = reason_for(key, REASONS, subject.settings)
        if reason is None:
            unexplained.append(gap)
            rows.append(row(key))
        else:
            explained.append({"gap": gap, "reason": reason})
    branches = [taken for line in lines for taken in line["branches"]]
    figures = {
        "lines": len(lines),
        "lines_run": sum(line["count"] > 0 for line in lines),
        "branches": len(branches),
        "branches_taken": sum(taken > 0 for taken in branches),
        "explained": explained,
        "unexplained": unexplained,
    }
    evidence = (
        f"{figures['lines_run']} of {len(lines)} lines run, {figures['branches_taken']} of {len(branches)} "
        f"branches taken, {len(explained)} gaps explained"
    )
    if unexplained:
        log = subject.folder / "unexplained.txt"
        log.write_text(
            "\n".join(unexplained) + "\n\nrows for tests/support/coverage_reasons.py:\n" + "".join(rows)
        )
        evidence += f"; {len(unexplained)} not explained, the first {unexplained[0]}; all in {log}"
    return Result(Outcome.FAILED if unexplained else Outcome.PASSED, evidence, figures=figures, tools=tools)
