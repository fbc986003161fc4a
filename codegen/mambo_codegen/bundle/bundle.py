"""Write a bundle to disk, and compare one on disk with its settings.

A bundle is {relative POSIX path: text}, written as UTF-8 without change of line ends. Its manifest holds the
generator's version and the SHA-256 of every file. A file that is not in the manifest, or whose SHA-256 has
changed, is the user's work: it is overwritten only with `force`. The settings file from which a bundle is
made stays as it is where it is itself a file of the bundle; the manifest has the SHA-256 of its generated
text, so that a run from other settings takes a file spelled by the user for the user's work.
"""

import difflib
import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Any, Literal

from mambo_codegen import __version__
from mambo_codegen.atomic import is_left_over, stage
from mambo_codegen.errors import ForeignFilesError, LayoutError, UnwritableError, echo
from mambo_codegen.plain_file import find_obstacle

MANIFEST = "manifest.json"
GENERATOR = "mambo-nmpc"


@dataclass(frozen=True)
class Changes:
    """What `write` changes in a folder, as sorted paths.

    kept:   files outside the bundle.
    edited: files that an earlier bundle wrote and the user has edited since.
    """

    created: tuple[str, ...] = ()
    changed: tuple[str, ...] = ()
    removed: tuple[str, ...] = ()
    unchanged: tuple[str, ...] = ()
    kept: tuple[str, ...] = ()
    edited: tuple[str, ...] = ()

    @property
    def any(self) -> bool:
        """Whether a file is created, changed or removed."""
        return bool(self.created or self.changed or self.removed)


@dataclass(frozen=True)
class Drift:
    """One file on disk that differs from the bundle; `diff` is a unified diff if its text changed."""

    path: str
    kind: Literal["missing", "changed", "stale"]
    diff: str = ""


def manifest(files: Mapping[str, str], target: str | None = None) -> str:
    """Return the manifest of `files` as JSON text; `target` is the one of `generate --for`."""
    head = {"generator": f"{GENERATOR} {__version__}"} | ({"target": target} if target else {})
    sha256s = {path: _sha256(files[path].encode()) for path in sorted(files)}
    return json.dumps({**head, "files": sha256s}, indent=2) + "\n"


def write(
    files: Mapping[str, str],
    directory: Path,
    target: str | None = None,
    *,
    source: Path | None = None,
    force: bool = False,
    dry_run: bool = False,
) -> Changes:
    """Make `directory` hold the bundle `files`, of a target or of none, file by file; return what changed.

    All new files are on the disk before the first one is renamed; the manifest is renamed last. A run killed
    between the renames leaves C files of two bundles, which do not compile together; repeating the run
    completes the bundle. The file `source` has these settings and is left as it is, with `force` too. With
    `dry_run` nothing is written. Without `force`, raises ForeignFilesError if it would overwrite the user's
    work, and LayoutError if the folder holds a bundle of another target.
    Raises UnwritableError if the file system refuses.
    """
    name = echo(str(directory))
    place = Path(os.path.realpath(directory))
    try:
        contents = _contents(files, target, place, source)
        if not force:
            _refuse_other_target(target, place, name)
        changes = _plan(contents, place, name, force=force)
        if not dry_run:
            _apply(contents, changes, place, name, force=force)
        ours = {*contents, *changes.removed}
        kept = (path for path in _files_in(place) if path not in ours and not is_left_over(path))
        return replace(changes, kept=tuple(kept))
    except OSError as error:
        file = error.filename2 or error.filename
        where = f" ({echo(str(file))})" if file else ""
        raise UnwritableError(f"{name}: cannot be written: {error.strerror}{where}") from error


def check(
    files: Mapping[str, str], directory: Path, target: str | None = None, *, source: Path | None = None
) -> tuple[Drift, ...]:
    """Return how `directory` differs from the bundle `files`, byte for byte; ignore other files and `source`.

    Raises UnwritableError if a file cannot be read.
    """
    drifts = []
    try:
        contents = _contents(files, target, directory, source)
        for path, content in contents.items():
            found = _content(directory / path)
            if found is None:
                drifts.append(Drift(path, "changed" if os.path.lexists(directory / path) else "missing"))
            elif found != content:
                drifts.append(Drift(path, "changed", _diff(path, found, content)))
        known = sorted(_known(directory))
        stale = [path for path in known if path not in contents and os.path.lexists(directory / path)]
    except OSError as error:
        raise UnwritableError(f"{echo(str(error.filename))}: cannot be read: {error.strerror}") from error
    return (*drifts, *(Drift(path, "stale") for path in stale))


def _contents(
    files: Mapping[str, str], target: str | None, place: Path, source: Path | None
) -> dict[str, bytes]:
    """Return {path: bytes} of bundle and manifest, sorted by path, with `source` as it is.

    Raises ValueError for an unsafe path.
    """
    unsafe = [path for path in files if not _is_safe(path) or path == MANIFEST]
    if unsafe:
        raise ValueError(f"not a path of a bundle: {unsafe[0]!r}")
    complete = {**files, MANIFEST: manifest(files, target)}
    contents = {path: complete[path].encode() for path in sorted(complete)}
    if source is not None:
        own = [path for path in files if (place / path).is_file() and (place / path).samefile(source)]
        contents |= {path: (place / path).read_bytes() for path in own}
    return contents


def _is_safe(path: str) -> bool:
    """Whether `path` is relative, in normal form, and stays inside its folder."""
    pure = PurePosixPath(path)
    return bool(pure.parts) and not pure.is_absolute() and ".." not in pure.parts and str(pure) == path


def _plan(contents: Mapping[str, bytes], target: Path, name: str, *, force: bool) -> Changes:
    """Decide what to do with every file of the old and the new bundle.

    Raises ForeignFilesError.
    """
    _refuse_blocked(contents, target, name)
    known = _known(target)
    found = {path: _content(target / path) for path in {*contents, *known}}
    ours = {
        path for path, content in found.items() if content is not None and _sha256(content) == known.get(path)
    }
    present = {path for path in contents if os.path.lexists(target / path)}
    changed = tuple(path for path in contents if path in present and found[path] != contents[path])
    if not force:
        _refuse_foreign(tuple(path for path in changed if path not in ours), known, name)
    return Changes(
        created=tuple(path for path in contents if path not in present),
        changed=changed,
        removed=tuple(sorted(ours - contents.keys())),
        unchanged=tuple(path for path, content in contents.items() if found[path] == content),
        edited=tuple(
            sorted(path for path in known.keys() - contents.keys() - ours if found[path] is not None)
        ),
    )


def _apply(contents: Mapping[str, bytes], changes: Changes, target: Path, name: str, *, force: bool) -> None:
    """Remove the new files of a killed run, then carry out `changes`.

    Removals follow the renames, and sources go before the headers that they include; the manifest comes last.
    """
    for path in _files_in(target):
        if is_left_over(path):
            (target / path).unlink()
    rank = {path: 1 + path.endswith(".h") for path in changes.removed} | {MANIFEST: 3}
    differing = (*changes.created, *changes.changed, *changes.removed)
    ordered = sorted(differing, key=lambda path: rank.get(path, 0))
    with stage({target / path: contents.get(path) for path in ordered}):
        if _plan(contents, target, name, force=force) != changes:
            raise UnwritableError(f"{name}: files changed during the run; run it again")


def _refuse_blocked(contents: Mapping[str, bytes], target: Path, name: str) -> None:
    """Refuse a folder at the path of a file and a file at the path of a folder, even with force."""
    blocked = {path for path in contents if not (target / path).is_symlink() and find_obstacle(target / path)}
    folders = {folder for path in contents for folder in _folders_of(path)}
    blocked |= {
        str(folder)
        for folder in folders
        if (target / folder).is_symlink() or ((target / folder).exists() and not (target / folder).is_dir())
    }
    if blocked:
        names = ", ".join(echo(path) for path in sorted(blocked))
        raise ForeignFilesError(
            f"{name}: {names} is in the way of a file or folder of the bundle; move it away",
            tuple(sorted(blocked)),
        )


def _refuse_other_target(target: str | None, place: Path, name: str) -> None:
    """Refuse to write over the bundle of another target, or of none: every file of it would be removed."""
    document = _document(place)
    if document is not None and (known := document.get("target")) != target:
        is_now = (
            f"is for target {echo(str(known))}; add --for {echo(str(known))}"
            if known
            else ("is an ordinary bundle; leave out --for")
        )
        raise LayoutError(f"{name}: {is_now}, name another folder, or change it with --force")


def _refuse_foreign(foreign: tuple[str, ...], known: Iterable[str], name: str) -> None:
    """Refuse to overwrite the files `foreign`, if there are any."""
    if foreign:
        edited = "\n".join(
            f"  {echo(path)} ({'edited by hand' if path in known else 'not ours'})" for path in foreign
        )
        raise ForeignFilesError(
            f"{name}: these files would be lost:\n{edited}\nmove them away, or overwrite them with --force",
            foreign,
        )


def _known(target: Path) -> dict[str, object]:
    """Return {path: SHA-256} of the files that the manifest in `target` lists; {} without a manifest of ours.

    Paths that lead out of `target` are left out.
    """
    try:
        document = _document(target)
        if document is None:
            return {}
        listed = {
            path: sha256
            for path, sha256 in document["files"].items()
            if _is_safe(path) and not any((target / parent).is_symlink() for parent in _folders_of(path))
        }
    except (ValueError, LookupError, TypeError, AttributeError):
        return {}
    return {**listed, MANIFEST: _sha256(_content(target / MANIFEST) or b"")}


def _document(place: Path) -> dict[str, Any] | None:
    """Return the manifest in the folder `place`, if it is one of ours."""
    try:
        document: dict[str, Any] = json.loads(_content(place / MANIFEST) or b"")
        return document if document["generator"].split()[0] == GENERATOR else None
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return None


def _folders_of(path: str) -> list[PurePosixPath]:
    """Return the parent folders of `path`, without the bundle's own."""
    return list(PurePosixPath(path).parents)[:-1]


def _files_in(folder: Path) -> list[str]:
    """Return the relative POSIX path of everything in `folder` that is not itself a folder, sorted."""
    files = []
    for here, folders, names in os.walk(folder):  # skips what is removed meanwhile
        links = [name for name in folders if (Path(here) / name).is_symlink()]
        files += [(Path(here) / name).relative_to(folder).as_posix() for name in (*names, *links)]
    return sorted(files)


def _content(path: Path) -> bytes | None:
    """Return the bytes of a regular file; None if there is no file, or a folder or link."""
    try:
        return path.read_bytes() if path.is_file() and not path.is_symlink() else None
    except FileNotFoundError:
        return None


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _diff(path: str, found: bytes, expected: bytes) -> str:
    """Return a unified diff from the disk to the bundle, with unprintable characters escaped."""
    old, new = (
        [_visible(line) for line in content.decode(errors="backslashreplace").split("\n")]
        for content in (found, expected)
    )
    return "\n".join(difflib.unified_diff(old, new, f"{path} (on disk)", f"{path} (generated)", lineterm=""))


def _visible(line: str) -> str:
    return "".join(c if c.isprintable() or c == "\t" else c.encode("unicode_escape").decode() for c in line)
