"""The presets: TOML files that hold and explain only what differs from the defaults."""

from typing import Final

from mambo_codegen.errors import SourceNotFoundError, echo
from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.toml_file import PRESETS, existing_path

CONTROLLER: Final = "controller.toml"
"""The settings file in the folder of a bundle."""


def names() -> tuple[str, ...]:
    """Return the names of the presets, sorted."""
    return PRESETS.names()


def preset(name: str) -> Settings:
    """Return the settings of the preset `name`; raises SourceNotFoundError."""
    return controller_toml.parse(PRESETS.text(name), f"preset {name}")


def load(name_or_path: str) -> Settings:
    """Return the settings of a preset or of a file; `mambo` is the preset, `./mambo` a file.

    Raises SourceNotFoundError if there is neither, and what `controller_toml.read` raises.
    """
    path = PRESETS.own_file(name_or_path)
    return preset(name_or_path) if path is None else controller_toml.read(path)


def load_or_bundle(name_or_path: str) -> Settings:
    """Return the settings of a preset, of a file, or of the bundle in a folder; raises as `load`."""
    path = existing_path(name_or_path)
    if name_or_path in names() or path is None or not path.is_dir():
        return load(name_or_path)
    if not (path / CONTROLLER).exists():
        raise SourceNotFoundError(
            f"{echo(name_or_path)}: is a folder without {CONTROLLER}; "
            "name a settings file, or the folder of a bundle"
        )
    return controller_toml.read(path / CONTROLLER)
