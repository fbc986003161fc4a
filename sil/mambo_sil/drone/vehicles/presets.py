"""Read vehicle.toml, and find the drones that are shipped."""

import difflib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from mambo_codegen.errors import InvalidSettingsError, SourceNotFoundError, echo
from mambo_codegen.settings.messages import faults
from mambo_codegen.settings.toml_file import VEHICLES, existing_path, parse_document, read_text, shipped
from mambo_sil.drone.vehicles.model import VehicleFile, form

DEFAULT: Final = "mambo"
"""The drone that flies where none is named."""

_PACKAGE: Final = "mambo_sil.drone.vehicles"


def names() -> tuple[str, ...]:
    """Return the names of the shipped drones, sorted."""
    return tuple(shipped(VEHICLES, _PACKAGE))


def text_of(name: str) -> str:
    """Return the vehicle.toml of a shipped drone; raises SourceNotFoundError."""
    ours = shipped(VEHICLES, _PACKAGE).get(name)
    if ours is None:
        raise _not_found(name, "no shipped vehicle")
    return ours.read_text("utf-8")


def description(name: str) -> str:
    """Return what a shipped drone is, in one line; raises SourceNotFoundError."""
    return text_of(name).splitlines()[0].removeprefix("# ")


@lru_cache
def preset(name: str) -> VehicleFile:
    """Return the shipped drone `name`; raises SourceNotFoundError."""
    return parse(text_of(name), name, f"vehicle {name}")


def load(name_or_path: str) -> VehicleFile:
    """Return a shipped drone or that of a file; `mambo` is the shipped one, `./mambo` a file.

    Raises SourceNotFoundError if there is neither, UnreadableFileError if the file is not TOML,
    InvalidSettingsError with all broken rules.
    """
    if name_or_path in names():
        return preset(name_or_path)
    path = existing_path(name_or_path)
    if path is None:
        raise _not_found(name_or_path, "neither a shipped vehicle nor a file")
    return read(path)


def read(path: Path) -> VehicleFile:
    """Return the drone in the file at `path`; raises UnreadableFileError, InvalidSettingsError."""
    return parse(read_text(path), path.stem, echo(str(path)))


def parse(text: str, name: str, source: str) -> VehicleFile:
    """Return the drone in `text`; `source` begins every message.

    Raises UnreadableFileError for bad syntax, InvalidSettingsError with all faults.
    """
    document = parse_document(text, source)
    if "name" in document:
        raise InvalidSettingsError((f"{source}: name is not a key; remove it, the file's name is the name",))
    try:
        return VehicleFile.model_validate({"name": name, **document})
    except ValidationError as error:
        found = faults(error, document, form(_kind(document, "attitude"), _kind(document, "sensors")))
        raise InvalidSettingsError(tuple(f"{source}: {fault}" for fault in found)) from None


def _kind(document: Mapping[str, Any], section: str) -> str:
    """Return the kind of a section as the document says, whatever it is."""
    found = document.get(section)
    return str(found.get("kind")) if isinstance(found, Mapping) else ""


def _not_found(name: str, what: str) -> SourceNotFoundError:
    near = difflib.get_close_matches(name, names(), n=1)
    guess = f" (did you mean {near[0]}?)" if near else ""
    return SourceNotFoundError(
        f"{echo(name)} is {what}{guess}; vehicles are {', '.join(names())}, "
        "and `mambo-nmpc vehicles NAME` prints one to start from"
    )
