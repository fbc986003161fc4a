"""Compile a bundle's C with any compiler and flags, run tapes in it, and compare with the reference."""

import re
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Final

import numpy as np

from mambo_codegen.bundle.render import with_prefix
from mambo_codegen.errors import BuildError
from mambo_codegen.settings.model import Settings
from mambo_codegen.toolchain import Toolchain
from mambo_sil.verify.calls import ApiFunction, Outcomes, Tape, calls, outcome_type
from mambo_sil.verify.check import Subject
from mambo_sil.verify.tools import missing as missing_tool

LIMIT_S: Final = 600
"""Limit of the processor time of a program, in seconds."""

PACKAGES: Final = {"gcc": "gcc", "clang": "libclang-rt-dev"}
"""Debian's package with the run-time libraries of the sanitizers, by compiler."""

_SELF_TEST_FAILED: Final = 3
_REPORT: Final = re.compile(r"runtime error:|ERROR: |WARNING: ")

FLAGS: Final = ("-std=c99", "-ffp-contract=off", "-D_POSIX_C_SOURCE=200809L")


@dataclass(frozen=True)
class Replay:
    """What a program returned: the outcomes of its calls, its exit code and its error output."""

    outcomes: list[Outcomes]
    returncode: int
    report: str


@dataclass(frozen=True)
class Difference:
    """The first difference between C and reference; tape and call count from 0."""

    tape: int
    call: int
    what: str

    def __str__(self) -> str:
        return f"tape {self.tape}, call {self.call}: {self.what}"


def sources(subject: Subject) -> list[Path]:
    """Return the C sources of a bundle; raises BuildError if one or the harness is missing."""
    prefix = subject.settings.code.prefix
    found = [subject.bundle / f"{prefix}.c", subject.bundle / f"{prefix}_self_test.c"]
    absent = [path for path in (*found, subject.bundle / f"fuzz/{prefix}_fuzz.c") if not path.is_file()]
    if absent:
        raise BuildError(f"{absent[0]} is missing; generate the bundle again")
    return found


def missing(tool: str, flags: Sequence[str], folder: Path) -> str | None:
    """Return which tool and package is missing to build with `flags`; None if gcc or clang can do it."""
    gap = missing_tool(tool, tool)
    if gap:
        return gap
    (folder / "probe.c").write_text(
        "int LLVMFuzzerTestOneInput(void);\nint LLVMFuzzerTestOneInput(void) { return 0; }\n"
        + ("" if any("fuzzer" in flag for flag in flags) else "int main(void) { return 0; }\n")
    )
    try:
        Toolchain((tool,)).run([*flags, "probe.c", "-o", "probe"], folder)
    except BuildError:
        return f"{tool} cannot link with {' '.join(flags)}; Debian's package {PACKAGES[tool]} brings that"
    return None


def build(subject: Subject, tool: str, flags: Sequence[str], folder: Path) -> Path:
    """Compile the program that runs tapes into `folder`, and return its path; raises BuildError."""
    program = write_program(subject.settings.code.prefix, folder)
    includes = [f"-I{(subject.bundle / part).resolve()}" for part in (".", "fuzz")]
    units = [str(path.resolve()) for path in sources(subject)]
    Toolchain((tool,)).run([*FLAGS, *flags, *includes, program.name, *units, "-o", "replay"], folder)
    return folder / "replay"


def write_program(prefix: str, folder: Path) -> Path:
    """Write the C source of the program that runs tapes into `folder`."""
    text = resources.files("mambo_sil.verify").joinpath("replay.c").read_text("utf-8")
    program = folder / "replay.c"
    program.write_text(with_prefix(text, prefix), "utf-8")
    return program


def write_tapes(settings: Settings, tapes: Sequence[Tape], path: Path) -> None:
    """Write tapes into one file; a call of nmpc_init precedes each."""
    init = calls(settings, ApiFunction.INIT, np.zeros((1, 1)))
    path.write_bytes(b"".join(init.tobytes() + tape.tobytes() for tape in tapes))


def play(
    program: Path, tapes_file: Path, settings: Settings, tapes: Sequence[Tape], limit_s: int = LIMIT_S
) -> Replay:
    """Run `program` on the file that `write_tapes` wrote, for at most `limit_s` of processor time."""
    done = subprocess.run(
        [str(program.resolve()), str(tapes_file.resolve()), str(limit_s)],
        capture_output=True,
        cwd=program.parent,
        check=False,
    )
    layout = outcome_type(settings)
    made = np.frombuffer(done.stdout, layout, len(done.stdout) // layout.itemsize)
    starts = np.cumsum([0, *(1 + len(tape) for tape in tapes)])
    outcomes = [made[start + 1 : start + 1 + len(t)] for start, t in zip(starts[:-1], tapes, strict=True)]
    return Replay(outcomes, done.returncode, done.stderr.decode(errors="replace"))


def fault(played: Replay, expected: Sequence[Outcomes]) -> str | None:
    """Return the fault: a sanitizer's report, a different bit or a failed self-test; None without a fault."""
    if played.returncode not in {0, _SELF_TEST_FAILED}:
        reports = [line.strip() for line in played.report.splitlines() if _REPORT.search(line)]
        return reports[0] if reports else f"ended with {played.returncode}"
    found = difference(expected, played.outcomes)
    if found is not None:
        return str(found)
    return "the self-test fails" if played.returncode else None


def difference(expected: Sequence[Outcomes], found: Sequence[Outcomes]) -> Difference | None:
    """Return the first call whose outcome differs from the expected one in a bit; None if there is none."""
    for tape, (ours, theirs) in enumerate(zip(expected, found, strict=True)):
        if ours.tobytes() == theirs.tobytes():
            continue
        for call, (right, wrong) in enumerate(zip(ours, theirs, strict=False)):
            names = [name for name in right.dtype.names if right[name].tobytes() != wrong[name].tobytes()]
            if names:
                first = names[0]
                what = f"{', '.join(names)} differ ({first} {wrong[first]}, reference {right[first]})"
                return Difference(tape, call, what)
        return Difference(tape, len(theirs), "has no outcome")
    return None
