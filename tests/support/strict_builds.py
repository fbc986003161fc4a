"""Build a bundle with every warning fatal, and load it without Python's headers: quickly, for hundreds."""

import re
import subprocess
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import cffi

from mambo_nmpc.codegen.flags import COMPILE_FLAGS, WARNING_FLAGS
from mambo_nmpc.codegen.literals import C_TYPES, SUM_TYPES
from mambo_nmpc.codegen.render import render, with_prefix
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.controllers.library import batch_source
from tests.support.bundles import place
from tests.support.tools import require

_FUNCTIONS: Final = {
    "init": "void nmpc_init(nmpc_t *);",
    "reset": "int nmpc_reset(nmpc_t *, const nmpc_command_t *);",
    "set_weights": "int nmpc_set_weights(nmpc_t *, const nmpc_weights_t *);",
    "self_test": "int nmpc_self_test(nmpc_t *);",
    "batch_init": "void nmpc_batch_init(nmpc_t *, int);",
    "batch_step": "void nmpc_batch_step(nmpc_t *, int, const nmpc_state_t *, const nmpc_target_t *, "
    "const nmpc_real_t *, const nmpc_outcome_t *);",
}
_TYPES: Final = """
typedef REAL nmpc_real_t;
typedef SUM nmpc_sum_t;
typedef struct { nmpc_real_t position_m[2], velocity_m_s[2], roll_rad, pitch_rad, yaw_rad; } nmpc_state_t;
typedef struct { nmpc_real_t position_m[2], velocity_m_s[2]; } nmpc_target_t;
typedef struct { nmpc_real_t roll_rad, pitch_rad; } nmpc_command_t;
typedef struct { nmpc_real_t tracking, effort; } nmpc_weights_t;
typedef struct { nmpc_real_t memory[SCALARS]; } nmpc_t;
typedef struct {
    int *status; nmpc_command_t *command; nmpc_sum_t *cost, *gradient; nmpc_real_t *plan_rad;
    int *iterations, *converged;
} nmpc_outcome_t;
"""
_QUIET: Final = '#pragma GCC diagnostic ignored "-Wmissing-prototypes"\n'


def built(settings: Settings, folder: Path, compiler: str, *, amalgamate: bool) -> ModuleType:
    """Build the bundle of `settings`, and load it; returns what has `ffi` and `lib`.

    The names in `lib` have the prefix nmpc, whatever the prefix of the settings. A word of the compiler is a
    failed assertion.
    """
    prefix, scalar = settings.code.prefix, settings.code.scalar
    batch = _QUIET + batch_source()
    files = render(settings, amalgamate=amalgamate, with_digest=False) | {
        "batch.c": with_prefix(batch, prefix)
    }
    place(files, folder)
    suffixes = ["-Wunsuffixed-float-constants"] if (compiler, scalar) == ("gcc", "float32") else []
    flags = [*COMPILE_FLAGS, *WARNING_FLAGS, *suffixes, "-Werror", "-fPIC", "-shared"]
    sources = sorted(path for path in files if re.fullmatch(r"(src/)?[^/]*\.c", path))
    done = subprocess.run(
        [require(compiler, compiler), *flags, "-Iinclude", "-I.", *sources, "-o", "bundle.so"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return _loaded(folder / "bundle.so", prefix, scalar)


def _loaded(library: Path, prefix: str, scalar: str) -> ModuleType:
    real = C_TYPES[scalar]
    sizer = cffi.FFI()
    sizer.cdef(f"int {prefix}_batch_instance_bytes(void);")
    size = getattr(sizer.dlopen(str(library)), f"{prefix}_batch_instance_bytes")()
    ffi = cffi.FFI()
    scalars, rest = divmod(size, sizer.sizeof(real))
    assert rest == 0
    ffi.cdef(_TYPES.replace("REAL", real).replace("SUM", SUM_TYPES[scalar]).replace("SCALARS", str(scalars)))
    for name, declaration in _FUNCTIONS.items():
        ffi.cdef(declaration.replace(f"nmpc_{name}(", f"{prefix}_{name}("))
    opened = ffi.dlopen(str(library))
    extension: Any = ModuleType(f"{prefix}_bundle")
    extension.ffi, extension.lib = ffi, ModuleType(prefix)
    for name in _FUNCTIONS:
        setattr(extension.lib, f"nmpc_{name}", getattr(opened, f"{prefix}_{name}"))
    loaded: ModuleType = extension
    return loaded
