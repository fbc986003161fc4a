"""Report which tools the project can use on this machine, and what each of them is for."""

import platform
import re
import shlex
import shutil
import subprocess
from collections import defaultdict
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path
from typing import Final, Literal

from mambo_codegen import boards
from mambo_codegen.errors import BuildError, echo
from mambo_codegen.toolchain import host_toolchain
from mambo_sil.results.terminal import sentence, table

LIBFUZZER: Final = "libFuzzer"
LIBSIMAVR: Final = "libsimavr"
"""Clang's library for fuzzing, and simavr's; not commands."""

TIME_LIMIT_S: Final = 5.0
"""Time limit of one tool's --version, in seconds."""

Registry = Literal["Debian", "PyPI"]
_OR: Final = " or "


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


def examine() -> tuple[Finding, ...]:
    """Look for every tool, each for at most TIME_LIMIT_S; never raises."""
    needs = _needs()
    with ThreadPoolExecutor(len(needs)) as pool:
        return tuple(pool.map(_find, needs))


def doctor_text(findings: Sequence[Finding]) -> str:
    """Return one line for each tool, then the commands that install what is missing."""
    rows = [
        (one.kind, echo(one.tool), one.version or ("here" if one.here else "missing"), one.enables)
        for one in findings
    ]
    absent = [one for one in findings if not one.here]
    missing_tools = ", ".join(echo(one.tool) for one in absent)
    answer = f"{len(findings) - len(absent)} of {len(findings)} tools are here"
    lines = [sentence(f"{answer}; missing: {missing_tools}" if absent else answer), ""]
    lines += table(("kind", "tool", "version", "what for"), rows, (0, 1, 2, 3))
    for registry, installer in (("Debian", "apt install"), ("PyPI", "pip install")):
        missing = {package for one in absent if one.registry == registry for package in one.packages}
        if missing:
            lines.append(f"install what is missing from {registry}: {installer} {' '.join(sorted(missing))}")
    return "\n".join(lines)


def _needs() -> list[Finding]:
    """Return the tools that the project uses, as missing; `tool` names alternatives with `or`."""
    known = [boards.load(name) for name in boards.names()]
    on_avr = [board.name for board in known if board.emulated_core.value == "avr"]
    on_others = [board.name for board in known if board.emulated_core.value != "avr"]
    builder_of: dict[tuple[str, tuple[str, ...]], list[str]] = defaultdict(list)
    for board in known:
        builder_of[_OR.join(board.compiler.candidates), board.compiler.packages].append(board.name)
    return [
        _need("compiler", _host_compiler(), "compiles the C for this machine: fly, table2", "gcc"),
        _need("compiler", "clang", "second compiler: check-bits (except AVR), verify", "clang"),
        *(
            _need("compiler", tool, f"builds for {', '.join(names)}", *packages)
            for (tool, packages), names in builder_of.items()
        ),
        _need("emulator", "unicorn", f"the extra emulation: runs the C for {', '.join(on_others)}"),
        _need("emulator", LIBSIMAVR, f"emulates {', '.join(on_avr)}", "libsimavr-dev"),
        _need("analyser", "pyelftools", "footprint: flash and RAM"),
        _need("analyser", "capstone", "footprint: stack bound"),
        _need("analyser", "nm", "make test: symbols of a build", "binutils"),
        _need("analyser", "frama-c", "verify: proof of absence of run-time errors", "frama-c-base"),
        _need("analyser", "cppcheck", "verify: MISRA C:2012", "cppcheck"),
        _need("analyser", "g++", "verify: warnings as C++", "g++"),
        _need("analyser", LIBFUZZER, "verify: fuzzing", "clang", "libclang-rt-14-dev"),
        _need("analyser", "gcov", "make test: which lines of the C run", "gcc"),
        _need("builder", "wasm-ld", "playground, with clang: links WebAssembly", "lld"),
        _need("builder", "cmake", "make test: build of a bundle with CMake", "cmake"),
    ]


def _need(kind: str, tool: str, enables: str, *debian: str) -> Finding:
    """Return a tool of Debian's packages `debian`, or else the package of PyPI with its name."""
    registry: Registry = "Debian" if debian else "PyPI"
    return Finding(kind, tool, False, "", enables, registry, debian or (tool,))


def _host_compiler() -> str:
    """Return the compiler that `host_toolchain` chooses; if there is none, those that it tries."""
    try:
        return shlex.join(host_toolchain().command)
    except (BuildError, ValueError):
        return _OR.join(("cc", "gcc", "clang"))


def _find(need: Finding) -> Finding:
    """Return `need` with the first of its alternatives that is here and the version of that."""
    version_of = _package_version if need.registry == "PyPI" else command_version
    for tool in need.tool.split(_OR):
        version = version_of(tool)
        if version is not None:
            return replace(need, tool=tool, here=True, version=version)
    return need


def _package_version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def command_version(candidate: str) -> str | None:
    """Return the version that the command prints, "" if it prints none in time, None if it is missing."""
    if candidate == LIBFUZZER:
        return (
            command_version("clang")
            if _has_library("clang", f"libclang_rt.fuzzer-{platform.machine()}.a")
            else None
        )
    if candidate == LIBSIMAVR:
        return "" if _has_library(_host_compiler(), "libsimavr.so") else None
    command = shlex.split(candidate)
    if shutil.which(command[0]) is None:
        return None
    output = _capture_stdout([*command, "--version"])
    first_line = (output or "").partition("\n")[0]
    number = re.search(r"\d+(\.\d+)+", re.sub(r"\([^)]*\)", "", first_line))
    return number[0] if number else ""


def _has_library(compiler: str, name: str) -> bool:
    """Say whether a compiler finds a library."""
    path = _capture_stdout([*shlex.split(compiler), f"-print-file-name={name}"])
    return path is not None and Path(path.strip()).is_file()


def _capture_stdout(command: Sequence[str]) -> str | None:
    """Return the stdout of a command, None if it cannot run or does not end within TIME_LIMIT_S."""
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=TIME_LIMIT_S,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout
