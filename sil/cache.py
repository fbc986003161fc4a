"""The compile cache: one private folder, one file a build, named by the hash of all that made it."""

import os
import stat
import tempfile
from collections.abc import Callable
from pathlib import Path

from sil.errors import CacheError


def cache_folder() -> Path:
    """Return the cache folder, made if need be, for this user alone.

    It is $XDG_CACHE_HOME/mambo-nmpc, by default ~/.cache/mambo-nmpc. Raises CacheError if it cannot be
    made, or if somebody else owns it or may write to it: compiled code is loaded from there.
    """
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    folder = Path(home) / "mambo-nmpc"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.stat()
    except OSError as error:
        raise CacheError(
            f"cannot use the cache folder {folder}: {error.strerror}; set XDG_CACHE_HOME"
        ) from error
    if status.st_uid != os.getuid() or status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise CacheError(
            f"others may write to the cache folder {folder}; make it yours alone: chmod 700 {folder}"
        )
    return folder


def cached(name: str, build: Callable[[Path], Path]) -> Path:
    """Return the cached file `name`, building it first if it is not there.

    `build` works in an empty folder and returns what it made, which is then renamed into place: two
    processes may build the same file at once, and a killed one leaves no half of it.
    """
    folder = cache_folder()
    path = folder / name
    if not path.exists():
        try:
            with tempfile.TemporaryDirectory(prefix="build-", dir=folder) as work:
                build(Path(work)).replace(path)
        except OSError as error:
            raise CacheError(f"cannot build in the cache folder {folder}: {error.strerror}") from error
    return path
