"""Find and run the tools of the checks, and read numbers from their logs."""

import os
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from mambo_codegen.toolchain import refuse_lack_of_space
from mambo_sil.board.firmware.tool_report import command_version

TIME_LIMIT_S: Final = 3600.0
"""Time limit of a tool, in seconds."""


def missing(tool: str, package: str) -> str | None:
    """Return a message with the package of `tool` if it is not installed, else None."""
    return None if shutil.which(tool) else f"{tool} is missing (Debian: {package})"


def versions(tools: Sequence[str]) -> dict[str, str]:
    """Return {tool: version} of the installed ones."""
    return {tool: version for tool in tools if (version := command_version(tool)) is not None}


def run(command: Sequence[str], folder: Path) -> "subprocess.CompletedProcess[str]":
    """Run `command` in `folder`, with English messages.

    Raises TimeoutExpired after TIME_LIMIT_S, and UnwritableError if the tool had no space for its files.
    """
    done = subprocess.run(
        command,
        cwd=folder,
        env=os.environ
        | {"PWD": str(folder.resolve()), "LC_ALL": "C.UTF-8"},  # Frama-C takes its folder from PWD
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        timeout=TIME_LIMIT_S,
        check=False,
    )
    if done.returncode != 0:
        refuse_lack_of_space(command[0], done.stderr + done.stdout, folder)
    return done


def number(log: str, pattern: str) -> int:
    """Return the number that the group of `pattern` finds in a log, 0 if there is none."""
    found = re.search(pattern, log)
    return int(found[1]) if found else 0
