"""Compile a controller with the engine of the simulation to WebAssembly, by clang and lld."""

import hashlib
import shutil
from importlib import resources
from pathlib import Path
from typing import Final

from mambo_codegen.bundle.flags import COMPILE_FLAGS
from mambo_codegen.bundle.render import render
from mambo_codegen.errors import BuildError
from mambo_codegen.methods import method_of
from mambo_codegen.settings.model import Settings
from mambo_codegen.toolchain import Toolchain
from mambo_extensions.playground.page_controllers import PageController
from mambo_sil.flight.controllers.controller_library import c_files, glue, with_default_prefix
from mambo_sil.flight.engine.engine_library import texts
from mambo_sil.flight.engine.native import PD_STEPS
from mambo_sil.results.build_folders import build_cached, write_sources

ENGINE_CALLS: Final = (
    *("engine_begin", "engine_update", "engine_start_sensors", "engine_fly"),
    *("playground_controller", "playground_flying_bytes", "playground_eight", "playground_circle"),
    "playground_swing",
    "__heap_base",
)
"""What the page calls in every module; it puts its records behind __heap_base."""
CONTROLLER_CALLS: Final = ("nmpc_batch_init", "nmpc_batch_instance_bytes")
"""What it calls besides in one with generated C; with a 1-norm also nmpc_host_set_weights."""
LIMIT_CALLS: Final = ("nmpc_default_limits", "nmpc_host_set_limits", "nmpc_host_limits_active")
"""What it calls besides in one whose settings have limits."""

_FLAGS: Final = (*COMPILE_FLAGS, "--target=wasm32", "-ffreestanding", "-nostdlib", "-Wl,--no-entry")
_UNUSED: Final = ("evaluation.c", "faults.c")
"""No page evaluates flights, or injects faults, whose C wants the standard library."""


def module(one: PageController) -> bytes:
    """Return the WebAssembly of one drone; raises BuildError and CacheError."""
    files, calls, step = program(one)
    exports = [f"-Wl,--export={name}" for name in calls]
    units = sorted(path for path in files if path.endswith(".c"))
    arguments = [*_FLAGS, "-I.", f"-DCONTROLLER={step}", *exports, *units, "-o", "drone.wasm"]
    compiler = _compiler()

    def build(folder: Path) -> Path:
        write_sources(files, folder)
        compiler.run(arguments, folder)
        return folder / "drone.wasm"

    key = hashlib.sha256(repr((files, arguments, compiler.identity())).encode()).hexdigest()[:32]
    return build_cached(f"playground_{key}.wasm", build).read_bytes()


def _compiler() -> Toolchain:
    """Return clang, which calls wasm-ld; raises BuildError if one of them is missing."""
    for tool, package in (("clang", "clang"), ("wasm-ld", "lld")):
        if shutil.which(tool) is None:
            raise BuildError(
                f"{tool} not found: the page is compiled to WebAssembly with clang and wasm-ld; "
                f"install it (Debian: {package})"
            )
    return Toolchain(("clang",))


def program(one: PageController) -> tuple[dict[str, str], tuple[str, ...], str]:
    """Return the C by path, the functions that the page calls, and the step of the controller."""
    engine = {path: text for path, text in texts().items() if path not in _UNUSED}
    files = engine | {
        "playground.c": _text("mambo_extensions.playground", "playground.c"),
        "math.h": _text("mambo_extensions.playground", "math.h"),
        "freestanding.c": _text("mambo_sil.board.firmware", "freestanding.c"),
    }
    controller = one.kind
    if not isinstance(controller, Settings):
        return files, ENGINE_CALLS, PD_STEPS[controller]
    bundle = render(with_default_prefix(controller), with_digest=False)
    files |= c_files(bundle) | glue()
    weights = ("nmpc_host_set_weights",) if method_of(controller).weight_limits else ()
    limits = LIMIT_CALLS if method_of(controller).limiting else ()
    return files, (*ENGINE_CALLS, *CONTROLLER_CALLS, *weights, *limits), "nmpc_host_step"


def _text(package: str, name: str) -> str:
    return resources.files(package).joinpath(name).read_text("utf-8")
