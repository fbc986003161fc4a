"""The tools of the checks: which package brings one, how one is run, and what is read off its log."""

import os
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from mambo_nmpc.sil.firmware.doctor import command_version

PATIENCE_S: Final = 3600.0
"""Time limit of a tool, in seconds."""


def missing(tool: str, package: str) -> str | None:
    """Say which package brings `tool`; None if it is here."""
    return None if shutil.which(tool) else f"{tool} is missing; Debian's package {package} brings it"


def versions(tools: Sequence[str]) -> dict[str, str]:
    """Return {tool: version} of those that are here."""
    return {tool: version for tool in tools if (version := command_version(tool)) is not None}


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


def number(log: str, pattern: str) -> int:
    """Return the number that the group of `pattern` finds in a log, 0 if there is none."""
    found = re.search(pattern, log)
    return int(found[1]) if found else 0
