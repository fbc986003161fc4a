"""Build engines from changed C, with a function that tabulates the elementary functions."""

from collections.abc import Mapping
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, Final

import cffi
import numpy as np

from mambo_nmpc.sil.engine import library
from mambo_nmpc.sil.plant.arrays import FloatArray
from tests.support.tools import toolchain

_TABLE: Final = """\
#include "elementary.h"

void tabulate(const double *x, double *y, int n)
{
    int i;

    for (i = 0; i < n; i++) {
        sine_cosine(x[i], &y[4 * i], &y[4 * i + 1]);
        y[4 * i + 2] = arc_tangent(x[i]);
        y[4 * i + 3] = arc_sine(x[i]);
    }
}
"""
_INTERFACE: Final = cffi.FFI()
_INTERFACE.cdef("void tabulate(const double *x, double *y, int n);")

_DRAWN: Final = np.concatenate(
    [
        np.random.default_rng(0).uniform(-10.0, 10.0, 20_000),
        np.random.default_rng(1).uniform(-2e6, 2e6, 5_000),
    ]
)
_CORNERS: Final = np.concatenate(
    [
        np.arange(-40, 41) * (np.pi / 4.0),
        np.array([2.0**20 - 1.0, 2.0**20, 2.0**20 + 1.0]) * (np.pi / 2.0),
        [0.0, -0.0, 1e-310, -1e-310, np.inf, -np.inf, np.nan, 1e300, 0.1875, 0.375, 0.625, 0.875, 1.0],
    ]
)
NUMBERS: Final[FloatArray] = np.concatenate([_DRAWN, _DRAWN / 10.0, _CORNERS, -_CORNERS])
"""Arguments of the elementary functions."""


def build(files: Mapping[str, str], folder: Path, *flags: str) -> Path:
    """Compile the engine in `files` with gcc in a new folder, since a library is loaded once.

    Raises BuildError.
    """
    place = Path(mkdtemp(dir=folder))
    for name, text in (dict(files) | {"table.c": _TABLE}).items():
        (place / name).write_text(text, "utf-8")
    sources = [*library.SOURCES, "table.c"]
    toolchain("gcc").run([*library.FLAGS, *flags, *sources, "-o", "engine.so", "-lm"], place)
    return place / "engine.so"


def tabulate(path: Path) -> FloatArray:
    """Return sine, cosine, arc tangent and arc sine (n, 4) of `NUMBERS` in the engine at `path`."""
    found = np.empty((len(NUMBERS), 4))
    engine: Any = _INTERFACE.dlopen(str(path))
    engine.tabulate(*(library.pointer("double *", array) for array in (NUMBERS, found)), len(NUMBERS))
    return found
