"""Tools that checks want: what to say where one is missing, and how to run one."""

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Final

PATIENCE_S: Final = 3600.0
"""Time that a tool gets before its check is incomplete, in seconds."""


def missing(tool: str, package: str) -> str | None:
    """Say which package brings `tool`; None if it is here."""
    return None if shutil.which(tool) else f"{tool} is missing; Debian's package {package} brings it"


def run(command: Sequence[str], folder: Path) -> "subprocess.CompletedProcess[str]":
    """Run `command` in `folder`, in English; raises TimeoutExpired after PATIENCE_S."""
    return subprocess.run(
        command,
        cwd=folder,
        env=os.environ | {"PWD": str(folder.resolve()), "LC_ALL": "C.UTF-8"},  # Frama-C believes PWD
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        timeout=PATIENCE_S,
        check=False,
    )
