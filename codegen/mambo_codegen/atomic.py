"""Write files whole or not at all: a new file is written next to its destination, then renamed onto it."""

import contextlib
import errno
import os
import stat
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

from mambo_codegen.plain_file import find_obstacle

_NEW = ".mambo-nmpc-new"


def put(place: Path, content: bytes) -> None:
    """Write one file whole or not at all; make its folder if it is missing.

    Raises OSError, also for what is neither a plain file nor nothing: a pipe, a link to nothing.
    """
    if obstacle := find_obstacle(place):
        raise OSError(errno.EINVAL, f"it is {obstacle}; name a plain file", str(place))
    with stage({place: content}):
        pass


@contextlib.contextmanager
def put_stream(place: Path) -> Iterator[BinaryIO]:
    """Yield a new file that replaces the one at `place` when the block ends; for what is too large for `put`.

    Raises OSError as `put`. If the block raises, the old file stays.
    """
    if obstacle := find_obstacle(place):
        raise OSError(errno.EINVAL, f"it is {obstacle}; name a plain file", str(place))
    new = _new_path(place)
    try:
        with new.open("wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        new.replace(place)
    except BaseException as error:
        with contextlib.suppress(OSError):
            new.unlink()
        if isinstance(error, OSError):
            error.filename = str(place)
        raise


@contextlib.contextmanager
def stage(files: Mapping[Path, bytes | None]) -> Iterator[None]:
    """Write new files next to their destinations; when the block ends, rename them in the order of `files`.

    A content of None removes the file, and then its folder if that is empty. An error before the first
    rename leaves every destination as it was. Raises OSError with the destination as its file name.
    """
    missing = {folder for place in files for folder in place.parents if not folder.exists()}
    new = {place: _new_path(place) for place in files}
    try:
        for place, content in files.items():
            if content is not None:
                _write(new[place], place, content)
        yield
        for place, content in files.items():
            if content is not None:
                new[place].replace(place)
            else:
                place.unlink(missing_ok=True)
                with contextlib.suppress(OSError):
                    os.removedirs(place.parent)
    except BaseException:
        for path in new.values():
            with contextlib.suppress(OSError):
                path.unlink()
        for folder in sorted(missing, reverse=True):
            with contextlib.suppress(OSError):
                folder.rmdir()
        raise


def _new_path(place: Path) -> Path:
    """Return where the new file for `place` is written."""
    return place.with_name(f".{place.name}.{os.getpid()}{_NEW}")


def is_left_over(path: str) -> bool:
    """Whether `path` is a new file that a killed run did not rename."""
    return path.endswith(_NEW)


def _write(new: Path, place: Path, content: bytes) -> None:
    """Write and sync the file `new`; it takes permissions and owner of the file at `place`, if any."""
    try:
        if not place.parent.exists():
            place.parent.mkdir(parents=True, exist_ok=True)
        with new.open("wb") as file:
            if place.is_file() and not place.is_symlink():
                old = place.stat()
                with contextlib.suppress(OSError):
                    os.fchown(file.fileno(), old.st_uid, old.st_gid)
                with contextlib.suppress(OSError):
                    os.fchmod(file.fileno(), stat.S_IMODE(old.st_mode))
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        error.filename = str(place)
        raise
