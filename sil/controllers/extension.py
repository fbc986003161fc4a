"""Build a rendered bundle as a Python extension, cache it, and load it.

In cffi's API mode the C compiler checks the declarations below against the bundle's headers. setuptools would
compile with Python's flags instead of the bundle's, so compiler and linker are called here.
"""

import hashlib
import importlib.machinery
import importlib.util
import re
import shlex
import sys
import sysconfig
from importlib import resources
from pathlib import Path
from types import ModuleType
from typing import Final

import cffi

from mambo_nmpc.codegen.errors import BuildError
from mambo_nmpc.codegen.flags import COMPILE_FLAGS
from mambo_nmpc.codegen.literals import C_TYPES, SUM_TYPES
from mambo_nmpc.codegen.toolchain import Toolchain
from mambo_nmpc.sil.errors import CacheError
from mambo_nmpc.sil.files.cache import build_cached

_DECLARATIONS: Final = """
typedef REAL nmpc_real_t;
typedef SUM nmpc_sum_t;
typedef int... nmpc_status_t;
typedef struct { nmpc_real_t position_m[2], velocity_m_s[2], roll_rad, pitch_rad, yaw_rad; } nmpc_state_t;
typedef struct { nmpc_real_t position_m[2], velocity_m_s[2]; } nmpc_target_t;
typedef struct { nmpc_real_t roll_rad, pitch_rad; } nmpc_command_t;
typedef struct { nmpc_real_t tracking, effort; } nmpc_weights_t;
typedef struct { nmpc_real_t error_m, displacement_m_step, acceleration_m_step2; ...; } nmpc_rollout_t;
typedef struct {
    nmpc_real_t gain_x_m_step2_rad[2], gain_y_m_step2_rad[2];
    nmpc_rollout_t x, y;
    ...;
} nmpc_prediction_t;
typedef struct {
    nmpc_weights_t weights;
    nmpc_prediction_t prediction;
    nmpc_real_t command_rad[2], plan_rad[...];
    nmpc_sum_t gradient[...];
    ...;
} nmpc_t;
typedef struct {
    int *status;
    nmpc_command_t *command;
    nmpc_sum_t *cost, *gradient;
    nmpc_real_t *plan_rad;
    int *iterations, *converged;
} nmpc_outcome_t;

void nmpc_init(nmpc_t *);
nmpc_status_t nmpc_reset(nmpc_t *, const nmpc_command_t *);
nmpc_status_t nmpc_set_weights(nmpc_t *, const nmpc_weights_t *);
nmpc_status_t nmpc_step(nmpc_t *, const nmpc_state_t *, const nmpc_target_t *, nmpc_real_t, nmpc_command_t *);
const char *nmpc_version(void);
int nmpc_self_test(nmpc_t *);
unsigned long nmpc_self_test_episode(nmpc_t *, int, unsigned long);

void nmpc_sine_cosine(nmpc_real_t, nmpc_real_t *, nmpc_real_t *);
void nmpc_predictor_prepare(const nmpc_state_t *, const nmpc_target_t *, nmpc_real_t, nmpc_prediction_t *);
void nmpc_predictor_apply_moves(const nmpc_prediction_t *, const nmpc_real_t *, int, nmpc_rollout_t *,
                                nmpc_rollout_t *);
void nmpc_predictor_step(nmpc_rollout_t *);
nmpc_sum_t nmpc_cost_evaluate(nmpc_t *);

void nmpc_batch_init(nmpc_t *, int);
void nmpc_batch_step(nmpc_t *, int, const nmpc_state_t *, const nmpc_target_t *, const nmpc_real_t *,
                     const nmpc_outcome_t *);
unsigned long nmpc_batch_instance_bytes(void);
long long nmpc_batch_engine_step(void *, const double *, const double *, double, double *);
"""
_INCLUDES: Final = "".join(
    f'#include "nmpc_{name}.h"\n' for name in ("cost", "math", "predictor", "self_test")
)


def batch_source() -> str:
    """Return the C that loops over n controllers, to compile with a bundle."""
    return resources.files("mambo_nmpc.sil.controllers").joinpath("batch.c").read_text("utf-8")


def load_extension(files: dict[str, str], scalar: str, toolchain: Toolchain) -> ModuleType:
    """Return the extension of a bundle with prefix nmpc: a module with cffi's `ffi` and `lib`.

    Builds it with `toolchain` unless it is cached; raises BuildError, CacheError.
    """
    glue = _INCLUDES + batch_source()
    suffix = sysconfig.get_config_var("EXT_SUFFIX")
    contents = (
        files,
        glue,
        _DECLARATIONS,
        COMPILE_FLAGS,
        toolchain,
        toolchain.identity(),
        suffix,
        cffi.__version__,
    )
    name = f"_nmpc_{hashlib.sha256(repr(contents).encode()).hexdigest()[:32]}"
    if name not in sys.modules:

        def build(folder: Path) -> Path:
            for path, text in files.items():
                (folder / path).parent.mkdir(parents=True, exist_ok=True)
                (folder / path).write_text(text, "utf-8")
            ffi = cffi.FFI()
            ffi.cdef(_DECLARATIONS.replace("REAL", C_TYPES[scalar]).replace("SUM", SUM_TYPES[scalar]))
            ffi.set_source(name, glue, compiler_verbose=0)
            ffi.emit_c_code(str(folder / "extension.c"))
            return _compile(
                sorted(path for path in files if re.fullmatch(r"src/.*\.c", path)), toolchain, folder
            )

        sys.modules[name] = _load(name, build_cached(f"{name}{suffix}", build))
    return sys.modules[name]


def _compile(sources: list[str], toolchain: Toolchain, folder: Path) -> Path:
    """Compile the bundle's sources with its own flags, and the glue with Python's headers."""
    headers = Path(sysconfig.get_paths()["include"])
    if not (headers / "Python.h").is_file():
        raise BuildError(f"no Python.h in {headers}; install Python's headers (Debian: python3-dev)")
    objects = [Path(source).with_suffix(".o").name for source in sources]
    flags = [*COMPILE_FLAGS, *([toolchain.optimisation] if toolchain.optimisation else [])]
    toolchain.run([*flags, "-fPIC", "-Iinclude", "-c", *sources], folder)
    glue_flags = ["-O2", "-ffp-contract=off", "-fPIC", "-Iinclude", "-Isrc", f"-I{headers}"]
    link = ["-shared", *(["-undefined", "dynamic_lookup"] if sys.platform == "darwin" else [])]
    toolchain.run([*glue_flags, *link, "extension.c", *objects, "-o", "extension.so"], folder)
    built = folder / "extension.so"
    if not built.is_file():
        raise BuildError(f"{shlex.join(toolchain.command)} wrote no output; set CC to a C compiler")
    return built


def _load(name: str, path: Path) -> ModuleType:
    """Load the extension at `path`; raises CacheError if that fails."""
    loader = importlib.machinery.ExtensionFileLoader(name, str(path))
    spec = importlib.util.spec_from_file_location(name, path, loader=loader)
    assert spec is not None  # a loader was given
    try:
        module = importlib.util.module_from_spec(spec)
        loader.exec_module(module)
    except ImportError as error:
        reason = str(error).removeprefix(f"{path}: ")
        raise CacheError(
            f"cannot load {path}: {reason}; if its folder is mounted noexec, set XDG_CACHE_HOME elsewhere"
        ) from error
    return module
