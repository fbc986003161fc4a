"""Folders for the files of one build, removed after it."""

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from mambo_codegen.errors import echo
from mambo_sil.errors import ScratchError


@contextlib.contextmanager
def scratch_folder() -> Iterator[Path]:
    """Yield a new folder for temporary files; raises ScratchError if the block cannot write there."""
    try:
        with tempfile.TemporaryDirectory(prefix="mambo-nmpc-") as work:
            yield Path(work)
    except OSError as error:
        raise _refusal(tempfile.gettempdir(), error) from error


def check_tmpdir() -> None:
    """Raise ScratchError if TMPDIR names a folder that cannot be written.

    Python and gcc would use another folder; clang and Frama-C fail, each with words of its own.
    """
    folder = os.environ.get("TMPDIR")
    if folder:
        try:
            with tempfile.TemporaryFile(dir=folder) as file:
                file.write(b"test")
        except OSError as error:
            raise _refusal(folder, error) from error


def _refusal(folder: str, error: OSError) -> ScratchError:
    """Return the error of a folder in which temporary files cannot be written."""
    return ScratchError(
        f"{echo(folder)}: temporary files cannot be written: {error.strerror or error}; "
        "free some space there, or set TMPDIR to another folder"
    )
