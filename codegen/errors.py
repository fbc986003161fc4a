"""Every exception of generating C, one class per thing a caller would do differently."""

import json
from typing import ClassVar

BAD_INPUT, INTERRUPTED, NO_READER = 2, 130, 141
"""Exit codes beside 0 and 1; the last two are what a shell makes of SIGINT and SIGPIPE."""

LONGEST_ECHO = 60
"""Characters of a foreign value that a message repeats."""


def echo(text: str) -> str:
    """Return `text` fit for one line of a terminal: control characters escaped, a long middle cut out."""
    visible = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text[:1000])
    if len(visible) <= LONGEST_ECHO:
        return visible
    half = (LONGEST_ECHO - 3) // 2
    tail = "".join(c if c.isprintable() else "?" for c in text[-half:])
    return f"{visible[:half]}...{tail}"


def echo_value(value: object) -> str:
    """Return a value of a TOML file as JSON spells it, fit for one line of a terminal."""
    try:
        return echo(json.dumps(value, ensure_ascii=False, default=str))
    except (ValueError, RecursionError):  # a number of thousands of digits, a thousand tables in each other
        return "a value too long to repeat"


class MamboNmpcError(Exception):
    """Something the user can put right; its text is the whole message, without a traceback."""

    exit_code: ClassVar[int] = BAD_INPUT


class SourceNotFoundError(MamboNmpcError):
    """A name is neither a preset nor a file."""


class UnreadableFileError(MamboNmpcError):
    """A settings file cannot be read as TOML: missing, a folder, too large, not UTF-8, or bad syntax."""


class InvalidSettingsError(MamboNmpcError):
    """Settings break a rule; `faults` holds one line per broken rule, all of them."""

    def __init__(self, faults: tuple[str, ...]) -> None:
        super().__init__("\n".join(faults))
        self.faults = faults


class FileExistsRefusedError(MamboNmpcError):
    """A file is already there, and nobody said that it may be overwritten."""


class UnwritableError(MamboNmpcError):
    """The file system refuses: no permission, no space, a file where a folder is needed."""


class ForeignFilesError(MamboNmpcError):
    """A bundle would overwrite work that is not the generator's; `paths` names the files."""

    def __init__(self, message: str, paths: tuple[str, ...]) -> None:
        super().__init__(message)
        self.paths = paths


class BuildError(MamboNmpcError):
    """The C cannot be compiled here: no compiler, no headers, or the compiler refused."""


class DriftError(MamboNmpcError):
    """A bundle on disk is not what its settings generate."""

    exit_code = 1


class LayoutError(MamboNmpcError):
    """A bundle in folders would become an amalgamated one, or the other way round, and nobody said so."""
