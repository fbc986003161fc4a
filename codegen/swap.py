"""Replace a folder as a whole: the new one is built beside it and takes its place by a rename.

Whoever looks sees the old folder, the new one, or for a moment none; never a mixture. A run killed at any
point leaves at most two hidden siblings, `.NAME.mambo-nmpc-new` and `.NAME.mambo-nmpc-old`; the next run
puts them right.
"""

import contextlib
import fcntl
import os
import shutil
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from codegen.errors import UnwritableError, echo


@contextlib.contextmanager
def exclusive(target: Path) -> Iterator[None]:
    """Hold `target` for one run: make its parents, wait for another run, put right what a killed one left.

    Parents made here are removed again when the run fails. Raises UnwritableError.
    """
    missing = [parent for parent in target.parents if not parent.exists()]
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with _lock(target.parent):
            _recover(target)
            yield
    except BaseException:
        for parent in missing:
            with contextlib.suppress(OSError):
                parent.rmdir()
        raise


def replace(target: Path, written: Mapping[str, bytes], removed: Collection[str]) -> None:
    """Swap in a folder that holds what `target` holds, less `removed`, with `written` new or changed.

    Whatever stays is the same file (a hard link while both folders exist), times and permissions included.
    Raises OSError or UnwritableError, and then `target` is as it was.
    """
    fresh, aside = _fresh(target), _aside(target)
    try:
        fresh.mkdir()
        if target.exists():
            _carry_over(target, fresh, {*written, *removed})
        for path, content in written.items():
            _write(fresh / path, content)
        _finish_folders(target, fresh)
        if target.exists():
            target.rename(aside)
        fresh.rename(target)
        _sync(target.parent)
    finally:
        if aside.exists() and not target.exists():
            aside.rename(target)
        for left_over in (fresh, aside):
            shutil.rmtree(left_over, ignore_errors=True)


def _fresh(target: Path) -> Path:
    return target.with_name(f".{target.name}.mambo-nmpc-new")


def _aside(target: Path) -> Path:
    return target.with_name(f".{target.name}.mambo-nmpc-old")


@contextlib.contextmanager
def _lock(folder: Path) -> Iterator[None]:
    """Lock `folder` against other runs; a file system without locks goes without."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with contextlib.suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def _recover(target: Path) -> None:
    """Undo what a killed run left: put the old folder back if there is none, and clear the rest.

    Raises UnwritableError if somebody made a new `target` meanwhile and the old one holds other work.
    """
    fresh, aside = _fresh(target), _aside(target)
    if aside.exists() and not target.exists():
        aside.rename(target)
    if aside.exists() and not fresh.exists():
        shutil.rmtree(aside)
    elif aside.exists():
        raise UnwritableError(
            f"{echo(str(aside))}: holds the files of a run that was killed; move it back over "
            f"{echo(target.name)}, or remove it"
        )
    if fresh.exists():
        shutil.rmtree(fresh)


def _carry_over(target: Path, fresh: Path, without: Collection[str]) -> None:
    """Link every file of `target` into `fresh` except those `without`, and make the folders they stand in.

    Folders that hold nothing but such files are left out. Raises UnwritableError for what cannot be linked.
    """
    for folder, folders, files in os.walk(target, onerror=_raise):
        here = Path(folder)
        there = fresh / here.relative_to(target)
        links = [name for name in folders if (here / name).is_symlink()]
        staying = [
            name for name in files + links if (here / name).relative_to(target).as_posix() not in without
        ]
        if staying or not (files or folders):
            there.mkdir(parents=True, exist_ok=True)
        for name in staying:
            _link(here / name, there / name)


def _raise(error: OSError) -> None:
    """Stop a walk at a folder that cannot be read, instead of passing it over."""
    raise error


def _link(old: Path, new: Path) -> None:
    """Give the file `old` a second name."""
    if not os.access(old.parent, os.W_OK | os.X_OK):
        raise UnwritableError(
            f"{echo(str(old.parent))}: no permission to write; it stands in a bundle's folder"
        )
    try:
        os.link(old, new, follow_symlinks=False)
    except OSError as error:
        raise UnwritableError(
            f"{echo(str(old))}: cannot be carried over into the new folder: {error.strerror}; move it away"
        ) from error


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("xb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def _finish_folders(target: Path, fresh: Path) -> None:
    """Give the folders of `fresh` the times and permissions of those in `target`; bring them to the disk."""
    for folder, _, _ in os.walk(fresh, topdown=False):
        old = target / Path(folder).relative_to(fresh)
        if old.is_dir():
            shutil.copystat(old, folder)
        _sync(Path(folder))


def _sync(folder: Path) -> None:
    """Bring the names in `folder` to the disk."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
