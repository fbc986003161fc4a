"""Libraries of a controller in every build: each compiler and optimisation, from one translation unit."""

from typing import Any, Final

from mambo_codegen.bundle.flags import COMPILE_FLAGS
from mambo_codegen.bundle.render import render
from mambo_codegen.settings.model import Settings
from mambo_sil.flight.controllers.build import ffi, glue, with_default_prefix
from mambo_sil.results.shared_library import LibrarySource, load_shared_library
from tests.support.tools import toolchain

BUILDS: Final = (("gcc", "-O0"), ("gcc", "-O2"), ("gcc", "-O3"), ("gcc", "-Os"), ("clang", "-O2"))
_NOT_CALLED: Final = ("src/nmpc_self_test.c", "src/nmpc_float.c")


def libraries(settings: Settings) -> dict[str, Any]:
    """Build the C of a controller in each of `BUILDS`; returns the libraries by compiler and optimisation.

    The sources are joined as in an amalgamated bundle, so that each optimisation sees all of them at once.
    Self-test and interface of floats, which no step calls, are left out.
    """
    files = render(with_default_prefix(settings), with_digest=False)
    sources = sorted(path for path in files if path.startswith("src/") and path.endswith(".c"))
    joined = [*(files[path] for path in sources if path not in _NOT_CALLED), *glue().values()]
    unit = {path: text for path, text in files.items() if path.endswith(".h")} | {"all.c": "\n".join(joined)}
    source = LibrarySource("nmpc_all", unit, lambda: unit, (*COMPILE_FLAGS, "-Iinclude", "-Isrc"), ffi)
    return {
        f"{compiler} {level}": load_shared_library(source, toolchain(compiler, level))
        for compiler, level in BUILDS
    }
