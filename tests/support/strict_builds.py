"""Build a bundle with every warning fatal, under its own prefix, and load it."""

import re
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Final

import cffi

from mambo_codegen.bundle.flags import COMPILE_FLAGS, WARNING_FLAGS
from mambo_codegen.bundle.render import render, with_prefix
from mambo_codegen.methods import method_of
from mambo_codegen.settings.model import Settings
from mambo_sil.flight.controllers.controller_library import DECLARATIONS, glue
from tests.support.bundles import place
from tests.support.tools import require

_DECLARATIONS: Final = f"{DECLARATIONS} int nmpc_self_test(void *);"
_QUIET: Final = '#pragma GCC diagnostic ignored "-Wmissing-prototypes"\n'


def built(settings: Settings, folder: Path, compiler: str) -> SimpleNamespace:
    """Build the bundle of `settings`, and load it; returns the functions of the library and of the self-test.

    Their names have the prefix nmpc, whatever the prefix of the settings. A word of the compiler is a failed
    assertion.
    """
    prefix, scalar = settings.code.prefix, settings.code.scalar
    files = render(settings, with_digest=False)
    files |= {name: with_prefix(_QUIET + text, prefix) for name, text in glue().items()}
    place(files, folder)
    suffixes = ["-Wunsuffixed-float-constants"] if (compiler, scalar) == ("gcc", "float32") else []
    flags = [*COMPILE_FLAGS, *WARNING_FLAGS, *suffixes, "-Werror", "-fPIC", "-shared"]
    sources = sorted(path for path in files if re.fullmatch(r"[^/]*\.c", path))
    done = subprocess.run(
        [require(compiler, compiler), *flags, "-I.", *sources, "-o", "bundle.so"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    ffi = cffi.FFI()
    ffi.cdef(with_prefix(_DECLARATIONS, prefix))
    opened = ffi.dlopen(str(folder / "bundle.so"))
    if settings.controller.method == "quadratic":
        absent = {"_host_set_weights"}
    else:
        absent = {"_host_report_command", "_host_last_disturbance"}
    if method_of(settings).limiting is None:
        absent |= {"_host_set_limits"}
    if settings.guard is None:
        absent |= {"_host_set_position_measured"}
    if settings.height is None:
        absent |= {"_host_report_thrust", "_host_last_thrust"}
    names = [name for name in re.findall(r"\bnmpc(_\w+)\(", _DECLARATIONS) if name not in absent]
    return SimpleNamespace(**{f"nmpc{name}": getattr(opened, f"{prefix}{name}") for name in names})
