"""The presets: TOML files that hold and explain only what differs from the defaults."""

import difflib
from typing import Final

from mambo_codegen.errors import SourceNotFoundError, echo
from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.toml_file import PRESETS, existing_path, shipped

CONTROLLER: Final = "controller.toml"
"""The settings file in the folder of a bundle."""


def names() -> tuple[str, ...]:
    """Return the names of the presets, sorted."""
    return tuple(shipped(PRESETS))


def preset(name: str) -> Settings:
    """Return the settings of the preset `name`; raises SourceNotFoundError."""
    return controller_toml.parse(_text(name), f"preset {name}")


def description(name: str) -> str:
    """Return the purpose of the preset `name`, in one line; raises SourceNotFoundError."""
    return _text(name).splitlines()[0].removeprefix("# ")


def load(name_or_path: str) -> Settings:
    """Return the settings of a preset or of a file; `mambo` is the preset, `./mambo` a file.

    Raises SourceNotFoundError if there is neither, and what `controller_toml.read` raises.
    """
    if name_or_path in names():
        return preset(name_or_path)
    path = existing_path(name_or_path)
    if path is None:
        raise _not_found(name_or_path, "neither a preset nor a file")
    return controller_toml.read(path)


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


def _text(name: str) -> str:
    ours = shipped(PRESETS).get(name)
    if ours is None:
        raise _not_found(name, "not a preset")
    return ours.read_text("utf-8")


def _not_found(name: str, what: str) -> SourceNotFoundError:
    near = difflib.get_close_matches(name, names(), n=1)
    guess = f" (did you mean {near[0]}?)" if near else ""
    return SourceNotFoundError(
        f"{echo(name)} is {what}{guess}; presets are {', '.join(names())}, "
        "and `mambo-nmpc init` writes a controller.toml to start from"
    )
