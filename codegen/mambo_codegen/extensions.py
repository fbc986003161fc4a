"""What extensions give the core: entry points of installed packages, which are asked for by name.

The core imports no extension. `pyproject.toml` says in `[project.entry-points."mambo_nmpc.GROUP"]` what ours
give; CONTRIBUTING.md lists the groups. Nothing of an extension is imported before it is asked for.
"""

import hashlib
import importlib
import importlib.util
import json
import sys
from functools import cache
from pathlib import Path
from typing import Any, Final

from mambo_codegen.errors import MamboNmpcError, echo
from mambo_codegen.user_cache import read_cached, write_cached

AGAIN: Final = "run python -m pip install -e . again"
"""What makes the metadata of an editable install those of its sources."""

_PREFIX: Final = "mambo_nmpc."
_Groups = dict[str, dict[str, str]]
"""Groups, each with the places of what it has by name, as in `module:attribute`."""


class MissingExtensionError(MamboNmpcError):
    """No installed extension gives what is asked for."""


def names(group: str) -> tuple[str, ...]:
    """Return the names in a group, sorted."""
    return tuple(sorted(_installed().get(group, ())))


def load(group: str, name: str) -> Any:
    """Import and return what a group has by that name; raises MissingExtensionError."""
    place = _installed().get(group, {}).get(name)
    if place is None:
        raise MissingExtensionError(
            f"no installed extension gives {echo(name)} (entry points {_PREFIX}{group}); if its folder is "
            f"among the sources, {AGAIN}"
        )
    module, _, attribute = place.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute)
    except ModuleNotFoundError as error:
        if error.name is None or not module.startswith(error.name):
            raise
        raise MissingExtensionError(
            f"{module} is not there, though the installed metadata name it (entry points {_PREFIX}{group}): "
            f"{AGAIN}"
        ) from error


def load_all(group: str) -> dict[str, Any]:
    """Import all of a group, by name; raises MissingExtensionError."""
    return {name: load(group, name) for name in names(group)}


def are_older_than_sources() -> bool:
    """Return whether the metadata know no extension, though there are folders of some."""
    spec = None if _installed() else importlib.util.find_spec("mambo_extensions")
    places = () if spec is None else spec.submodule_search_locations or ()
    return any(True for place in places for _ in Path(place).glob("*/__init__.py"))


@cache
def _installed() -> _Groups:
    """Return the entry points of all groups, kept for as long as no folder of packages changes.

    To read the metadata of every package takes a fifth of the time of `--help`.
    """
    name = hashlib.sha256(sys.prefix.encode()).hexdigest()[:32]
    state = [[path, Path(path).stat().st_mtime_ns] for path in sys.path if Path(path).is_dir()]
    cached = read_cached("extensions", name)
    if cached is not None:
        document = json.loads(cached)
        if document["state"] == state:
            groups: _Groups = document["groups"]
            return groups
    groups = _read_metadata()
    write_cached("extensions", name, json.dumps({"state": state, "groups": groups}).encode())
    return groups


def _read_metadata() -> _Groups:
    from importlib.metadata import entry_points  # noqa: PLC0415 - slow, and kept

    found = entry_points()
    return {
        group.removeprefix(_PREFIX): {one.name: one.value for one in found.select(group=group)}
        for group in sorted(found.groups)
        if group.startswith(_PREFIX)
    }
