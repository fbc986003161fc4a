"""Libraries of a controller in every build: each compiler and optimisation, from one translation unit."""

from collections.abc import Sequence
from typing import Any, Final

from mambo_codegen.bundle.flags import COMPILE_FLAGS
from mambo_codegen.bundle.render import render
from mambo_codegen.settings.model import Settings
from mambo_sil.flight.controllers.controller_library import ffi, glue, with_default_prefix
from mambo_sil.results.shared_library import LibrarySource, load_shared_library
from tests.support.tools import toolchain

BUILDS: Final = (("gcc", "-O0"), ("gcc", "-O2"), ("gcc", "-O3"), ("gcc", "-Os"), ("clang", "-O2"))

_WHOLE: Final = 10
"""So many of the settings of a parity test, the corners among them, run in every build, with all cases."""


def share_of(index: int) -> tuple[tuple[tuple[str, str], ...], int]:
    """Return the builds in which the settings of a number run, and the percentage of the cases.

    After the first `_WHOLE` settings each runs in two builds, which take turns, with a fifth of the cases.
    """
    if index < _WHOLE:
        return BUILDS, 100
    return (BUILDS[index % len(BUILDS)], BUILDS[(index + 2) % len(BUILDS)]), 20


def libraries(settings: Settings, builds: Sequence[tuple[str, str]] = BUILDS) -> dict[str, Any]:
    """Build the C of a controller in each of `builds`; returns the libraries by compiler and optimisation.

    The self-test, which no step calls, is left out.
    """
    files = render(with_default_prefix(settings), with_digest=False)
    unit = {"nmpc.h": files["nmpc.h"], "all.c": "\n".join([files["nmpc.c"], *glue().values()])}
    source = LibrarySource("nmpc_all", unit, lambda: unit, COMPILE_FLAGS, ffi)
    return {
        f"{compiler} {level}": load_shared_library(source, toolchain(compiler, level))
        for compiler, level in builds
    }
