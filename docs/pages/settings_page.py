"""The pages of controller.toml and vehicle.toml, from the models that check those files."""

from collections.abc import Iterable
from typing import Final

from docs.pages.tables import code, plain, table
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_keys import KEYS, SECTIONS
from mambo_codegen.settings.key import Key, spell
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles.vehicle_file import form

UNITS: Final = {"_m_s2": "m/s^2", "_m_s": "m/s", "_1_s": "1/s", "_rad": "rad", "_m": "m", "_s": "s"}
"""The unit that the end of a setting's name stands for; the first end that fits counts."""


def controller_part() -> str:
    """Return what the code writes on the page of controller.toml: a table for each section."""
    parts = ["The last column is preset `mambo`."]
    for section, description in SECTIONS.items():
        rows = [_row(key) for path, key in KEYS.items() if path.rpartition(".")[0] == section]
        head = ["key", "meaning", "allowed", "default", "`mambo`"]
        parts += [f"\n## [{section}]\n", plain(description) + "\n", table(head, rows)]
    return "\n".join(parts) + "\n"


def _row(key: Key) -> list[str]:
    """Return the cells of a setting; the last is empty where preset mambo does not use it."""
    quadratic, one_norm = presets.preset("mambo"), presets.preset("mambo-1norm")
    meaning = plain(key.description)
    if quadratic.unmet(key.path) == "without [height]":
        meaning = f"With [height] only. {meaning}"
    elif not one_norm.uses(key.path):
        meaning = f"Quadratic cost only. {meaning}"
    value = ""
    if quadratic.uses(key.path):
        value = spell(quadratic.value(key.path))
    elif one_norm.uses(key.path):
        meaning = f"1-norm only. {meaning}"
    default = spell(Settings().value(key.path))
    return [
        code(key.path.rpartition(".")[2]),
        meaning,
        f"{_domain(key)} {_unit(key)}".strip(),
        code(default),
        code(value),
    ]


def vehicle_part() -> str:
    """Return what the code writes on the page of vehicle.toml: a table for each section and each kind."""
    parts = []
    shown: set[str] = set()
    for attitude, sensors in (("cascade", "mambo"), ("first_order", "mocap"), ("mambo", "true")):
        found = form(attitude, sensors)
        kinds = {"attitude": attitude, "sensors": sensors}
        for section, description in found.sections.items():
            kind = kinds.get(section.partition(".")[0])
            title = f"[{section}]" + (f", kind {kind}" if kind else "")
            keys = [key for key in found.keys.values() if key.path.rpartition(".")[0] == section]
            if title not in shown and keys:
                shown.add(title)
                parts += [f"\n## {title}\n", plain(description) + "\n", _vehicle_table(section, keys)]
    return "\n".join(parts) + "\n"


def _vehicle_table(section: str, keys: Iterable[Key]) -> str:
    rows = []
    for key in keys:
        name = key.path.removeprefix(f"{section}.")
        rows.append([code(name), plain(key.description or ""), _domain(key)])
    return table(["key", "meaning", "allowed"], rows)


def _domain(key: Key) -> str:
    return plain(f"{key.kind} {key.domain}" if key.kind == "whole number" else key.domain)


def _unit(key: Key) -> str:
    """Return the unit in the name of a setting, or nothing."""
    return next((unit for end, unit in UNITS.items() if key.path.endswith(end) and key.low is not None), "")
