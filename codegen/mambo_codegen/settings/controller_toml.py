"""Read and write controller.toml: text to settings, all faults reported at once, and back."""

import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from mambo_codegen.errors import InvalidSettingsError, UnreadableFileError, echo, echo_value
from mambo_codegen.settings.key import spell
from mambo_codegen.settings.messages import faults
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.sections import DEFAULTS
from mambo_codegen.settings.toml_file import parse_document, read_text

COLUMNS = 88

VEHICLE: Final = "vehicle"
"""The key of the drone that the settings are for: commands fly it, and the C does not depend on it."""

_TITLE = "Settings of a mambo-nmpc controller."
_FIX = "name a preset or a controller.toml, which `mambo-nmpc init` writes"


def read(path: Path) -> Settings:
    """Read the settings in the file at `path`, which has one at least.

    Raises UnreadableFileError if it is not TOML, InvalidSettingsError if settings break a rule.
    """
    source = echo(str(path))
    if path.suffix == ".py":
        raise UnreadableFileError(f"{source}: is a Python program; {_FIX}")
    settings = _split(parse_document(read_text(path), source), source)[0]
    if not settings:
        raise InvalidSettingsError((f"{source}: has no settings; {_FIX}",))
    return validate(settings, source)


def parse(text: str, source: str) -> Settings:
    """Return the settings in `text`; `source` begins every message.

    Raises UnreadableFileError for bad syntax, InvalidSettingsError with all faults for bad settings.
    """
    return validate(_split(parse_document(text, source), source)[0], source)


def named_vehicle(path: Path) -> str | None:
    """Return the drone that the settings file at `path` is for, as it is written there; None without one.

    Raises UnreadableFileError if it is not TOML, InvalidSettingsError if the key is no text.
    """
    source = echo(str(path))
    return _split(parse_document(read_text(path), source), source)[1]


def _split(document: dict[str, Any], source: str) -> tuple[dict[str, Any], str | None]:
    """Return the settings in a document, and the drone that it names; raises InvalidSettingsError."""
    vehicle = document.pop(VEHICLE, None)
    if vehicle is not None and not (isinstance(vehicle, str) and vehicle):
        rule = "must be the name of a shipped drone, or the path of a vehicle.toml in quotes"
        raise InvalidSettingsError((f"{source}: {VEHICLE} = {echo_value(vehicle)} {rule}",))
    return document, vehicle


def validate(document: Mapping[str, object], source: str) -> Settings:
    """Return the settings in `document`; raises InvalidSettingsError with all faults, after `source`."""
    try:
        return Settings.model_validate(document)
    except ValidationError as error:
        from mambo_codegen.settings.controller_keys import SETTINGS  # noqa: PLC0415 - slow to import

        raise InvalidSettingsError(
            tuple(f"{source}: {fault}" for fault in faults(error, document, SETTINGS))
        ) from None


def with_option(settings: Settings, path: str, value: object, source: str = "settings") -> Settings:
    """Return `settings` with `value` at the dotted `path`, checked like a file.

    `source` begins the message, such as the option of the command line. Raises InvalidSettingsError.
    """
    return validate(with_value(settings.model_dump(), path, value), source)


def without(settings: Settings, section: str, source: str = "settings") -> Settings:
    """Return `settings` without an optional section; what has no effect without it has its default.

    Raises InvalidSettingsError if that breaks another rule; `source` begins its message.
    """
    bare = settings.model_copy(update={section: None})
    document = bare.model_dump()
    for path in (f"{name}.{key}" for name, values in bare.values.items() for key in values):
        if bare.unmet(path):
            document = with_value(document, path, DEFAULTS.value(path))
    return validate(document, source)


def with_value(document: Mapping[str, Any], path: str, value: object) -> dict[str, Any]:
    """Return `document` with `value` at the dotted `path`."""
    name, _, rest = path.partition(".")
    return {**document, name: with_value(document.get(name) or {}, rest, value) if rest else value}


def to_toml(settings: Settings, title: str = _TITLE) -> str:
    """Return a complete controller.toml with a comment above every key; reading it gives equal settings.

    Keys that the controller does not use are left out.
    """
    from mambo_codegen.settings.controller_keys import KEYS, SECTIONS  # noqa: PLC0415 - slow to import

    parts = [comment(title), comment("A missing key takes the value of preset table1.")]
    for section, values in settings.used_values.items():
        parts += ["", comment(SECTIONS[section]), f"[{section}]"]
        for name, value in values.items():
            key = KEYS[f"{section}.{name}"]
            admits = comment(f"{key.kind.capitalize()}: {key.domain}.")
            parts += ["", comment(key.description), admits, f"{name} = {spell(value)}"]
    return "\n".join(parts) + "\n"


def comment(text: str) -> str:
    """Return `text` as a comment of TOML, wrapped."""
    return textwrap.fill(text, COLUMNS, initial_indent="# ", subsequent_indent="# ", break_on_hyphens=False)
