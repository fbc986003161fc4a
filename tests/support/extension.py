"""Build a bundle as a Python extension, so that tests reach its sub-blocks and the members of its structs.

The extension is the bundle's C with cffi's wrappers behind it, in one unit, since the sub-blocks are static.
In cffi's API mode the compiler checks the declarations below against that C.
"""

import hashlib
import importlib.machinery
import importlib.util
import sys
import sysconfig
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Final

import cffi

from mambo_codegen.bundle.flags import COMPILE_FLAGS
from mambo_codegen.bundle.render import render
from mambo_codegen.numbers.literals import C_TYPES, SUM_TYPES
from mambo_codegen.settings.model import Settings
from mambo_sil.flight.controllers.controller_library import with_default_prefix
from mambo_sil.results.build_folders import build_cached
from tests.support.bundles import place
from tests.support.tools import require_file, toolchain

_TYPES: Final = """
typedef REAL nmpc_real_t;
typedef SUM nmpc_sum_t;
typedef int... nmpc_status_t;
typedef struct { nmpc_real_t position_m[2], velocity_m_s[2], roll_rad, pitch_rad, yaw_rad; } nmpc_state_t;
typedef struct { nmpc_real_t position_m[2], velocity_m_s[2]; ...; } nmpc_target_t;
typedef struct { nmpc_real_t roll_rad, pitch_rad; } nmpc_command_t;
TRACKER_TYPE
"""
_FUNCTIONS: Final = """
void nmpc_init(nmpc_t *);
nmpc_status_t nmpc_reset(nmpc_t *, const nmpc_command_t *);
nmpc_status_t nmpc_step(nmpc_t *, const nmpc_state_t *, const nmpc_target_t *, nmpc_real_t, nmpc_command_t *);
const char *nmpc_version(void);
nmpc_real_t nmpc_slew_heading(nmpc_real_t, nmpc_real_t, nmpc_real_t);
int nmpc_self_test(nmpc_t *);
unsigned long nmpc_self_test_episode(nmpc_t *, int, unsigned long);
void sine_cosine(nmpc_real_t, nmpc_real_t *, nmpc_real_t *);
TRACKER_FUNCTIONS
"""
_ONE_NORM: Final = """
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
    TRACKER_MEMBERS
    nmpc_real_t command_rad[2], plan_rad[...];
    nmpc_sum_t gradient[...];
    ...;
} nmpc_t;
nmpc_status_t nmpc_set_weights(nmpc_t *, const nmpc_weights_t *);
void predictor_prepare(nmpc_t *, const nmpc_state_t *, const nmpc_target_t *, nmpc_real_t);
void predictor_apply_moves(const nmpc_prediction_t *, const nmpc_real_t *, int, nmpc_rollout_t *,
                                nmpc_rollout_t *);
void predictor_step(nmpc_rollout_t *);
nmpc_sum_t cost_evaluate(nmpc_t *);
"""
_QUADRATIC: Final = """
typedef struct { nmpc_real_t position_m[2], velocity_m_step[2], disturbance_m_step2[2]; } nmpc_observer_t;
typedef struct {
    nmpc_real_t tilt_m_step2[2], integral_m_step2[2], lagged_m_step2[2], command_m_step2[2], sine, cosine;
} nmpc_attitude_t;
typedef struct {
    nmpc_observer_t observer;
    nmpc_attitude_t attitude;
    TRACKER_MEMBERS
    nmpc_real_t command_rad[2];
    unsigned char steps_blind;
    ...;
} nmpc_t;
typedef struct {
    nmpc_real_t position_m[2], velocity_m_s[2], disturbance_m_s2[2];
    int is_valid;
} nmpc_estimate_t;
nmpc_status_t nmpc_report_command(nmpc_t *, const nmpc_command_t *);
int nmpc_is_saturated(const nmpc_t *);
nmpc_status_t nmpc_last_estimate(const nmpc_t *, nmpc_estimate_t *);
void observer_clear(nmpc_observer_t *);
void observer_start(nmpc_observer_t *, const nmpc_state_t *);
void observer_correct(nmpc_observer_t *, const nmpc_state_t *, int, const nmpc_real_t *);
void observer_predict(nmpc_observer_t *, const nmpc_real_t *);
nmpc_real_t observer_disturbance(const nmpc_observer_t *, int);
void attitude_set_command(nmpc_attitude_t *, nmpc_real_t, nmpc_real_t);
void attitude_reset(nmpc_attitude_t *, nmpc_real_t, nmpc_real_t);
void attitude_change_command(nmpc_attitude_t *, nmpc_real_t, nmpc_real_t);
nmpc_real_t attitude_roll(nmpc_real_t);
nmpc_real_t attitude_pitch(nmpc_real_t);
void attitude_measure(const nmpc_state_t *, nmpc_real_t *);
void attitude_advance(nmpc_attitude_t *);
void attitude_turn(nmpc_attitude_t *, nmpc_real_t, nmpc_real_t, int);
nmpc_real_t optimizer_minimize(int, const nmpc_real_t *, nmpc_real_t);
"""
_TRACKER: Final = {
    "TRACKER_TYPE": "typedef struct { nmpc_real_t velocity_m_s[2], acceleration_m_step2[2], "
    "jerk_m_step2_update[2]; ...; } nmpc_tracker_t;",
    "TRACKER_MEMBERS": "nmpc_tracker_t tracker; unsigned char has_target;",
    "TRACKER_FUNCTIONS": "void tracker_clear(nmpc_t *);\nvoid tracker_update(nmpc_t *, const nmpc_real_t *);",
}
"""What the declarations of a bundle with a tracker have besides."""


@cache
def build_extension(settings: Settings) -> ModuleType:
    """Generate the C of `settings`, build it with gcc and return a module with cffi's `ffi` and `lib`."""
    return load_extension(render(with_default_prefix(settings), with_digest=False), settings.code.scalar)


def load_extension(files: dict[str, str], scalar: str) -> ModuleType:
    """Return the extension of a bundle with prefix nmpc; builds it with gcc unless it is cached."""
    library = files["nmpc.c"]
    tracked = "/* ---- Tracker -" in library
    norm = "quadratic" if "nmpc_observer_t" in library else "1-norm"
    includes = '#include "nmpc.c"\n#include "nmpc_self_test.c"\n'
    declarations = _TYPES + {"1-norm": _ONE_NORM, "quadratic": _QUADRATIC}[norm] + _FUNCTIONS
    declarations = declarations.replace("REAL", C_TYPES[scalar]).replace("SUM", SUM_TYPES[scalar])
    for place_holder, text in _TRACKER.items():
        declarations = declarations.replace(place_holder, text if tracked else "")
    contents = (files, includes, declarations)
    name = f"_nmpc_{hashlib.sha256(repr(contents).encode()).hexdigest()[:32]}"
    if name not in sys.modules:

        def build(folder: Path) -> Path:
            place(files, folder)
            ffi = cffi.FFI()
            ffi.cdef(declarations)
            ffi.set_source(name, includes, compiler_verbose=0)
            ffi.emit_c_code(str(folder / "extension.c"))
            python = require_file(Path(sysconfig.get_paths()["include"], "Python.h"), "python3-dev").parent
            flags = [*COMPILE_FLAGS, "-O1", "-fPIC", "-shared", "-I.", f"-I{python}"]
            toolchain("gcc").run([*flags, "extension.c", "-o", "extension.so"], folder)
            return folder / "extension.so"

        path = build_cached(f"{name}{sysconfig.get_config_var('EXT_SUFFIX')}", build)
        loader = importlib.machinery.ExtensionFileLoader(name, str(path))
        spec = importlib.util.spec_from_file_location(name, path, loader=loader)
        assert spec is not None
        sys.modules[name] = importlib.util.module_from_spec(spec)
        loader.exec_module(sys.modules[name])
    return sys.modules[name]
