"""Build the engine with the host's compiler, once per machine, and load it."""

import hashlib
import os
from functools import lru_cache
from importlib import resources
from typing import Any, Final

import numpy as np

from mambo_codegen.settings.key import spell
from mambo_codegen.toolchain import Toolchain
from mambo_sil.drone.plant import elementary
from mambo_sil.errors import FlightError
from mambo_sil.flight.columns import LEVEL, SPACE, STATE, TARGET
from mambo_sil.flight.engine import engine_interface
from mambo_sil.flight.names import ENGINE_NAMES, EngineName
from mambo_sil.results.shared_library import LibrarySource, load_shared_library

SOURCES: Final = ("evaluation.c", "faults.c", "loop.c", "pd.c")
HEADERS: Final = (
    "cascade.h",
    "drift.h",
    "elementary.h",
    "engine.h",
    "first_order.h",
    "ground.h",
    "lanes.h",
    "loop.h",
    "mocap.h",
    "records.h",
    "rigid_body.h",
    "sensors.h",
    "vehicle.h",
    "world.h",
)
CONSTANTS: Final = (
    *("TURNS_PER_RAD", "MOST_TURNS", "TURN_HIGH", "TURN_MIDDLE", "TURN_LOW", "SINE", "COSINE"),
    *("ARC_EDGES", "ARC_HIGH", "ARC_LOW", "ARC_TANGENT", "HALF_PI_HIGH", "HALF_PI_LOW"),
)
"""Names of the constants in sil/mambo_sil/drone/plant/elementary.py that the engine uses."""
FLAGS: Final = ("-std=c99", "-O3", "-ffp-contract=off", "-fno-math-errno")
"""With -O3 a flight takes four fifths of the time with -O2. -fno-math-errno takes square roots in vectors."""
LANES: Final = {1: (), 2: ("-DLANES=2",), 4: ("-DLANES=4", "-mavx2")}
"""Flags by number of lanes."""
LIBRARIES: Final = ("-lm",)
VARIABLE: Final = "MAMBO_NMPC_ENGINE"

ffi: Final[Any] = engine_interface.ffi


def declarations() -> str:
    """Return what Python knows of the engine: records.h with one lane. `ffi` is made from it."""
    records = resources.files("mambo_sil.flight.engine").joinpath("records.h").read_text("utf-8")
    return f"typedef double real_t; typedef int64_t whole_t;\n{_columns()}{records}"


def texts() -> dict[str, str]:
    """Return the engine's C by file name."""
    folder = resources.files("mambo_sil.flight.engine")
    files = {name: folder.joinpath(name).read_text("utf-8") for name in (*SOURCES, *HEADERS)}
    return files | {"constants.h": _constants(), "columns.h": _columns()}


def _columns() -> str:
    """Return how many columns there are, and where those are that the engine itself reads."""
    numbers = {
        "STATE_COLUMNS": SPACE.state,
        "TARGET_COLUMNS": SPACE.target,
        "COMMAND_COLUMNS": SPACE.command,
        "LEVEL_TARGET_COLUMNS": LEVEL.target,
        "POSITION_COLUMN": STATE["position_m"].start,
        "VELOCITY_COLUMN": STATE["velocity_m_s"].start,
        "ROLL_COLUMN": STATE["roll_rad"].start,
        "YAW_COLUMN": STATE["yaw_rad"].start,
        "HEIGHTS_COLUMN": STATE["height_m"].start,
        "HEIGHT_COLUMN": TARGET["height_m"].start,
        "CLIMB_COLUMN": TARGET["climb_m_s"].start,
        "CLIMB_ACCELERATION_COLUMN": TARGET["climb_acceleration_m_s2"].start,
    }
    return "".join(f"#define {name} {number}\n" for name, number in numbers.items())


def _constants() -> str:
    """Return the constants of `elementary` as C, in hexadecimal and so to the last bit."""
    lines = []
    for name in CONSTANTS:
        values = np.asarray(getattr(elementary, name), np.float64)
        if values.ndim == 0:
            lines.append(f"#define {name} {float(values).hex()}")
        else:
            spelled = ", ".join(float(value).hex() for value in values)
            lines.append(f"static const double {name}[] = {{ {spelled} }};")
    return "\n".join(lines) + "\n"


def chosen_engine() -> EngineName:
    """Return what computes simulations: the environment variable MAMBO_NMPC_ENGINE, by default `c`.

    Raises FlightError for an unknown value.
    """
    named = os.environ.get(VARIABLE, "c")
    for engine in ENGINE_NAMES:
        if named == engine:
            return engine
    raise FlightError(f"{VARIABLE} = {spell(named)} in the environment must be {' or '.join(ENGINE_NAMES)}")


@lru_cache
def load(toolchain: Toolchain, lanes: int = 1) -> Any:
    """Return the engine with 1, 2 or 4 lanes, built with `toolchain` unless it is cached.

    Raises BuildError and CacheError.
    """
    known = engine_interface.DECLARATIONS_SHA256
    assert known == hashlib.sha256(declarations().encode()).hexdigest(), "records.h: run `make generated`"
    files = texts()
    return load_shared_library(
        LibrarySource("engine", files, lambda: files, (*FLAGS, *LANES[lanes]), ffi, LIBRARIES), toolchain
    )


def lanes_for(flights: int, toolchain: Toolchain) -> int:
    """Return the number of lanes in which so many flights are fastest; raises as `load`."""
    return 1 if flights == 1 else int(load(toolchain).engine_fastest_lanes())


def record_type(name: str) -> np.dtype[Any]:
    """Return the NumPy type with the members and the layout of a record of records.h, with one lane."""
    kinds = {"double": "f8", "int64_t": "i8"}
    members = ffi.typeof(name).fields
    formats = []
    for _, member in members:
        kind, shape = member.type, []
        while kind.kind == "array":
            shape.append(kind.length)
            kind = kind.item
        formats.append((kinds[kind.cname], tuple(shape)))
    return np.dtype(
        {
            "names": [name for name, _ in members],
            "formats": formats,
            "offsets": [member.offset for _, member in members],
            "itemsize": ffi.sizeof(name),
        }
    )


def pointer(kind: str, array: Any) -> Any:
    """Return a pointer of type `kind` to a contiguous array, which the caller keeps alive; NULL for None."""
    return ffi.NULL if array is None else ffi.cast(kind, ffi.from_buffer(array))
