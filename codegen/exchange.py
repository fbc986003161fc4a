"""Exchange files of a folder in place, one by one; whatever else is in the folder is never touched.

New files are laid hidden beside their places first. Only when all are on the disk do they take their places,
a rename each, and meanwhile a stand-in that no compiler takes holds the header that every C file includes.
A journal tells the next run what a killed one may have left.
"""

import contextlib
import errno
import fcntl
import os
import stat
import sys
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from pathlib import Path, PurePosixPath

MANIFEST = "manifest.json"
JOURNAL = ".mambo-nmpc-unfinished"
STAND_IN = b'#error "generation was interrupted: run mambo-nmpc generate again"\n'

_NEW, _SHUT = ".mambo-nmpc-new", ".mambo-nmpc-stand-in"
_PATIENCE_S, _PAUSE_S = 1.0, 0.05


@contextlib.contextmanager
def exclusive(folder: Path, name: str) -> Iterator[None]:
    """Hold `folder`, made if it is missing, for one run; whoever has to wait reads its `name` on stderr.

    Folders made here are removed again when the run fails.
    """
    missing = _missing(folder)
    with contextlib.ExitStack() as stack:
        try:
            stack.callback(os.close, _locked(folder, name))
            yield
        except BaseException:
            _remove_empty(missing)
            raise


def put(place: Path, content: bytes) -> None:
    """Write one file whole or not at all, its folder made if it is missing; raises OSError."""
    missing = _missing(place.parent)
    try:
        _lay(_new(place), place, content)
        _new(place).replace(place)
    except BaseException:
        clear(place.parent, [place.name])
        _remove_empty(missing)
        raise


def replace(
    folder: Path,
    written: Mapping[str, bytes],
    guards: Collection[str],
    journal: bytes,
    last_look: Callable[[], Collection[str]],
) -> None:
    """Bring the files `written` to their places in `folder` and remove those that `last_look` returns.

    The headers `guards` refuse to compile meanwhile; a guard written as it was stays the same file.
    `last_look` is called when all is laid, and may raise: up to there an error leaves every file as it was.
    Later, an error or a kill leaves a mixture behind its guards, and `journal` for the next run. Raises
    OSError that names the file.
    """
    missing = [parent for path in written for parent in _missing((folder / path).parent)]
    pending = (folder / JOURNAL).exists()
    try:
        put(folder / JOURNAL, journal)
        for path, content in written.items():
            _stage(folder / path, content)
        for guard in guards:
            _lay(_shut(folder / guard), folder / guard, STAND_IN)
        removed = last_look()
        _demand_permission(folder / path for path in removed)
    except BaseException:
        clear(folder, {*written, *guards})
        _remove_empty(missing)
        if not pending:
            (folder / JOURNAL).unlink(missing_ok=True)
        raise
    try:
        _exchange(folder, list(written), guards, removed)
    finally:
        clear(folder, {*written, *guards})


def is_left_over(path: str) -> bool:
    """Whether a killed run left the file at `path`: no part of the bundle, and gone after the next run."""
    name = PurePosixPath(path).name
    return name == JOURNAL or name.endswith((_NEW, _SHUT))


def clear(folder: Path, paths: Iterable[str]) -> None:
    """Remove what a run has laid beside the places `paths` in `folder`."""
    for path in paths:
        for laid in (_new(folder / path), _shut(folder / path)):
            if os.path.lexists(laid):
                laid.unlink()


def finish(folder: Path, dropped: Iterable[str]) -> None:
    """Remove the folders that held nothing but the files `dropped`, and the journal."""
    _remove_empty(folder / parent for path in dropped for parent in list(PurePosixPath(path).parents)[:-1])
    if (folder / JOURNAL).exists():
        (folder / JOURNAL).unlink()


def _exchange(folder: Path, written: list[str], guards: Collection[str], removed: Collection[str]) -> None:
    """Shut the guards, exchange the rest, open the guards, and let the manifest come last."""
    folders = {(folder / path).parent for path in (*written, *removed)}
    for guard in guards:
        _shut(folder / guard).replace(folder / guard)
    _sync(folders)
    opening = [path for path in written if path in guards]
    for path in written:
        if path not in opening and path != MANIFEST:
            _new(folder / path).replace(folder / path)
    for path in sorted(removed, key=lambda path: path in guards):
        (folder / path).unlink(missing_ok=True)
    _sync(folders)
    for path in (*opening, *(path for path in written if path == MANIFEST)):
        _new(folder / path).replace(folder / path)
    _sync(folders)


def _new(place: Path) -> Path:
    """Return where the file that is to take `place` is laid."""
    return place.with_name(f".{place.name}{_NEW}")


def _shut(place: Path) -> Path:
    """Return where the stand-in for the header at `place` is laid."""
    return place.with_name(f".{place.name}{_SHUT}")


def _stage(place: Path, content: bytes) -> None:
    """Lay what is to take `place`: a second name of the file there if it is the same, else a new file."""
    if place.is_file() and not place.is_symlink() and place.read_bytes() == content:
        with contextlib.suppress(OSError):  # a file system without hard links gets a new file
            os.link(place, _new(place))
            return
    _lay(_new(place), place, content)


def _lay(laid: Path, place: Path, content: bytes) -> None:
    """Bring a new file to the disk, with permissions and owner of the one at `place` if that is a file."""
    try:
        _make(laid.parent)
        laid.unlink(missing_ok=True)
        with laid.open("xb") as file:
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


def _demand_permission(places: Iterable[Path]) -> None:
    """Raise PermissionError for the first of `places` whose folder lets no file be removed."""
    for place in places:
        if not os.access(place.parent, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(place))


def _locked(folder: Path, name: str) -> int:
    """Return an open handle of `folder` that keeps other runs out until it is closed."""
    while True:
        _make(folder)
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            _lock(handle, name)
            if folder.exists() and os.path.samestat(os.fstat(handle), folder.stat()):
                return handle
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)  # the run waited for has failed and removed the folder it had made


def _lock(handle: int, name: str) -> None:
    """Lock a folder, after a word on stderr if that takes long; a file system without locks goes without."""
    until = time.monotonic() + _PATIENCE_S
    while time.monotonic() < until:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            time.sleep(_PAUSE_S)
        except OSError:
            return
        else:
            return
    if sys.stderr:
        print(f"waiting for another run in {name}", file=sys.stderr, flush=True)
    with contextlib.suppress(OSError):
        fcntl.flock(handle, fcntl.LOCK_EX)


def _make(folder: Path) -> None:
    """Make `folder` and its parents if missing; raises NotADirectoryError for a file in the way."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(folder)) from None


def _missing(folder: Path) -> list[Path]:
    """Return those of `folder` and its parents that are not there."""
    return [place for place in (folder, *folder.parents) if not place.exists()]


def _remove_empty(folders: Iterable[Path]) -> None:
    """Remove those of `folders` that are empty, inner ones first."""
    for folder in sorted(set(folders), key=lambda folder: len(folder.parts), reverse=True):
        with contextlib.suppress(OSError):
            folder.rmdir()


def _sync(folders: Iterable[Path]) -> None:
    """Bring the names in `folders` to the disk, where the file system does that."""
    for folder in folders:
        with contextlib.suppress(OSError):
            handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
            try:
                os.fsync(handle)
            finally:
                os.close(handle)
