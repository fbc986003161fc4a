"""The module of `generate --for px4` with what takes the place of PX4's headers."""

import re
import struct
from pathlib import Path
from typing import Final

import mambo_templates
from mambo_codegen.bundle.render import render_target
from mambo_codegen.bundle.targets import find_target
from mambo_codegen.settings.controller_toml import parse
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.model.derive.derived_flight import chosen_text

HERE: Final = Path(__file__).parent
TEMPLATES: Final = Path(mambo_templates.__file__).parent / "firmware" / "px4"
POSITION, HOLD, LAND, MPC = 2, 4, 18, 23
"""Modes of PX4: `nav_state`."""
MODULE: Final = find_target("px4").source_folder
_INCLUDE: Final = re.compile(r"^#include <([a-zA-Z0-9_/]+\.(?:h|hpp))>$", re.MULTILINE)
_FIELD: Final = re.compile(r"^(\w+?)(\d*)(?:\[(\d)\])? (\w+)(?: = (\d+))?\s*(?:#.*)?$", re.MULTILINE)
_TYPES: Final = {"bool": "bool", "uint": "uint{}_t", "float": "float"}
LOGGED: Final = {"bool": "uint8_t", "uint8_t": "uint8_t", "uint16_t": "uint16_t", "float": "float"}


def px4_settings() -> Settings:
    """Return the settings that `design crazyflie` writes."""
    return parse(chosen_text(vehicle_toml.load("crazyflie"), "crazyflie"), "controller.toml")


def status_fields(message: str) -> tuple[dict[str, str], list[tuple[str, str, int]]]:
    """Return the constants of a topic by declaration, and type, name and count of its fields; 0: no array."""
    constants, fields = {}, []
    for kind, bits, count, name, value in _FIELD.findall(message):
        c_type = _TYPES[kind].format(bits)
        if value:
            constants[f"{c_type} {name}"] = value
        else:
            fields.append((c_type, name, int(count or 0)))
    return constants, fields


def status_header(message: str) -> str:
    """Return C++ of the topic that a .msg describes: the structure, and rows of a table of its fields."""
    constants, fields = status_fields(message)
    lines = [f"static constexpr {name} = {value};" for name, value in constants.items()]
    lines += [f"{kind} {name}{f'[{count}]' if count else ''};" for kind, name, count in fields]
    rows = [
        f'{{"{LOGGED[kind]}", "s.{name}{at}", &data_mc_nmpc_status.{name}{at}}},'
        for kind, name, count in fields
        if kind in LOGGED
        for at in ([f"[{k}]" for k in range(count)] or [""])
    ]
    body = "\n".join(lines)
    return f"struct mc_nmpc_status_s {{\n{body}\n}};\n#define STATUS_FIELDS {' '.join(rows)}\n"


def status_ulog(rows: list[dict[str, float]], fields: list[tuple[str, str, int]]) -> bytes:
    """Return a ULog of the steps in `rows`, 10 ms apart."""
    kept = [(name, count) for kind, name, count in fields if kind in LOGGED]
    kinds = ";".join(f"float{f'[{count}]' if count else ''} {name}" for name, count in kept)
    line = f"mc_nmpc_status:uint64_t timestamp;uint64_t timestamp_sample;{kinds};"

    def part(kind: bytes, content: bytes) -> bytes:
        return struct.pack("<Hc", len(content), kind) + content

    parts = [b"\x55\x4c\x6f\x67\x01\x12\x35\x01" + struct.pack("<Q", 0), part(b"F", line.encode())]
    parts.append(part(b"A", struct.pack("<BH", 0, 0) + b"mc_nmpc_status"))
    for number, row in enumerate(rows):
        time_us = 10000 * number + 10**7
        values = struct.pack(f"<{len(row)}f", *row.values())
        parts.append(part(b"D", struct.pack("<HQQ", 0, time_us, time_us) + values))
    return b"".join(parts)


def px4_files(settings: Settings) -> dict[str, str]:
    """Return the module's C and C++ by path, with headers in the place of PX4's in the folder px4."""
    rendered = render_target(settings, find_target("px4"), with_digest=False)
    module = {path.removeprefix(MODULE): text for path, text in rendered.items() if path.startswith(MODULE)}
    code = {path: text for path, text in module.items() if path.endswith((".c", ".h", ".cpp", ".hpp"))}
    named = {name for text in code.values() for name in _INCLUDE.findall(text) if "/" in name}
    defaults = ", ".join(f"{value}f" for value in re.findall(r"default: (\S+)", module["module.yaml"]))
    return {
        **code,
        **{f"px4/{name}": "#include <px4.hpp>\n" for name in named},
        "px4/px4.hpp": (HERE / "px4.hpp").read_text("utf-8"),
        "px4/mc_nmpc_status.hpp": status_header(rendered["msg/McNmpcStatus.msg"]),
        "px4/mc_nmpc/all.hpp": f'#include "mc_nmpc.hpp"\n#define DEFAULT_PARAMETERS {defaults}, 0.5f\n',
    }
