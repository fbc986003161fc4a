"""The whole command, run as a person would type it."""

import subprocess
import sys
from pathlib import Path

from typer.testing import CliRunner

from mambo_nmpc.sil.cli.app import app


def run(*arguments: str, code: int = 0) -> tuple[str, str]:
    """Run mambo-nmpc, demand its exit code, and return stdout and stderr."""
    result = CliRunner().invoke(app(), arguments)
    assert result.exit_code == code, (result.output, result.exception)
    return result.stdout, result.stderr


def command(*arguments: str | Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run mambo-nmpc in `folder`, in a process of its own."""
    script = "from mambo_nmpc.sil.cli.app import main; main()"
    line = [sys.executable, "-c", script, *map(str, arguments)]
    return subprocess.run(line, cwd=folder, capture_output=True, text=True, check=False)
