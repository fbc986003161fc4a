"""What there is of the tools that the project uses on this machine, and what each missing one would bring."""

import platform
import re
import shlex
import shutil
import subprocess
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Final, Literal

from mambo_nmpc.codegen import boards
from mambo_nmpc.codegen.boards import Board
from mambo_nmpc.codegen.errors import BuildError, echo
from mambo_nmpc.codegen.toolchain import host_toolchain

LIBFUZZER: Final = "libFuzzer"
"""A library of clang's, and no command: what links a fuzzer."""

PATIENCE_S: Final = 5.0
"""Time that a tool gets to tell its version, in seconds."""

Registry = Literal["Debian", "PyPI"]


@dataclass(frozen=True)
class Finding:
    """One tool, here or missing; `version` is empty if it is missing or does not tell."""

    kind: str
    tool: str
    here: bool
    version: str
    enables: str
    registry: Registry
    packages: tuple[str, ...]


@dataclass(frozen=True)
class _Need:
    """A tool that the project uses: commands of which one suffices, or the name of a Python package."""

    kind: str
    candidates: tuple[str, ...]
    enables: str
    registry: Registry
    packages: tuple[str, ...]


def examine() -> tuple[Finding, ...]:
    """Look for every tool; never raises, and gives none more than PATIENCE_S."""
    needs = _needs()
    with ThreadPoolExecutor(len(needs)) as pool:
        return tuple(pool.map(_look, needs))


def doctor_text(findings: Sequence[Finding]) -> str:
    """Spell the findings: a tool a line, then the commands that bring the missing ones."""
    rows = [
        (finding.kind, echo(finding.tool), finding.version or ("here" if finding.here else "missing"))
        for finding in findings
    ]
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    lines = [
        "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True))
        + f"  {finding.enables}"
        for row, finding in zip(rows, findings, strict=True)
    ]
    installers: dict[Registry, str] = {"Debian": "apt install", "PyPI": "pip install"}
    for registry, installer in installers.items():
        missing = sorted(
            {
                package
                for finding in findings
                if finding.registry == registry and not finding.here
                for package in finding.packages
            }
        )
        if missing:
            lines.append(f"to have what is missing from {registry}: {installer} {' '.join(missing)}")
    return "\n".join(lines)


def _needs() -> tuple[_Need, ...]:
    """Return what the project uses today: compilers, emulators, analysers, then what its tests ask for."""
    known = [boards.load(name) for name in boards.names()]
    on_avr = [board.name for board in known if board.emulated_core.value == "avr"]
    on_others = [board.name for board in known if board.emulated_core.value != "avr"]
    return (
        _Need("compiler", _host_compilers(), "flies the C here: fly, table2", "Debian", ("gcc",)),
        _Need("compiler", ("clang",), "builds for all but the AVR: same-bits, verify", "Debian", ("clang",)),
        *_cross_compilers(known),
        _Need("emulator", ("unicorn",), f"runs the C of {', '.join(on_others)}", "PyPI", ("unicorn",)),
        _Need(
            "emulator",
            ("qemu-system-avr",),
            f"runs the C of {', '.join(on_avr)}",
            "Debian",
            ("qemu-system-misc",),
        ),
        _Need("analyser", ("pyelftools",), "measures flash and RAM of a build", "PyPI", ("pyelftools",)),
        _Need("analyser", ("capstone",), "bounds the stack of a build", "PyPI", ("capstone",)),
        _Need("analyser", ("nm",), "lets make test check the symbols of a build", "Debian", ("binutils",)),
        _Need(
            "analyser",
            ("frama-c",),
            "verify: proves the absence of run-time errors",
            "Debian",
            ("frama-c-base",),
        ),
        _Need("analyser", ("cppcheck",), "verify: checks MISRA C:2012", "Debian", ("cppcheck",)),
        _Need("analyser", ("g++",), "verify: warnings of C++", "Debian", ("g++",)),
        _Need("analyser", (LIBFUZZER,), "verify: fuzzing", "Debian", ("clang", "libclang-rt-14-dev")),
        _Need("analyser", ("gcov",), "verify: counts what the tests reach", "Debian", ("gcc",)),
        _Need("builder", ("cmake",), "lets make test build a bundle with CMake", "Debian", ("cmake",)),
    )


def _host_compilers() -> tuple[str, ...]:
    """Return the compiler that a flight would take, or else those that it would look for."""
    try:
        return (shlex.join(host_toolchain().command),)
    except (BuildError, ValueError):
        return ("cc", "gcc", "clang")


def _cross_compilers(known: Sequence[Board]) -> tuple[_Need, ...]:
    """Return one need for each compiler, whatever the number of boards it builds for."""
    served: dict[tuple[tuple[str, ...], tuple[str, ...]], list[str]] = {}
    for board in known:
        served.setdefault((board.compiler.candidates, board.compiler.packages), []).append(board.name)
    return tuple(
        _Need("compiler", candidates, f"builds for {', '.join(names)}", "Debian", packages)
        for (candidates, packages), names in served.items()
    )


def _look(need: _Need) -> Finding:
    """Return the first candidate that is here, or all of them as missing."""
    for candidate in need.candidates:
        version = _package_version(candidate) if need.registry == "PyPI" else command_version(candidate)
        if version is not None:
            return Finding(need.kind, candidate, True, version, need.enables, need.registry, need.packages)
    tools = " or ".join(need.candidates)
    return Finding(need.kind, tools, False, "", need.enables, need.registry, need.packages)


def _package_version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def command_version(candidate: str) -> str | None:
    """Return the version that the command tells, "" if it tells none in time, None if it is missing."""
    if candidate == LIBFUZZER:
        return _libfuzzer_version()
    command = shlex.split(candidate)
    if shutil.which(command[0]) is None:
        return None
    said = _said([*command, "--version"])
    first_line = (said or "").partition("\n")[0]
    number = re.search(r"\d+(\.\d+)+", re.sub(r"\([^)]*\)", "", first_line))
    return number[0] if number else ""


def _libfuzzer_version() -> str | None:
    """Return the version of the clang that has the library, None if none has."""
    clang = shutil.which("clang")
    if clang is None:
        return None
    name = f"libclang_rt.fuzzer-{platform.machine()}.a"
    library = _said([clang, f"-print-file-name={name}"])
    return command_version("clang") if library and Path(library.strip()).is_file() else None


def _said(command: Sequence[str]) -> str | None:
    """Return what a command prints, None if it cannot be run or does not end in time."""
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=PATIENCE_S,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout
