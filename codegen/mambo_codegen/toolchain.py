"""Find and run C compilers, with readable messages if they are missing or fail."""

import errno
import os
import shlex
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

from mambo_codegen.errors import BuildError, UnwritableError, echo

_LACK_OF_SPACE: Final = (errno.ENOSPC, errno.EDQUOT)


@dataclass(frozen=True)
class Toolchain:
    """A compiler's command line, and an optimisation flag that overrides the bundle's."""

    command: tuple[str, ...]
    optimisation: str | None = None

    def run(self, arguments: Sequence[str], folder: Path) -> None:
        """Compile or link in `folder`.

        Raises BuildError with the first lines of the compiler's output, and UnwritableError if it had no
        space for its files.
        """
        line = [*self.command, *arguments]
        try:
            done = subprocess.run(
                line,
                cwd=folder,
                env=os.environ | {"LC_ALL": "C.UTF-8"},
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                errors="replace",
                check=False,
            )
        except OSError as error:
            raise BuildError(
                f"cannot run the C compiler {shlex.join(self.command)}: {error.strerror}"
            ) from error
        if done.returncode != 0:
            refuse_lack_of_space(self.command[0], done.stderr, folder)
            output = _first_lines(done.stderr or done.stdout) or f"exit code {done.returncode}, no output"
            raise BuildError(f"{shlex.join(line)} failed:\n{output}")

    def identity(self) -> str:
        """Return the output of --version, which tells builds of different compilers apart."""
        return _version(self.command)


def host_toolchain(optimisation: str | None = None) -> Toolchain:
    """Return the compiler in CC, else cc, gcc or clang; raises BuildError if there is none.

    A path in CC is relative to the current folder, not to the folder of a build.
    """
    line = os.environ.get("CC", "")
    try:
        named = shlex.split(line)
    except ValueError as error:
        raise BuildError(f"CC = {echo(line)} must be a command: {str(error).lower()}") from None
    if named:
        program, *arguments = named
        path = str(Path(program).absolute()) if os.sep in program else program
        return Toolchain((path, *arguments), optimisation)
    for name in ("cc", "gcc", "clang"):
        if _is_installed(name, os.environ.get("PATH")):
            return Toolchain((name,), optimisation)
    raise BuildError("no C compiler found (cc, gcc, clang); install one (Debian: gcc), or set CC")


def refuse_lack_of_space(tool: str, output: str, folder: Path) -> None:
    """Raise UnwritableError if a tool that failed in `folder` says that it could not write for lack of space.

    `output` is in English. If it names no temporary file, `folder` may be full as well.
    """
    for line in output.splitlines():
        if any(os.strerror(number) in line for number in _LACK_OF_SPACE):
            temporary = os.environ.get("TMPDIR") or "/tmp"
            advice = f"free some space in {temporary}, or set TMPDIR to another folder"
            if temporary not in line:
                advice += f"; or free some in {folder}"
            raise UnwritableError(f"{tool} cannot write its files: {line.strip()}; {advice}")


@lru_cache
def _is_installed(name: str, path: str | None) -> bool:
    """Return whether there is a program of this name on the PATH; campaigns ask for every few flights."""
    return shutil.which(name, path=path) is not None


@lru_cache
def _version(command: tuple[str, ...]) -> str:
    try:
        done = subprocess.run(
            [*command, "--version"], capture_output=True, text=True, errors="replace", check=False
        )
    except OSError as error:
        raise BuildError(f"cannot run the C compiler {shlex.join(command)}: {error.strerror}") from error
    return done.stdout


def _first_lines(text: str, count: int = 20) -> str:
    lines = text.splitlines()
    return "\n".join(lines[:count] + ([f"... {len(lines) - count} more lines"] if len(lines) > count else []))
