"""C compilers: found, never assumed, and run with a readable message when they fail."""

import os
import shlex
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from mambo_nmpc.codegen.errors import BuildError, echo


@dataclass(frozen=True)
class Toolchain:
    """A compiler as a command line, and the optimisation that replaces the bundle's own, if any."""

    command: tuple[str, ...]
    optimisation: str | None = None

    def run(self, arguments: Sequence[str], folder: Path) -> None:
        """Compile or link in `folder`; raises BuildError with the compiler's first words."""
        line = [*self.command, *arguments]
        try:
            done = subprocess.run(
                line,
                cwd=folder,
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
            said = _first_lines(done.stderr or done.stdout) or f"exit code {done.returncode}, without a word"
            raise BuildError(f"{shlex.join(line)} failed:\n{said}")

    def identity(self) -> str:
        """Name compiler and version: builds of different compilers are different builds."""
        return _version(self.command)


def host_toolchain(optimisation: str | None = None) -> Toolchain:
    """Take the compiler that CC names, else cc, gcc or clang; raises BuildError when there is none.

    A path in CC is relative to the folder of this call, not to that of a build.
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
        if shutil.which(name):
            return Toolchain((name,), optimisation)
    raise BuildError(
        "no C compiler found (cc, gcc, clang); install one, such as Debian's gcc, or name it in CC"
    )


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
