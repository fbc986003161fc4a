"""Whole steps of the generated C have the bits of the reference, with both methods."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import pytest

from mambo_codegen.bundle.flags import COMPILE_FLAGS
from mambo_codegen.bundle.render import render
from mambo_codegen.methods import method_of
from mambo_codegen.methods.quadratic.controller import QuadraticController
from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.settings.model import Settings
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.controller_library import build_library, ffi, glue, with_default_prefix
from mambo_sil.results.shared_library import LibrarySource, load_shared_library
from tests.support.cases import CORNER_HORIZONS, SCALARS, settings_case
from tests.support.height import HEIGHT_CORNERS, height_case
from tests.support.parity import differences, inputs_of_steps, run
from tests.support.quadratic import CORNER_SETTINGS, quadratic_case
from tests.support.tools import toolchain

BUILDS: Final = (("gcc", "-O0"), ("gcc", "-O2"), ("gcc", "-O3"), ("gcc", "-Os"), ("clang", "-O2"))

_WHOLE: Final = 10
"""So many of the settings of a parity test, the corners among them, run with all cases in one scalar type."""
METHODS = {"one_norm": settings_case, "quadratic": quadratic_case, "height": height_case}
SIZES = {"one_norm": (250, 4), "quadratic": (100, 60), "height": (100, 60)}
"""Controllers and steps of a run; a flight with outages is longer than a search."""
FEW_SETTINGS = (
    [
        pytest.param("one_norm", index, scalar, marks=[] if index in {2, 5} else pytest.mark.long)
        for index in range(len(CORNER_HORIZONS) + 1)
        for scalar in SCALARS
    ]
    + [
        pytest.param("quadratic", index, scalar, marks=[] if index in {1, 2} else pytest.mark.long)
        for index in range(len(CORNER_SETTINGS) + 2)
        for scalar in ("float32", "float64")
    ]
    + [
        pytest.param("height", index, scalar, marks=[] if index == 1 else pytest.mark.long)
        for index in range(len(HEIGHT_CORNERS) + 3)
        for scalar in (SCALARS if index < len(HEIGHT_CORNERS) else ("float32", "float64"))
    ]
)
SCALARS_OF = {"one_norm": SCALARS, "quadratic": ("float32", "float64"), "height": ("float32", "float64")}
MANY_SETTINGS = [
    (method, index, scalar)
    for method, scalars in SCALARS_OF.items()
    for index in range(10 if method == "height" else 30)
    for scalar in scalars
]


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize(("method", "index", "scalar"), FEW_SETTINGS)
def test_steps_equal_the_reference(method: str, index: int, scalar: str) -> None:
    """Over random and corner cases, flights, outages, setters and bad values no bit differs."""
    settings = METHODS[method](index, scalar)
    n, steps = SIZES[method]
    inputs = inputs_of_steps(settings, n, steps, seed=index)
    expected = run(method_of(settings).reference_controller(n), inputs, index)
    library = build_library(settings, toolchain("gcc"))
    assert differences(expected, run(CompiledController(settings, n, library), inputs, index)) == {}


def test_the_inputs_reach_what_is_to_be_compared() -> None:
    """Every status, outages shorter and longer than admitted, commands at the limit and within."""
    settings = quadratic_case(1, "float64")
    found = run(QuadraticController(Quadratic(settings), 200), inputs_of_steps(settings, 200, 60, 1), 1)
    most = Quadratic(settings).observer.outage_steps + 1
    steps_blind = np.array([step.steps_blind for step in found.steps])
    statuses = np.array([*found.setters, *(step.status for step in found.steps)])
    assert set(np.unique(statuses)) == {0, 2, 3, 4, 6, 7, 8}
    assert (steps_blind == most).any()
    assert ((steps_blind[:-1] > 1) & (steps_blind[:-1] < most) & (steps_blind[1:] == 0)).any()
    assert ((steps_blind[:-1] == most) & (steps_blind[1:] == 0)).any()
    share = np.mean([step.saturated for step in found.steps])
    assert 0.05 < share < 0.98


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


@pytest.mark.sampled(16)
@pytest.mark.long
@pytest.mark.parametrize(("method", "index", "scalar"), MANY_SETTINGS)
def test_steps_by_the_thousand_equal_the_reference_in_every_build(
    method: str, index: int, scalar: str
) -> None:
    """In 100,000 steps with each of 10 settings no bit differs, in 20,000 with them in other scalar types.

    Nor in 20,000 with each of 20 others. At every optimisation, with gcc and clang, which take turns.
    """
    settings, scalars = METHODS[method](index, scalar), SCALARS_OF[method]
    builds, percentage = share_of(index, scalars.index(scalar), len(scalars))
    n, steps, seeds = (5000, 4, 5 * percentage // 100) if method == "one_norm" else (5 * percentage, 200, 1)
    built = libraries(settings, builds)
    for seed in range(index, index + seeds):
        inputs = inputs_of_steps(settings, n, steps, seed)
        expected = run(method_of(settings).reference_controller(n), inputs, seed)
        for build, library in built.items():
            found = run(CompiledController(settings, n, library), inputs, seed)
            assert differences(expected, found) == {}, f"{build} for {settings!r}"
