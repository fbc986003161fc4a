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
"""So many of the settings of a parity test, the corners among them, run with all cases in one scalar type."""


def share_of(index: int, scalar: int, scalars: int) -> tuple[tuple[tuple[str, str], ...], int]:
    """Return the builds in which settings run and the percentage of the cases, by the number of their scalar.

    Each runs in two builds, which take turns: settings in three scalar types have all builds, and so have
    five settings of one scalar type. Each of the first `_WHOLE` has all cases in one of its scalar types; all
    others have a fifth.
    """
    turn = index + scalar
    builds = (BUILDS[turn % len(BUILDS)], BUILDS[(turn + 2) % len(BUILDS)])
    return builds, 100 if index < _WHOLE and turn % scalars == 0 else 20


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
