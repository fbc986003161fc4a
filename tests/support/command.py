"""The whole command, run as a person would type it."""

import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from typer.testing import CliRunner

from mambo_codegen import extensions
from mambo_sil.cli.app import app, panels

MAIN: Final = "from mambo_sil.cli.app import main; main()"
"""The script that is mambo-nmpc."""
HEARS_CTRL_C: Final = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
"""Begins a script that Ctrl-C stops, also where the tests run with SIGINT ignored, which children inherit."""


def run(*arguments: str, code: int = 0) -> tuple[str, str]:
    """Run mambo-nmpc, demand its exit code, and return stdout and stderr."""
    result = CliRunner().invoke(app(), arguments)
    assert result.exit_code == code, (result.output, result.exception)
    return result.stdout, without_progress(result.stderr)


def of_installed(lines: Iterable[str]) -> list[str]:
    """Return the lines without those of commands and apps whose extension is not there."""
    commands = {name for panel in panels().values() for name in panel}
    return [
        line
        for line in lines
        if line.split()[0] in commands and ("--app" not in line or extensions.names("apps"))
    ]


def without_progress(text: str) -> str:
    """Return printed text without the lines on the progress of a command that takes longer than 2 s."""
    return re.sub(r"^.*, \d+ (?:s|min) so far\n", "", text, flags=re.MULTILINE)


def unwrapped(text: str) -> str:
    """Return printed text on one line, its words one space apart."""
    return " ".join(text.split())


def without(package: str) -> str:
    """Return the script that is mambo-nmpc where a package is not installed."""
    return f"import sys; sys.modules[{package!r}] = None; {MAIN}"


def command(
    *arguments: object,
    folder: Path | None = None,
    script: str = MAIN,
) -> subprocess.CompletedProcess[str]:
    """Run mambo-nmpc in `folder` and a session of its own, until all that hold its output have ended.

    `script` is the Python that runs it; Ctrl-C stops it.
    """
    line = [sys.executable, "-c", HEARS_CTRL_C + script, *map(str, arguments)]
    done = subprocess.run(
        line, cwd=folder, capture_output=True, text=True, check=False, timeout=120, start_new_session=True
    )
    done.stderr = without_progress(done.stderr)
    return done
