"""Write what is committed beside the generated bundles: kept results, interfaces; part of `make generated`.

The interfaces are what cffi makes of C declarations: to load them takes no parser of C, whose import and work
took a tenth of the time of `mambo-nmpc fly`.
"""

import contextlib
import io
import tempfile
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from typing import Any, Final

import cffi

from mambo_codegen import kept
from mambo_codegen.atomic import put
from mambo_codegen.bundle.digest import kept_digest, start_up_test
from mambo_codegen.errors import InvalidSettingsError
from mambo_codegen.methods import method_of
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_sil.flight.controllers import controller_library
from mambo_sil.flight.engine import engine_library

ROOT: Final = Path(__file__).parent.parent
SCALARS: Final = ("float32", "float64", "fixed")


def interface(name: str, declarations: str) -> str:
    """Return the Python code of a module whose `ffi` knows `declarations`."""
    ffi = cffi.FFI()
    ffi.cdef(declarations)
    ffi.set_source(name, None)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "interface.py"
        with contextlib.redirect_stdout(io.StringIO()):
            ffi.emit_python_code(str(path))
        return (
            f'{path.read_text("utf-8")}DECLARATIONS_SHA256 = "{sha256(declarations.encode()).hexdigest()}"\n'
        )


def preset_results(name: str, scalar: str) -> dict[str, Any]:
    """Return all kept results of a preset with a scalar type, computed; none if they do not go together."""
    with kept.record() as results:
        try:
            settings = with_option(presets.preset(name), "code.scalar", scalar)
            method = method_of(settings)
        except InvalidSettingsError:
            return {}
        kept_digest(method)
        start_up_test(settings)
    return results


def kept_text() -> str:
    """Return the text of the shipped results: those of every preset in every scalar type."""
    results = dict[str, Any]()
    for name in presets.names():
        for scalar in SCALARS:
            results |= preset_results(name, scalar)
    return kept.shipped_text(results)


def interfaces() -> Iterator[tuple[Path, str]]:
    """Yield path and text of the modules that hold interfaces."""
    flight = ROOT / "sil/mambo_sil/flight"
    for path, declarations in (
        ("controllers/controller_interface.py", controller_library.DECLARATIONS),
        ("engine/engine_interface.py", engine_library.declarations()),
    ):
        yield flight / path, interface(Path(path).stem, declarations)


def write(path: Path, text: str) -> None:
    """Write a file, and print its path."""
    put(path, text.encode())
    print(path.relative_to(ROOT))


if __name__ == "__main__":
    for module, code in interfaces():
        write(module, code)
    write(ROOT / "codegen/mambo_codegen" / kept.SHIPPED, kept_text())
