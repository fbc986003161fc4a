"""Result folders: one run at a time writes them, all results are replaced together, foreign files are kept.

A result is a file or, if its name ends in a slash, a folder, whose files the summary lists in "files".

A run writes into a hidden folder inside its result folder. When the run is complete its files are moved into
place, the summary last; until then the results of the previous run stay. A run that is killed leaves the
hidden folder, which the next run removes.
"""

import contextlib
import fcntl
import hashlib
import json
import math
import os
import shutil
import tempfile
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, Final

from mambo_codegen.errors import ForeignFilesError, UnwritableError, echo
from mambo_sil.errors import BusyError

SUMMARY: Final = "summary.json"
"""The file that marks a folder of results; it is removed first and written last."""

_NEW: Final = ".mambo-nmpc-new-"
GENERATOR: Final = "mambo-nmpc "


@contextlib.contextmanager
def new_results(folder: Path, command: str, names: Collection[str]) -> Iterator[Path]:
    """Lock `folder` for one run of `command`; yield a temporary folder for the files `names` and the summary.

    When the block ends they replace the results of an earlier run, also those that this run does not have.
    If it raises, the earlier results stay. Raises ForeignFilesError if `folder` holds other files, BusyError
    if another run has locked it, and UnwritableError if the file system refuses an access; where possible,
    before the run.
    """
    try:
        with create_folder(folder), lock(folder):
            _refuse_other_work(folder, command, (*names, SUMMARY))
            for left_over in folder.glob(f"{_NEW}*"):
                shutil.rmtree(left_over)
            fresh = Path(tempfile.mkdtemp(prefix=_NEW, dir=folder))
            try:
                yield fresh
            except BaseException:
                shutil.rmtree(fresh)
                raise
            (folder / SUMMARY).unlink(missing_ok=True)
            for name in (*names, SUMMARY):
                if name.endswith("/") and (folder / name).exists():
                    shutil.rmtree(folder / name)
                if (fresh / name).exists():
                    (fresh / name).replace(folder / name)
                else:
                    (folder / name).unlink(missing_ok=True)
            shutil.rmtree(fresh)
    except (FileExistsError, NotADirectoryError) as error:
        raise UnwritableError(f"{echo(str(folder))}: is a file, or inside one; name a folder") from error
    except OSError as error:
        raise UnwritableError(f"{echo(str(folder))}: cannot be written: {error.strerror or error}") from error


def finite(value: Any) -> Any:
    """Return `value` with None for NaN and infinity, which JSON cannot represent, at any depth."""
    match value:
        case float() if not math.isfinite(value):
            return None
        case dict():
            return {key: finite(item) for key, item in value.items()}
        case list() | tuple():
            return [finite(item) for item in value]
        case _:
            return value


def digests(folder: Path) -> dict[str, str]:
    """Return {path: SHA-256} of every file in `folder`, for the key "files" of a summary."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@contextlib.contextmanager
def create_folder(folder: Path) -> Iterator[None]:
    """Create `folder` and its parents; remove those created here if the block raises."""
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:
        for path in missing:
            with contextlib.suppress(OSError):
                path.rmdir()
        raise


@contextlib.contextmanager
def lock(folder: Path) -> Iterator[None]:
    """Lock `folder` against other runs; raises BusyError. A file system without locks is not locked."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise BusyError(
                f"{echo(str(folder))}: another run writes its results there; wait for it, "
                "or name another folder with -o"
            ) from None
        except OSError:
            pass
        yield
    finally:
        os.close(handle)


def _refuse_other_work(folder: Path, command: str, names: Collection[str]) -> None:
    """Raise ForeignFilesError unless `folder` is empty or holds results of `command` in plain files."""
    name = echo(str(folder))
    if all(path.name.startswith(_NEW) for path in folder.iterdir()):
        return
    # A run killed while it moved its files into place still has its summary in the hidden folder.
    summaries = [_summary(path) for path in (folder / SUMMARY, *folder.glob(f"{_NEW}*/{SUMMARY}"))]
    ours = next((summary for summary in summaries if summary is not None), None)
    if ours is None:
        raise ForeignFilesError(
            f"{name}: holds files that are not results of mambo-nmpc; name another folder with -o", ()
        )
    if ours.get("command") != command:
        raise ForeignFilesError(
            f"{name}: holds results of {echo(str(ours.get('command', 'another version')))}, not of "
            f"{command}; name another folder with -o",
            (),
        )
    for each in names:
        path = folder / each
        if each.endswith("/"):
            _refuse_unlisted_files(path, folder, ours.get("files"))
        elif path.is_symlink() or (path.exists() and not path.is_file()):
            raise ForeignFilesError(
                f"{echo(str(path))}: is not a plain file and cannot be replaced by a result; "
                "move it away, or name another folder with -o",
                (str(path),),
            )


def _refuse_unlisted_files(place: Path, folder: Path, listed: object) -> None:
    """Raise ForeignFilesError if `place` is not a folder, or holds a file that the summary does not list."""
    known = listed if isinstance(listed, dict) else {}
    found = [place] if place.is_symlink() or place.is_file() else sorted(place.rglob("*"))
    for path in found:
        if path.is_symlink() or (not path.is_dir() and path.relative_to(folder).as_posix() not in known):
            raise ForeignFilesError(
                f"{echo(str(path))}: is not a result of mambo-nmpc and would be lost; "
                "move it away, or name another folder with -o",
                (str(path),),
            )


def _summary(path: Path) -> dict[str, Any] | None:
    """Return the summary at `path` if mambo-nmpc wrote it, else None."""
    if path.is_symlink() or not path.is_file():
        return None
    try:
        summary = json.loads(path.read_text("utf-8"))
    except (ValueError, RecursionError):
        return None
    ours = isinstance(summary, dict) and str(summary.get("generator")).startswith(GENERATOR)
    return summary if ours else None
