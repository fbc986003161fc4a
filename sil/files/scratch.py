"""Folders for the files of one build, removed after it."""

import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path

from mambo_nmpc.codegen.errors import echo
from mambo_nmpc.sil.errors import ScratchError


@contextlib.contextmanager
def scratch_folder() -> Iterator[Path]:
    """Yield a new folder for temporary files; raises ScratchError if the block cannot write there."""
    try:
        with tempfile.TemporaryDirectory(prefix="mambo-nmpc-") as work:
            yield Path(work)
    except OSError as error:
        raise ScratchError(
            f"{echo(tempfile.gettempdir())}: temporary files cannot be written: {error.strerror or error}; "
            "free some space there, or set TMPDIR to another folder"
        ) from error
