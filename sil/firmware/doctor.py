"""Report which tools the project can use on this machine, and what each of them is for."""

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
"""Clang's library for fuzzing; not a command."""

PATIENCE_S: Final = 5.0
"""Time limit of one tool's --version, in seconds."""

Registry = Literal["Debian", "PyPI"]


@dataclass(frozen=True)
class Finding:
    """One tool, here or missing; `version` is empty if it is missing or prints none."""

    kind: str
    tool: str
    here: bool
    version: str
    enables: str
    registry: Registry
    packages: tuple[str, ...]


@dataclass(frozen=True)
class _Need:
    """A tool that the project uses: alternative commands, or the name of a Python package."""

    kind: str
    candidates: tuple[str, ...]
    enables: str
    registry: Registry
    packages: tuple[str, ...]


def examine() -> tuple[Finding, ...]:
    """Look for every tool, each for at most PATIENCE_S; never raises."""
    needs = _needs()
    with ThreadPoolExecutor(len(needs)) as pool:
        return tuple(pool.map(_find, needs))


def doctor_text(findings: Sequence[Finding]) -> str:
    """Return one line for each tool, then the commands that install what is missing."""
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
            lines.append(f"install what is missing from {registry}: {installer} {' '.join(missing)}")
    return "\n".join(lines)


def _needs() -> tuple[_Need, ...]:
    """Return the tools that the project uses: compilers, emulators, analysers, a builder."""
    known = [boards.load(name) for name in boards.names()]
    on_avr = [board.name for board in known if board.emulated_core.value == "avr"]
    on_others = [board.name for board in known if board.emulated_core.value != "avr"]
    return (
        _Need(
            "compiler", _host_compilers(), "compiles the C for this machine: fly, table2", "Debian", ("gcc",)
        ),
        _Need(
            "compiler", ("clang",), "second compiler: same-bits (except AVR), verify", "Debian", ("clang",)
        ),
        *_cross_compilers(known),
        _Need("emulator", ("unicorn",), f"emulates {', '.join(on_others)}", "PyPI", ("unicorn",)),
        _Need(
            "emulator",
            ("qemu-system-avr",),
            f"emulates {', '.join(on_avr)}",
            "Debian",
            ("qemu-system-misc",),
        ),
        _Need("analyser", ("pyelftools",), "footprint: flash and RAM", "PyPI", ("pyelftools",)),
        _Need("analyser", ("capstone",), "footprint: stack bound", "PyPI", ("capstone",)),
        _Need("analyser", ("nm",), "make test: symbols of a build", "Debian", ("binutils",)),
        _Need(
            "analyser",
            ("frama-c",),
            "verify: proof of absence of run-time errors",
            "Debian",
            ("frama-c-base",),
        ),
        _Need("analyser", ("cppcheck",), "verify: MISRA C:2012", "Debian", ("cppcheck",)),
        _Need("analyser", ("g++",), "verify: warnings as C++", "Debian", ("g++",)),
        _Need("analyser", (LIBFUZZER,), "verify: fuzzing", "Debian", ("clang", "libclang-rt-14-dev")),
        _Need("analyser", ("gcov",), "make test: which lines of the C run", "Debian", ("gcc",)),
        _Need("builder", ("cmake",), "make test: build of a bundle with CMake", "Debian", ("cmake",)),
    )


def _host_compilers() -> tuple[str, ...]:
    """Return the compiler that `host_toolchain` chooses; if there is none, those that it tries."""
    try:
        return (shlex.join(host_toolchain().command),)
    except (BuildError, ValueError):
        return ("cc", "gcc", "clang")


def _cross_compilers(known: Sequence[Board]) -> tuple[_Need, ...]:
    """Return one need for each cross compiler, with the boards that it builds for."""
    served: dict[tuple[tuple[str, ...], tuple[str, ...]], list[str]] = {}
    for board in known:
        served.setdefault((board.compiler.candidates, board.compiler.packages), []).append(board.name)
    return tuple(
        _Need("compiler", candidates, f"builds for {', '.join(names)}", "Debian", packages)
        for (candidates, packages), names in served.items()
    )


def _find(need: _Need) -> Finding:
    """Return a finding for the first candidate that is here; if none is, one that names all."""
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
    """Return the version that the command prints, "" if it prints none in time, None if it is missing."""
    if candidate == LIBFUZZER:
        return _libfuzzer_version()
    command = shlex.split(candidate)
    if shutil.which(command[0]) is None:
        return None
    output = _capture_stdout([*command, "--version"])
    first_line = (output or "").partition("\n")[0]
    number = re.search(r"\d+(\.\d+)+", re.sub(r"\([^)]*\)", "", first_line))
    return number[0] if number else ""


def _libfuzzer_version() -> str | None:
    """Return the version of clang if it has the library, else None."""
    clang = shutil.which("clang")
    if clang is None:
        return None
    name = f"libclang_rt.fuzzer-{platform.machine()}.a"
    library = _capture_stdout([clang, f"-print-file-name={name}"])
    return command_version("clang") if library and Path(library.strip()).is_file() else None


def _capture_stdout(command: Sequence[str]) -> str | None:
    """Return the stdout of a command, None if it cannot run or does not end within PATIENCE_S."""
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
