"""Put a bundle on disk, and compare one: the manifest tells our files from everybody else's.

A bundle is {relative POSIX path: text}, written as UTF-8 with the line ends it has. Its manifest holds the
generator's version and the SHA-256 of every file: a pure function of the bundle. What stands in the folder
and not in its manifest is somebody's work, and so is a file of ours that no longer has its SHA-256.
"""

import difflib
import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Literal

import codegen
from codegen import swap
from codegen.errors import ForeignFilesError, UnwritableError, echo

MANIFEST = "manifest.json"
GENERATOR = "mambo-nmpc"


@dataclass(frozen=True)
class Changes:
    """What writing a bundle does to its folder: sorted paths; `kept` are the files that are not ours."""

    created: tuple[str, ...] = ()
    changed: tuple[str, ...] = ()
    removed: tuple[str, ...] = ()
    unchanged: tuple[str, ...] = ()
    kept: tuple[str, ...] = ()

    @property
    def any(self) -> bool:
        """Whether anything on disk is to change."""
        return bool(self.created or self.changed or self.removed)


@dataclass(frozen=True)
class Drift:
    """One file on disk that is not what the bundle says; `diff` is a unified diff for a changed one."""

    path: str
    kind: Literal["missing", "changed", "stale"]
    diff: str = ""


def manifest(files: Mapping[str, str]) -> str:
    """Return the manifest of `files` as JSON text."""
    hashes = {path: _sha256(files[path].encode()) for path in sorted(files)}
    return json.dumps({"generator": f"{GENERATOR} {codegen.__version__}", "files": hashes}, indent=2) + "\n"


def write(
    files: Mapping[str, str], directory: Path, *, force: bool = False, dry_run: bool = False
) -> Changes:
    """Bring `directory` to the bundle `files`, all or nothing, and return what changed.

    Files that are not ours stay. With `dry_run` nothing is written. Raises ForeignFilesError if a path of
    the bundle holds somebody's work and `force` is not given, UnwritableError if the disk refuses.
    """
    contents = _contents(files)
    try:
        target = _resolved(directory)
        if dry_run:
            return _plan(contents, target, directory, force=force)
        with swap.exclusive(target):
            changes = _plan(contents, target, directory, force=force)
            if changes.any:
                _refuse_the_ground_we_stand_on(target, directory)
                written = {path: contents[path] for path in (*changes.created, *changes.changed)}
                swap.replace(target, written, changes.removed)
        return changes
    except OSError as error:
        where = f" ({echo(str(error.filename))})" if error.filename else ""
        raise UnwritableError(f"{_name(directory)}: cannot be written: {error.strerror}{where}") from error


def check(files: Mapping[str, str], directory: Path) -> tuple[Drift, ...]:
    """Return how `directory` differs from the bundle `files`, byte for byte; foreign files are no drift.

    Raises UnwritableError if a file cannot be read.
    """
    contents = _contents(files)
    drifts = []
    try:
        for path, content in contents.items():
            found = _content(directory / path)
            if found is None:
                drifts.append(Drift(path, "missing"))
            elif found != content:
                drifts.append(Drift(path, "changed", _diff(path, found, content)))
        stale = [path for path in _listed(directory) if path not in contents and _exists(directory / path)]
    except OSError as error:
        raise UnwritableError(f"{echo(str(error.filename))}: cannot be read: {error.strerror}") from error
    return (*drifts, *(Drift(path, "stale") for path in stale))


def _contents(files: Mapping[str, str]) -> dict[str, bytes]:
    """Return the bytes of bundle and manifest, sorted by path; raises ValueError for an unsafe path."""
    unsafe = [path for path in files if not _is_safe(path) or path == MANIFEST]
    if unsafe:
        raise ValueError(f"not a path of a bundle: {unsafe[0]!r}")
    complete = {**files, MANIFEST: manifest(files)}
    return {path: complete[path].encode() for path in sorted(complete)}


def _is_safe(path: object) -> bool:
    """Whether `path` is relative, in normal form, and stays inside its folder."""
    if not isinstance(path, str) or "\0" in path:
        return False
    pure = PurePosixPath(path)
    return bool(pure.parts) and not pure.is_absolute() and ".." not in pure.parts and str(pure) == path


def _resolved(directory: Path) -> Path:
    """Return the folder behind every link in `directory`; raises UnwritableError if it can be none."""
    try:
        target = directory.resolve()
    except RuntimeError:
        raise UnwritableError(f"{_name(directory)}: is a loop of symbolic links") from None
    if not target.name:
        raise UnwritableError(f"{_name(directory)}: is the root of the file system; name a folder in it")
    if target.exists() and not target.is_dir():
        raise UnwritableError(f"{_name(directory)}: is a file; name a folder")
    return target


def _plan(contents: Mapping[str, bytes], target: Path, directory: Path, *, force: bool) -> Changes:
    """Decide what happens to every file; raises ForeignFilesError."""
    _refuse_blocked(contents, target, directory)
    listed = _listed(target)
    found = {path: _content(target / path) for path in {*contents, *listed}}
    ours = {
        path for path, sha256 in listed.items() if (old := found[path]) is not None and _sha256(old) == sha256
    }
    differing = [
        path for path, content in contents.items() if _exists(target / path) and found[path] != content
    ]
    foreign = tuple(path for path in differing if path not in ours)
    if foreign and not force:
        edited = "\n".join(
            f"  {echo(path)} ({'edited by hand' if path in listed else 'not ours'})" for path in foreign
        )
        raise ForeignFilesError(
            f"{_name(directory)}: these files would be lost:\n{edited}\n"
            "move them away, or overwrite them with --force",
            foreign,
        )
    removed = tuple(sorted(path for path in ours if path not in contents))
    present = _files_in(target)
    return Changes(
        created=tuple(path for path in contents if not _exists(target / path)),
        changed=tuple(differing),
        removed=removed,
        unchanged=tuple(path for path, content in contents.items() if found[path] == content),
        kept=tuple(path for path in present if path not in contents and path not in removed),
    )


def _refuse_blocked(contents: Mapping[str, bytes], target: Path, directory: Path) -> None:
    """Refuse folders where a file belongs, files or links where a folder does: no force removes them."""
    blocked = {path for path in contents if (target / path).is_dir() and not (target / path).is_symlink()}
    for path in contents:
        for parent in PurePosixPath(path).parents[:-1]:
            place = target / parent
            if place.is_symlink() or (place.exists() and not place.is_dir()):
                blocked.add(str(parent))
    if blocked:
        names = ", ".join(echo(path) for path in sorted(blocked))
        raise ForeignFilesError(
            f"{_name(directory)}: {names} stands where the bundle has a file or folder; move it away",
            tuple(sorted(blocked)),
        )


def _refuse_the_ground_we_stand_on(target: Path, directory: Path) -> None:
    """Refuse to replace the current folder: the caller's shell would be left in one that is gone."""
    if Path.cwd().is_relative_to(target):
        raise UnwritableError(
            f"{_name(directory)}: holds the current folder, and is replaced as a whole; run from outside it"
        )


def _listed(directory: Path) -> dict[str, str]:
    """Return {path: sha256} of our files in `directory`, the manifest included; nothing if it is not ours."""
    content = _content(directory / MANIFEST)
    try:
        document = json.loads(content or b"{}")
        if document["generator"].split()[0] != GENERATOR:
            return {}
        listed = {path: sha256 for path, sha256 in document["files"].items() if _is_safe(path)}
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return {}
    return {**listed, MANIFEST: _sha256(content or b"")}


def _files_in(folder: Path) -> list[str]:
    """Return the relative POSIX path of everything in `folder` that is not itself a folder, sorted."""
    places = folder.rglob("*")
    return sorted(p.relative_to(folder).as_posix() for p in places if p.is_symlink() or not p.is_dir())


def _exists(path: Path) -> bool:
    """Whether anything is at `path`, a broken link included."""
    return path.exists() or path.is_symlink()


def _content(path: Path) -> bytes | None:
    """Return the bytes of a regular file; None for anything else: nothing there, a folder, a link."""
    return path.read_bytes() if path.is_file() and not path.is_symlink() else None


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _diff(path: str, found: bytes, expected: bytes) -> str:
    """Return a unified diff from the disk to the bundle, with everything unprintable made visible."""
    old, new = (
        [_visible(line) for line in content.decode(errors="backslashreplace").split("\n")]
        for content in (found, expected)
    )
    return "\n".join(difflib.unified_diff(old, new, f"{path} (on disk)", f"{path} (generated)", lineterm=""))


def _visible(line: str) -> str:
    return "".join(c if c.isprintable() or c == "\t" else c.encode("unicode_escape").decode() for c in line)


def _name(directory: Path) -> str:
    return echo(str(directory))
