"""The cache of this user: a private folder with compiled C, compiled templates and kept results."""

import contextlib
import hashlib
import os
import stat
import tempfile
from pathlib import Path
from typing import Final

from mambo_codegen.errors import CacheError

_DIGEST_BYTES: Final = 32


def cache_folder() -> Path:
    """Return the cache folder, which is made for this user alone where there is none.

    It is $XDG_CACHE_HOME/mambo-nmpc, by default ~/.cache/mambo-nmpc. Raises CacheError if it cannot be made,
    or if others may write to it: compiled code is loaded from there.
    """
    try:
        folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "mambo-nmpc"
    except RuntimeError:
        raise CacheError("this user has no home folder for the compile cache; set XDG_CACHE_HOME") from None
    if not folder.is_absolute():
        raise CacheError(f"the cache folder {folder} must be an absolute path; set XDG_CACHE_HOME")
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.stat()
    except OSError as error:
        raise CacheError(
            f"cannot use the cache folder {folder}: {error.strerror}; set XDG_CACHE_HOME"
        ) from error
    if status.st_uid != os.getuid() or status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise CacheError(
            f"others may write to the cache folder {folder}, from which compiled code is loaded; "
            "take that right from them (chmod go-w), or set XDG_CACHE_HOME to a folder of yours"
        )
    return folder


def read_cached(folder: str, name: str) -> bytes | None:
    """Return what `write_cached` wrote; None if it is missing or damaged, or there is no cache."""
    try:
        content = (cache_folder() / folder / name).read_bytes()
    except (CacheError, OSError):
        return None
    digest, content = content[:_DIGEST_BYTES], content[_DIGEST_BYTES:]
    return content if digest == hashlib.sha256(content).digest() else None


def write_cached(folder: str, name: str, content: bytes) -> None:
    """Write the file `name` in a folder of the cache, whole or not at all; without a cache do nothing."""
    with contextlib.suppress(CacheError, OSError):
        place = cache_folder() / folder
        place.mkdir(mode=0o700, exist_ok=True)
        handle, new = tempfile.mkstemp(dir=place)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(hashlib.sha256(content).digest() + content)
            Path(new).replace(place / name)
        except OSError:
            Path(new).unlink(missing_ok=True)
