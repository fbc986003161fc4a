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

CONTROLLER: Final = """\
# Settings: controller.toml

`mambo-nmpc init` writes such a file with the explanation of every key. A missing key has its default, which
is preset `table1`; an unknown key, a value out of range, and a value that would have no effect are refused
with the rule and the fix. `vehicle`, above all sections, is the [drone](vehicles.md) that commands fly with
the settings; the C does not depend on it. `mambo-nmpc schema` prints the JSON schema, with which editors
check and complete the file.

The method is `cost.norm`. A key that only one method uses says so. The last column is preset `mambo`.
"""

VEHICLE: Final = """\
# Drones: vehicle.toml

`mambo-nmpc vehicles generic` prints such a file, with the source of every value; [Vehicles](vehicles.md)
explains what the sections do, [your own drone](../tutorials/own-drone.md) has a short example. The unit is in
the name of a key, in SI. `mambo-nmpc vehicles --schema` prints the JSON schema, with which editors check and
complete the file.

"""


def controller_page() -> str:
    """Return the page of controller.toml: a table for each section."""
    parts = [CONTROLLER]
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


def vehicle_page() -> str:
    """Return the page of vehicle.toml: a table for each section, and for each of its kinds."""
    parts = [VEHICLE]
    shown: set[str] = set()
    for attitude, sensors in (("cascade", "mambo"), ("first_order", "mocap"), ("mambo", "none")):
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
