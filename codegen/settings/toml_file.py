"""Read TOML files that people write, and say in their words what is wrong with one."""

import re
import tomllib
from pathlib import Path
from typing import Any

from mambo_nmpc.codegen.errors import UnreadableFileError, echo

LARGEST_FILE_BYTES = 64_000

_SECTION = re.compile(r"\s*\[\s*([^\[\]]*?)\s*\]")
_TWICE = re.compile("Cannot (declare|overwrite|mutate|redefine)")
_LONG_NUMBER = re.compile(r"\d(_?\d){4300,}")
_PLACE = re.compile(r"(?P<reason>.*) \(at (?P<place>.*)\)", re.DOTALL)


def read_text(path: Path) -> str:
    """Return the text of the file at `path`; raises UnreadableFileError."""
    name = echo(str(path))
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE_BYTES + 1)
    except FileNotFoundError:
        raise UnreadableFileError(f"{name}: there is no such file") from None
    except IsADirectoryError:
        raise UnreadableFileError(f"{name}: is a folder; name a TOML file in it") from None
    except OSError as error:
        raise UnreadableFileError(f"{name}: cannot be read: {error.strerror}") from error
    if len(content) > LARGEST_FILE_BYTES:
        raise UnreadableFileError(f"{name}: is larger than 64 kB; such files take a few")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise UnreadableFileError(f"{name}: line {line}: is not UTF-8; save the file as UTF-8") from None
    return text


def parse_document(text: str, source: str) -> dict[str, Any]:
    """Return what TOML `text` says; `source` begins every message. Raises UnreadableFileError."""
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise UnreadableFileError(
            f"{source}: is nested too deeply; write [section] and key = value"
        ) from None
    except ValueError as error:
        raise UnreadableFileError(f"{source}: {_syntax_fault(str(error), text)}") from None


def _syntax_fault(message: str, text: str) -> str:
    """Put the place that tomllib reports last in front, as compilers do."""
    number = _LONG_NUMBER.search(text)
    if number and "digits" in message:
        line = text.count("\n", 0, number.start()) + 1
        return f"line {line}: a number has {len(number[0])} digits; write a shorter one"
    found = _PLACE.fullmatch(message)
    if found is None:
        return f"is not TOML: {echo(message)}"
    last_line = text.rstrip().count("\n") + 1
    place = found["place"].replace("end of document", f"line {last_line}")
    line_number = re.match(r"line (\d+)", place)
    if line_number and _TWICE.match(found["reason"]):
        names = re.findall(r"'([^']*)'", found["reason"])
        return f"{place}: {_set_twice(text.splitlines()[: int(line_number[1])], names)}"
    return f"{place}: {echo(found['reason'])}"


def _set_twice(lines: list[str], names: list[str]) -> str:
    """Say which section or key the last of `lines` sets again; tomllib may have told its `names`."""
    opened = [found[1] for line in lines if (found := _SECTION.match(line))]
    if _SECTION.match(lines[-1]):
        section = echo(f"[{opened[-1]}]")
        return f"{section} is there already; put all its keys below one {section}"
    key, assigned, _ = lines[-1].partition("=")
    dotted = ".".join(names or [*opened[-1:], key.strip()]) if names or assigned else "a key"
    return f"{echo(dotted)} is set already; keep one of the two"
