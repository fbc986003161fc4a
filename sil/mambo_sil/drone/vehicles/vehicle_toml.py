"""Read vehicle.toml, and find the drones that are shipped."""

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from mambo_codegen.errors import InvalidSettingsError, echo, echo_value
from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.messages import faults
from mambo_codegen.settings.toml_file import PRESETS, existing_path, parse_document, read_text
from mambo_sil.drone.vehicles import VEHICLES
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile, form

DEFAULT: Final = "mambo"
"""The drone that flies where none is named."""


def names() -> tuple[str, ...]:
    """Return the names of the shipped drones, sorted."""
    return VEHICLES.names()


@lru_cache
def preset(name: str) -> VehicleFile:
    """Return the shipped drone `name`; raises SourceNotFoundError."""
    return parse(VEHICLES.text(name), name, f"vehicle {name}")


def load(name_or_path: str) -> VehicleFile:
    """Return a shipped drone or the drone of a file; `mambo` is the shipped one, `./mambo` a file.

    Raises SourceNotFoundError if there is neither, UnreadableFileError if the file is not TOML,
    InvalidSettingsError with all broken rules.
    """
    path = VEHICLES.own_file(name_or_path)
    return preset(name_or_path) if path is None else read(path)


def of_settings(source: str) -> str | None:
    """Return the drone that a settings file is for, as `load` takes it; None without one, or for a preset.

    The file names a shipped drone, or a vehicle.toml with a path relative to its own folder. Raises
    InvalidSettingsError if there is neither, and what `controller_toml.named_vehicle` raises.
    """
    path = existing_path(source)
    if source in PRESETS.names() or path is None or not path.is_file():
        return None
    named = controller_toml.named_vehicle(path)
    if named is None or named in names():
        return named
    beside = path.parent / named
    if not beside.exists():
        raise InvalidSettingsError(
            (
                f"{echo(source)}: {controller_toml.VEHICLE} = {echo_value(named)} is neither a shipped drone "
                "nor a file; write where its vehicle.toml is, or name a drone with --vehicle",
            )
        )
    return str(beside)


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
