"""Build the generated app of a Crazyflie with the C of the desk, and load one copy for each flight."""

import shutil
import tempfile
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Final

import cffi

from mambo_codegen.bundle.render import render_target
from mambo_codegen.bundle.targets import find_target
from mambo_codegen.settings.model import Settings
from mambo_codegen.toolchain import Toolchain
from mambo_sil.results.shared_library import LibrarySource, built_library, load_library

SOURCES: Final = (
    *("airframe.c", "desk.c", "estimator.c", "lighthouse.c", "loops.c", "noise.c"),
    "set_points.c",
)
HEADERS: Final = ("airframe.h", "desk.h", "estimator.h", "lighthouse.h", "noise.h", "set_points.h")
FLAGS: Final = ("-std=gnu11", "-O2", "-ffp-contract=off", "-Wl,-Bsymbolic", "-I.", "-Istand_ins", "-Isrc")
"""With -Bsymbolic two libraries in a process do not share the variables of an app."""
TARGET: Final = "crazyflie"


@cache
def interface() -> Any:
    """Return what Python knows of the desk: the declarations of desk.h."""
    ffi = cffi.FFI()
    text = resources.files(__package__).joinpath("desk.h").read_text("utf-8")
    ffi.cdef("\n".join(line for line in text.splitlines() if not line.startswith("#")))
    return ffi


def build(settings: Settings, toolchain: Toolchain) -> Path:
    """Return the library of an app on the desk, built unless it is cached; raises BuildError, CacheError."""
    folder = resources.files(__package__)
    files = {name: folder.joinpath(name).read_text("utf-8") for name in (*SOURCES, *HEADERS)}
    for stand_in in folder.joinpath("stand_ins").iterdir():
        files[f"stand_ins/{stand_in.name}"] = stand_in.read_text("utf-8")
    app = render_target(settings, find_target(TARGET), with_digest=True)
    files |= {
        path: text for path, text in app.items() if path.startswith("src/") and path[-2:] in (".c", ".h")
    }
    return built_library(LibrarySource("desk", files, lambda: files, FLAGS, interface(), ("-lm",)), toolchain)


def load_copy(library: Path) -> Any:
    """Load a copy of a library, since an app has no way back to its start; raises CacheError."""
    with tempfile.TemporaryDirectory(prefix="desk-") as folder:
        return load_library(Path(shutil.copy(library, folder)), interface())
