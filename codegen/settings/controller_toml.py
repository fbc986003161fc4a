"""Read and write controller.toml: text to settings with every fault at once, settings to commented text."""

import re
import textwrap
import tomllib
from collections.abc import Mapping
from pathlib import Path

from pydantic import ValidationError

from codegen.errors import InvalidSettingsError, UnreadableFileError, echo
from codegen.settings.faults import faults
from codegen.settings.keys import KEYS, SECTIONS, spelled
from codegen.settings.model import Settings

LARGEST_FILE_BYTES = 64_000
COLUMNS = 88

_TITLE = "Settings of a mambo-nmpc controller."
_SECTION = re.compile(r"\s*\[\s*([^\[\]]*?)\s*\]")
_TWICE = re.compile("Cannot (declare|overwrite|mutate|redefine)")
_LONG_NUMBER = re.compile(r"\d(_?\d){4300,}")
_PLACE = re.compile(r"(?P<reason>.*) \(at (?P<place>.*)\)", re.DOTALL)


def read(path: Path) -> Settings:
    """Read the settings in the file at `path`.

    Raises UnreadableFileError for what is not TOML, InvalidSettingsError for settings that break a rule.
    """
    name = echo(str(path))
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE_BYTES + 1)
    except FileNotFoundError:
        raise UnreadableFileError(f"{name}: there is no such file") from None
    except IsADirectoryError:
        raise UnreadableFileError(f"{name}: is a folder; name the controller.toml in it") from None
    except OSError as error:
        raise UnreadableFileError(f"{name}: cannot be read: {error.strerror}") from error
    if len(content) > LARGEST_FILE_BYTES:
        raise UnreadableFileError(f"{name}: is larger than 64 kB; settings take a few")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise UnreadableFileError(f"{name}: line {line}: is not UTF-8; save the file as UTF-8") from None
    return parse(text, name)


def parse(text: str, source: str) -> Settings:
    """Return the settings in `text`; `source` begins every message.

    Raises UnreadableFileError for bad syntax, InvalidSettingsError with all faults for bad settings.
    """
    try:
        document = tomllib.loads(text)
    except RecursionError:
        raise UnreadableFileError(f"{source}: is nested too deeply; settings are [section] and key") from None
    except ValueError as error:
        raise UnreadableFileError(f"{source}: {_syntax_fault(str(error), text)}") from None
    try:
        return Settings.model_validate(document)
    except ValidationError as error:
        raise _invalid(source, error, document) from None


def with_option(settings: Settings, path: str, value: object, source: str) -> Settings:
    """Return `settings` with `value` at the dotted `path`, under the rules of the file.

    `source` names in the message who asked for it, an option of the command line. Raises
    InvalidSettingsError.
    """
    section, name = path.split(".")
    document = settings.model_dump()
    document[section][name] = value
    try:
        return Settings.model_validate(document)
    except ValidationError as error:
        raise _invalid(source, error, document) from None


def to_toml(settings: Settings, title: str = _TITLE) -> str:
    """Return a complete controller.toml, a comment above every key; reading it gives equal settings."""
    parts = [_comment(title), _comment("A missing key takes the value of preset table1.")]
    values = settings.model_dump()
    for section, about in SECTIONS.items():
        parts += ["", _comment(about), f"[{section}]"]
        for name, value in values[section].items():
            key = KEYS[f"{section}.{name}"]
            admits = _comment(f"{key.kind.capitalize()}: {key.domain}.")
            parts += ["", _comment(key.description), admits, f"{name} = {spelled(value)}"]
    return "\n".join(parts) + "\n"


def _comment(text: str) -> str:
    return textwrap.fill(text, COLUMNS, initial_indent="# ", subsequent_indent="# ", break_on_hyphens=False)


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


def _invalid(source: str, error: ValidationError, document: Mapping[str, object]) -> InvalidSettingsError:
    return InvalidSettingsError(tuple(f"{source}: {fault}" for fault in faults(error, document)))
