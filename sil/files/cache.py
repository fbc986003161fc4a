"""The compile cache: one private folder, one file a build, named by the hash of all that made it.

The hash of the content comes first in the name: a file that a full disk or a crash has cut short is known by
it and built anew, for loading one would kill the process.
"""

import contextlib
import hashlib
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

from mambo_nmpc.sil.errors import CacheError

_WORK: Final = "build-"
_ABANDONED_S: Final = 3600.0
"""Age at which the work folder of a build counts as left over by a killed process."""

_OTHERS_WRITE: Final = stat.S_IWGRP | stat.S_IWOTH


def cache_folder() -> Path:
    """Return the cache folder, made if need be, for this user alone; no link is in its path.

    It is $XDG_CACHE_HOME/mambo-nmpc, by default ~/.cache/mambo-nmpc. Raises CacheError if it cannot be
    made, or if somebody else may write to it or put another in its place: compiled code is loaded from there.
    """
    try:
        named = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "mambo-nmpc"
    except RuntimeError:
        raise CacheError("this user has no home folder for the compile cache; set XDG_CACHE_HOME") from None
    if not named.is_absolute():
        raise CacheError(f"the cache folder {named} must be an absolute path; set XDG_CACHE_HOME")
    try:
        folder = named.resolve()
        _refuse_shared(folder)
        for place in (*reversed(folder.parents), folder):
            place.mkdir(mode=0o700, exist_ok=True)
        _refuse_shared(folder)
    except (OSError, RuntimeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "is a loop of symbolic links"
        raise CacheError(f"cannot use the cache folder {named}: {reason}; set XDG_CACHE_HOME") from error
    return folder


def _refuse_shared(folder: Path) -> None:
    """Raise CacheError unless this user and root alone decide what is at `folder`, a path without links.

    Where others may write, as in /tmp, a sticky bit keeps them from what is not theirs.
    """
    for place in (place for place in (folder, *folder.parents) if place.exists()):
        status = place.stat()
        if status.st_uid not in (os.getuid(), 0):
            raise CacheError(
                f"the cache folder would depend on {place}, which belongs to somebody else; "
                "set XDG_CACHE_HOME to a folder of yours"
            )
        sticky = status.st_mode & stat.S_ISVTX and place != folder
        if status.st_mode & _OTHERS_WRITE and not sticky:
            raise CacheError(
                f"others may write to {place}, on which the cache folder depends; "
                "take that right from them (chmod go-w), or set XDG_CACHE_HOME to a folder of yours"
            )


def cached(name: str, build: Callable[[Path], Path]) -> Path:
    """Return the cached file `name`, its content's hash before its name, building it first if need be.

    `build` works in an empty folder and returns what it made, which is then renamed into place: two
    processes may build the same file at once, and a killed one leaves no half of it.
    """
    folder = cache_folder()
    try:
        for path in folder.glob(f"*-{name}"):
            if _is_ours(path) and path.name == _content_name(path, name):
                return path
        _clear_abandoned(folder)
        with tempfile.TemporaryDirectory(prefix=_WORK, dir=folder) as work:
            made = build(Path(work))
            made.chmod(0o600)
            with made.open("rb") as file:
                os.fsync(file.fileno())
            return made.replace(folder / _content_name(made, name))
    except OSError as error:
        raise CacheError(
            f"cannot build in the cache folder {folder}: {error.strerror}; set XDG_CACHE_HOME"
        ) from error


def _is_ours(path: Path) -> bool:
    """Whether `path` is a plain file that nobody else has put there while the folder was open to others."""
    status = path.lstat()
    return (
        stat.S_ISREG(status.st_mode) and status.st_uid == os.getuid() and not status.st_mode & _OTHERS_WRITE
    )


def _content_name(path: Path, name: str) -> str:
    """Return the name under which the cache holds the content of `path` as `name`."""
    return f"{hashlib.sha256(path.read_bytes()).hexdigest()[:32]}-{name}"


def _clear_abandoned(folder: Path) -> None:
    """Remove the work folders of builds that were killed."""
    for work in folder.glob(f"{_WORK}*"):
        with contextlib.suppress(FileNotFoundError):  # its build has just finished
            if time.time() - work.stat().st_mtime > _ABANDONED_S:
                shutil.rmtree(work, ignore_errors=True)
