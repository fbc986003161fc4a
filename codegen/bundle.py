"""Put a bundle on disk, and compare one: the manifest tells our files from everybody else's.

A bundle is {relative POSIX path: text}, written as UTF-8 with the line ends it has. Its manifest holds the
generator's version and the SHA-256 of every file: a pure function of the bundle. What stands in the folder
and not in its manifest is somebody's work, and so is a file of ours that no longer has its SHA-256.
"""

import difflib
import hashlib
import json
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Literal

from mambo_nmpc.codegen import __version__, exchange
from mambo_nmpc.codegen.errors import ForeignFilesError, LayoutError, UnwritableError, echo
from mambo_nmpc.codegen.exchange import JOURNAL, MANIFEST, STAND_IN

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
    return _listing({path: _sha256(files[path].encode()) for path in sorted(files)})


def write(
    files: Mapping[str, str], directory: Path, *, force: bool = False, dry_run: bool = False
) -> Changes:
    """Bring `directory` to the bundle `files`, file by file, and return what changed.

    Files that are not ours stay. A run that finds no room or permission leaves the old bundle; one stopped
    midway the old one, the new one, or one that refuses to compile until the next run. With `dry_run` nothing
    is written. Raises, unless `force`, ForeignFilesError if a path of the bundle holds somebody's work and
    LayoutError if the folder holds a bundle of the other layout; UnwritableError if the disk refuses.
    """
    contents = _contents(files)
    name = echo(str(directory))
    try:
        target = _resolved(directory)
        if dry_run:
            changes = _plan(contents, target, name, force=force)
        else:
            with exchange.exclusive(target, name):
                changes = _plan(contents, target, name, force=force)
                _apply(changes, contents, target, lambda: _plan(contents, target, name, force=force).removed)
        ours = {*contents, *changes.removed}
        kept = [path for path in _files_in(target) if path not in ours and not exchange.is_left_over(path)]
        return replace(changes, kept=tuple(kept))
    except OSError as error:
        file = error.filename2 or error.filename
        where = f" ({echo(str(file))})" if file else ""
        halfway = os.path.lexists(directory / JOURNAL)
        what_next = "; unfinished until mambo-nmpc generate has run again" if halfway else ""
        raise UnwritableError(f"{name}: cannot be written: {error.strerror}{where}{what_next}") from error


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
                drifts.append(Drift(path, "changed" if os.path.lexists(directory / path) else "missing"))
            elif found != content:
                drifts.append(Drift(path, "changed", _diff(path, found, content)))
        known = sorted(_known(directory))
        stale = [path for path in known if path not in contents and os.path.lexists(directory / path)]
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
    try:
        os.fsencode(path)
    except UnicodeEncodeError:
        return False
    pure = PurePosixPath(path)
    return bool(pure.parts) and not pure.is_absolute() and ".." not in pure.parts and str(pure) == path


def _resolved(directory: Path) -> Path:
    """Return the folder behind every link in `directory`; raises UnwritableError if it can be none."""
    try:
        target = directory.resolve()
    except RuntimeError:
        raise UnwritableError(f"{echo(str(directory))}: is a loop of symbolic links") from None
    if not target.name:
        raise UnwritableError(f"{echo(str(directory))}: is the root of the file system; name a folder in it")
    if target.exists() and not target.is_dir():
        raise UnwritableError(f"{echo(str(directory))}: is a file; name a folder")
    return target


def _plan(contents: Mapping[str, bytes], target: Path, name: str, *, force: bool) -> Changes:
    """Decide what happens to every file of ours; raises ForeignFilesError and LayoutError."""
    _refuse_blocked(contents, target, name)
    known = _known(target)
    found = {path: _content(target / path) for path in {*contents, *known}}
    ours = {
        path for path, content in found.items() if content is not None and _is_ours(content, known.get(path))
    }
    present = {path for path in contents if os.path.lexists(target / path)}
    changed = tuple(path for path in contents if path in present and found[path] != contents[path])
    if not force:
        _refuse_other_layout(contents, known, name)
        _refuse_foreign(tuple(path for path in changed if path not in ours), known, name)
    return Changes(
        created=tuple(path for path in contents if path not in present),
        changed=changed,
        removed=tuple(sorted(ours - contents.keys())),
        unchanged=tuple(path for path, content in contents.items() if found[path] == content),
    )


def _apply(
    changes: Changes, contents: Mapping[str, bytes], target: Path, last_look: Callable[[], tuple[str, ...]]
) -> None:
    """Do what `changes` says, and put right what a killed run left; touch nothing if that is nothing."""
    known = _known(target)
    exchange.clear(target, {*known, *contents, JOURNAL})
    if changes.any:
        differing = {*changes.created, *changes.changed}
        guards = _guards(contents, differing, changes.removed)
        written = {path: contents[path] for path in contents if path in differing or path in guards}
        hashes = {path: known.get(path, set()) | {_sha256(contents[path])} for path in contents}
        journal = _listing({path: sorted(sha256s) for path, sha256s in sorted({**known, **hashes}.items())})
        exchange.replace(target, written, guards, journal.encode(), last_look)
    exchange.finish(target, known.keys() - contents.keys())


def _guards(contents: Iterable[str], differing: Iterable[str], removed: Iterable[str]) -> tuple[str, ...]:
    """Return the headers to shut while files change: of the new bundle, and of the old one if it goes.

    None if a single file of C changes: that is old or new by itself.
    """
    if sum(path.endswith((".c", ".h")) for path in (*differing, *removed)) < 2:
        return ()
    return tuple(sorted({*_common_header(contents), *_common_header(removed)}))


def _common_header(paths: Iterable[str]) -> tuple[str, ...]:
    """Return the header that all C among `paths` includes: PREFIX_config.h, or the only one."""
    headers = [path for path in paths if path.endswith(".h")]
    configs = sorted((path for path in headers if path.endswith("_config.h")), key=len)
    return tuple(configs[-1:] or headers[:1])


def _refuse_blocked(contents: Mapping[str, bytes], target: Path, name: str) -> None:
    """Refuse folders where a file belongs, files or links where a folder does: no force removes them."""
    blocked = {path for path in contents if (target / path).is_dir() and not (target / path).is_symlink()}
    for path in contents:
        for parent in _folders_of(path):
            place = target / parent
            if place.is_symlink() or (place.exists() and not place.is_dir()):
                blocked.add(str(parent))
    if blocked:
        names = ", ".join(echo(path) for path in sorted(blocked))
        raise ForeignFilesError(
            f"{name}: {names} stands where the bundle has a file or folder; move it away",
            tuple(sorted(blocked)),
        )


def _refuse_other_layout(contents: Iterable[str], known: Iterable[str], name: str) -> None:
    """Refuse to turn a bundle of folders into an amalgamated one, or back, for want of an option."""
    old, new = ({"/" in path for path in paths if path.endswith(".h")} for paths in (known, contents))
    if len(old) == len(new) == 1 and old != new:
        is_now, change = (
            ("is a bundle of folders", "leave out") if old == {True} else ("is amalgamated", "add")
        )
        raise LayoutError(f"{name}: {is_now}; {change} --amalgamate, or change the layout with --force")


def _refuse_foreign(foreign: tuple[str, ...], known: Iterable[str], name: str) -> None:
    """Refuse to overwrite the files `foreign`, if any."""
    if foreign:
        edited = "\n".join(
            f"  {echo(path)} ({'edited by hand' if path in known else 'not ours'})" for path in foreign
        )
        raise ForeignFilesError(
            f"{name}: these files would be lost:\n{edited}\nmove them away, or overwrite them with --force",
            foreign,
        )


def _known(target: Path) -> dict[str, set[str]]:
    """Return {path: SHA-256s} of what we wrote into `target`, by its manifest and a killed run's journal.

    Nothing of either if it is not ours; no path that leads out of `target`.
    """
    known: dict[str, set[str]] = {}
    for listing in (MANIFEST, JOURNAL):
        content = _content(target / listing) or b""
        try:
            document = json.loads(content)
            if document["generator"].split()[0] != GENERATOR:
                continue
            listed = {
                path: {sha256s} if isinstance(sha256s, str) else set(sha256s)
                for path, sha256s in document["files"].items()
                if _is_safe(path) and not any((target / parent).is_symlink() for parent in _folders_of(path))
            }
        except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
            continue
        if listing == MANIFEST:
            listed[MANIFEST] = {_sha256(content)}
        known = {path: known.get(path, set()) | listed.get(path, set()) for path in {**known, **listed}}
    return known


def _is_ours(content: bytes, sha256s: set[str] | None) -> bool:
    """Whether we wrote `content` at a path where we wrote `sha256s`."""
    return content == STAND_IN or (sha256s is not None and _sha256(content) in sha256s)


def _folders_of(path: str) -> list[PurePosixPath]:
    """Return the folders inside the bundle that lead to `path`."""
    return list(PurePosixPath(path).parents)[:-1]


def _files_in(folder: Path) -> list[str]:
    """Return the relative POSIX path of everything in `folder` that is not itself a folder, sorted."""
    files = []
    for here, folders, names in os.walk(folder):
        links = (name for name in folders if (Path(here) / name).is_symlink())
        files += [(Path(here) / name).relative_to(folder).as_posix() for name in (*names, *links)]
    return sorted(files)


def _content(path: Path) -> bytes | None:
    """Return the bytes of a regular file; None for anything else: nothing there, a folder, a link."""
    try:
        return path.read_bytes() if path.is_file() and not path.is_symlink() else None
    except FileNotFoundError:
        return None


def _listing(sha256s: Mapping[str, object]) -> str:
    """Return {path: SHA-256s} as the JSON text of a manifest or journal."""
    return json.dumps({"generator": f"{GENERATOR} {__version__}", "files": sha256s}, indent=2) + "\n"


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
