"""Read TOML files, with messages that name file and line."""

import re
import tomllib
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from mambo_codegen.errors import UnreadableFileError, echo
from mambo_codegen.plain_file import read_plain_file

LARGEST_FILE_BYTES = 64_000
BOARDS, PRESETS, VEHICLES = "boards", "presets", "vehicles"
"""The kinds of TOML files that the package holds."""

_PLACE = re.compile(r"(?P<reason>.*) \(at (?P<place>line (?P<line>\d+), column \d+)\)", re.DOTALL)


def shipped(kind: str, package: str = "mambo_codegen") -> dict[str, Traversable]:
    """Return the TOML files of a kind that a package holds, {name: file}, sorted by name."""
    folder = resources.files(package) / "data" / kind
    files = {file.name.removesuffix(".toml"): file for file in folder.iterdir()}
    return dict(sorted(files.items()))


def existing_path(text: str) -> Path | None:
    """Return the path in `text` if something is there, else None."""
    try:
        return path if (path := Path(text)).exists() else None
    except OSError:  # too long a name, for example
        return None


def read_text(path: Path) -> str:
    """Return the text of the file at `path`; raises UnreadableFileError."""
    name = echo(str(path))
    try:
        content = read_plain_file(path, LARGEST_FILE_BYTES + 1)
    except FileNotFoundError:
        raise UnreadableFileError(f"{name}: there is no such file") from None
    except IsADirectoryError:
        raise UnreadableFileError(f"{name}: is a folder; name a TOML file in it") from None
    except OSError as error:
        raise UnreadableFileError(f"{name}: cannot be read: {error.strerror}") from error
    if len(content) > LARGEST_FILE_BYTES:
        raise UnreadableFileError(f"{name}: is larger than 64 kB; a settings file needs a few kB")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise UnreadableFileError(f"{name}: line {line}: is not UTF-8; save the file as UTF-8") from None


def parse_document(text: str, source: str) -> dict[str, Any]:
    """Parse TOML; `source` begins every message. Raises UnreadableFileError."""
    try:
        return tomllib.loads(text + "\n")  # without "\n" a fault at the end has no line number
    except RecursionError:
        raise UnreadableFileError(
            f"{source}: is nested too deeply; write [section] and key = value"
        ) from None
    except ValueError as error:
        raise UnreadableFileError(f"{source}: {_syntax_fault(str(error), text)}") from None


def _syntax_fault(message: str, text: str) -> str:
    """Put the line number that tomllib reports at the front, as compilers do, and quote the line."""
    found = _PLACE.fullmatch(message)
    if found is None:
        return f"is not TOML: {echo(message)}"
    advice = "; write each section and key once" if found["reason"].startswith("Cannot") else ""
    line = text.split("\n")[int(found["line"]) - 1].strip()
    return f"{found['place']}: {echo(found['reason'])}{advice}: {echo(line)}"
