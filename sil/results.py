"""Result folders: made for one run, written by us alone, and never on top of somebody's work."""

import json
from pathlib import Path
from typing import Any, Final

import codegen
from codegen.errors import ForeignFilesError, UnwritableError, echo

SUMMARY: Final = "summary.json"
"""The file that marks a folder as ours; it is written last."""


def result_folder(folder: Path) -> Path:
    """Return `folder`, made if need be, for results to go into.

    Earlier results are overwritten. Raises ForeignFilesError for a folder that holds other work, and
    UnwritableError if it cannot be written: before the flight rather than after it.
    """
    name = echo(str(folder))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()) and not (folder / SUMMARY).is_file():
            raise ForeignFilesError(f"{name}: holds files that are not our results; name another folder", ())
        (folder / SUMMARY).touch()
    except OSError as error:
        raise UnwritableError(f"{name}: cannot be written: {error.strerror}") from error
    return folder


def write_summary(folder: Path, summary: dict[str, Any]) -> None:
    """Write what a run found, with the version that found it."""
    text = json.dumps({"generator": f"mambo-nmpc {codegen.__version__}", **summary}, indent=2) + "\n"
    (folder / SUMMARY).write_text(text, "utf-8")
