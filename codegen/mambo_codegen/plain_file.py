"""Files that a user names: only plain files, because reading a pipe could wait forever.

Writing replaces what is at a path, and a pipe, a socket or a device is no file of ours.
"""

import difflib
import errno
import os
import stat
from pathlib import Path
from typing import Final

from mambo_codegen.errors import echo

_KINDS: Final = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def find_obstacle(path: Path) -> str | None:
    """Return what is at `path`, such as "a pipe"; None for a plain file, a link to one, and nothing."""
    try:
        mode = path.stat().st_mode
    except OSError:
        return "a link to nothing" if path.is_symlink() else None
    return None if stat.S_ISREG(mode) else _KINDS[stat.S_IFMT(mode)]


def guess_name(path: Path, folder: Path | None = None) -> str:
    """Return " (did you mean NAME?)" with a file of a similar name beside `path`; "" if one is there.

    folder: what the name is relative to, if that is not the current folder.
    """
    try:
        beside = [] if os.path.lexists(path) else sorted(path.parent.iterdir())
    except (OSError, ValueError):  # no folder, too long a name
        return ""
    by_stem = {one.stem: one for one in sorted(beside, key=lambda one: one.suffix == path.suffix)}
    near = difflib.get_close_matches(path.stem, by_stem, n=1, cutoff=0.75)
    if not near:
        return ""
    found = by_stem[near[0]]
    shown = found.relative_to(folder) if folder is not None and found.is_relative_to(folder) else found
    return f" (did you mean {echo(str(shown))}?)"


def read_plain_file(path: Path, most_bytes: int) -> bytes:
    """Return at most `most_bytes` bytes of the file at `path`; raises OSError, also for a pipe or device."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)  # opening a pipe would wait for its writer
    with open(descriptor, "rb") as file:  # noqa: PTH123 - a descriptor, not a path
        mode = os.fstat(descriptor).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        if not stat.S_ISREG(mode):
            raise OSError(errno.EINVAL, "it is a pipe or a device; name a plain file", str(path))
        return file.read(most_bytes)
