"""Folders of builds: those that are removed after it, and the compile cache.

The cache is one private folder with one file a build, named by the hash of all that made it. The name begins
with the hash of the content. So a file that a full disk or a crash has cut short is recognised and built
anew: to load it would kill the process.
"""

import contextlib
import hashlib
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Final

from mambo_codegen.errors import CacheError, echo
from mambo_codegen.user_cache import cache_folder
from mambo_sil.errors import ScratchError

_WORK: Final = "build-"
_ABANDONED_S: Final = 3600.0
"""Age beyond which the work folder of a build is regarded as left by a killed process."""


def build_cached(name: str, build: Callable[[Path], Path]) -> Path:
    """Return the path of the cached file `name`; build it if it is missing or damaged.

    `build(folder)` builds in an empty folder and returns the path of its result, which is then renamed into
    place. So two processes may build the same file at once, and a killed one leaves no partial file. Raises
    CacheError if the cache folder cannot be used.
    """
    folder = cache_folder()
    try:
        for path in folder.glob(f"*-{name}"):
            if path.name == _content_name(path, name):
                return path
        _clear_abandoned(folder)
        with tempfile.TemporaryDirectory(prefix=_WORK, dir=folder) as work:
            made = build(Path(work))
            with made.open("rb") as file:
                os.fsync(file.fileno())
            return made.replace(folder / _content_name(made, name))
    except OSError as error:
        raise CacheError(
            f"cannot build in the cache folder {folder}: {error.strerror}; set XDG_CACHE_HOME"
        ) from error


def _content_name(path: Path, name: str) -> str:
    """Return the name under which the cache holds the content of `path` as `name`."""
    return f"{hashlib.sha256(path.read_bytes()).hexdigest()[:32]}-{name}"


def _clear_abandoned(folder: Path) -> None:
    """Remove the work folders of builds that were killed."""
    for work in folder.glob(f"{_WORK}*"):
        with contextlib.suppress(FileNotFoundError):  # its build has just finished
            if time.time() - work.stat().st_mtime > _ABANDONED_S:
                shutil.rmtree(work, ignore_errors=True)


def write_sources(files: Mapping[str, str], folder: Path) -> None:
    """Write the text of files {path: text} into a folder."""
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, "utf-8")


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
