"""The exceptions of generating C, one class for each thing that a caller would do differently."""

import json
from typing import ClassVar

BAD_INPUT, INTERRUPTED, NO_READER, TERMINATED = 2, 130, 141, 143
"""Exit codes beside 0 and 1; the last three are 128 + SIGINT, SIGPIPE and SIGTERM, as in a shell."""

LONGEST_ECHO = 60
"""Most characters of a user's text that a message repeats."""


def echo(text: str) -> str:
    """Return `text` for one line of a terminal: escape control characters, cut out a long middle."""
    visible = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text[:1000])
    if len(visible) <= LONGEST_ECHO:
        return visible
    half = (LONGEST_ECHO - 3) // 2
    tail = "".join(c if c.isprintable() else "?" for c in text[-half:])
    return f"{visible[:half]}...{tail}"


def echo_value(value: object) -> str:
    """Return a value of a TOML file as JSON, for one line of a terminal."""
    try:
        return echo(json.dumps(value, ensure_ascii=False, default=str))
    except (ValueError, RecursionError):  # thousands of digits or of nested tables
        return "a value too long to repeat"


class Terminated(KeyboardInterrupt):
    """SIGTERM, which ends a command as Ctrl-C does, but for the exit code."""


class MamboNmpcError(Exception):
    """An error that the user can correct; its text is the whole message, without a traceback.

    It passes between processes: its `args` are the arguments of its class.
    """

    exit_code: ClassVar[int] = BAD_INPUT


class SourceNotFoundError(MamboNmpcError):
    """A name is neither a preset nor a file."""


class UnreadableFileError(MamboNmpcError):
    """A settings file cannot be read as TOML: missing, a folder, too large, not UTF-8, or bad syntax."""


class InvalidSettingsError(MamboNmpcError):
    """Settings break a rule; `faults` holds one line per broken rule, all of them."""

    def __init__(self, faults: tuple[str, ...]) -> None:
        super().__init__(faults)
        self.faults = faults

    def __str__(self) -> str:
        return "\n".join(self.faults)


class FileExistsRefusedError(MamboNmpcError):
    """A file already exists, and --force is not given."""


class UnwritableError(MamboNmpcError):
    """The file system refuses: no permission, no space, a file where a folder is needed."""


class ForeignFilesError(MamboNmpcError):
    """A bundle would overwrite foreign or edited files; `paths` names them."""

    def __init__(self, message: str, paths: tuple[str, ...]) -> None:
        super().__init__(message, paths)
        self.message = message
        self.paths = paths

    def __str__(self) -> str:
        return self.message


class BuildError(MamboNmpcError):
    """The C cannot be compiled: no compiler, no headers, or an error of the compiler."""


class CacheError(MamboNmpcError):
    """The user's cache folder cannot be used, or other users can write to it."""


class DriftError(MamboNmpcError):
    """A bundle on disk differs from what its settings generate."""

    exit_code = 1


class LayoutError(MamboNmpcError):
    """A bundle of another target lies in the folder, and --force is not given."""
