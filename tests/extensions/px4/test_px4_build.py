"""The module of `generate --for px4`, built as PX4 does for a Cortex-M7, with headers of our own."""

import re
from collections.abc import Mapping
from pathlib import Path

import pytest

from mambo_codegen.bundle.render import render_target
from mambo_codegen.bundle.targets import find_target
from mambo_codegen.errors import InvalidSettingsError
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from tests.extensions.px4.support import MODULE, px4_files, px4_settings
from tests.support.bundles import place
from tests.support.command import run
from tests.support.height_settings import height_settings
from tests.support.shell import shell
from tests.support.tools import require

TOPICS = (
    *("arming_check_reply", "arming_check_request", "hover_thrust_estimate", "manual_control_setpoint"),
    *("mc_nmpc_status", "parameter_update", "register_ext_component_reply", "register_ext_component_request"),
    *("trajectory_setpoint", "unregister_ext_component", "vehicle_attitude", "vehicle_attitude_setpoint"),
    *("vehicle_command", "vehicle_control_mode", "vehicle_land_detected", "vehicle_local_position"),
    "vehicle_status",
)
LIBC = Path(__file__).parents[2] / "support" / "crazyflie_libc"
CORE = ("-mcpu=cortex-m7", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv5-d16")
ARM = (*CORE, "-Os", "-ffreestanding", f"-I{LIBC}")
PX4_FLAGS = (
    *(
        "-fno-signed-zeros",
        "-fno-trapping-math",
        "-freciprocal-math",
        "-fno-math-errno",
        "-fmerge-all-constants",
    ),
    *("-fno-strict-aliasing", "-Wall", "-Wextra", "-Werror", "-Warray-bounds"),
    *("-Wcast-align", "-Wdisabled-optimization", "-Wdouble-promotion", "-Wfloat-equal", "-Winit-self"),
    *("-Wlogical-op", "-Wpointer-arith", "-Wshadow", "-Wuninitialized", "-Wunused-variable"),
    *("-Wformat-security", "-Wunknown-pragmas", "-Wunused-but-set-variable"),
    *("-Wno-missing-field-initializers", "-Wno-unused-parameter"),
)
"""Flags that PX4 gives to all modules, as its px4_add_common_flags.cmake and px4_impl_os.cmake list them."""
LANGUAGES = {
    ".c": (
        *("arm-none-eabi-gcc", "-std=gnu11", "-fno-common"),
        *("-Wnested-externs", "-Wstrict-prototypes", "-Wbad-function-cast"),
    ),
    ".cpp": ("arm-none-eabi-g++", "-std=gnu++17", "-fno-exceptions", "-fno-rtti", "-fno-threadsafe-statics"),
}
SUBJECTS = {
    "design": px4_settings(),
    "float64": height_settings("float64"),
    "fixed": height_settings("fixed"),
    "learnt": with_option(height_settings(), "observer.tilt_gain", "learnt"),
    "prefix": with_option(height_settings(), "code.prefix", "left"),
}
WHERE = {
    r"\bhrt_\w+": "drivers/drv_hrt.h",
    r"\bPX4_ISFINITE\b": "px4_platform_common/defines.h",
    r"\bPX4_(INFO|WARN|ERR)\b": "px4_platform_common/log.h",
    r"\bmath::": "mathlib/mathlib.h",
    r"\bmatrix::": "matrix/matrix/math.hpp",
    r"\bmavlink_log_\w+\(": "systemlib/mavlink_log.h",
    r"\b(fabsf|fminf|fmaxf|sqrtf|sinf|cosf|copysignf|NAN)\b": "math.h",
    r"\bstrncpy\b": "string.h",
    **{rf"\b{name}_s\b": f"uORB/topics/{name}.h" for name in TOPICS},
}
"""Names of PX4's and the C library's, and their headers."""
LARGEST_CONTROLLER_BYTES, LARGEST_MODULE_BYTES = 14336, 13696


def own_flags(name: str, source: str) -> list[str]:
    """Return the flags in the module's CMakeLists.txt for a source: those of all, and its own."""
    text = render_target(SUBJECTS[name], find_target("px4"), with_digest=False)[f"{MODULE}CMakeLists.txt"]
    of_one = re.findall(
        rf"^set_source_files_properties\({source} PROPERTIES COMPILE_OPTIONS (\S+)\)$", text, re.M
    )
    return [*re.findall(r"^\t\t(-\S+)$", text, re.MULTILINE), *of_one]


def compiled(name: str, folder: Path) -> dict[str, Path]:
    """Compile a subject as PX4 does; return the objects by the name of their source."""
    for compiler, *_ in LANGUAGES.values():
        require(compiler, "gcc-arm-none-eabi")
    place(px4_files(SUBJECTS[name]), folder)
    objects = {}
    for source in sorted(path for path in folder.iterdir() if path.suffix in LANGUAGES):
        objects[source.name] = folder / f"{source.name}.o"
        flags = own_flags(name, source.name)
        line = (*LANGUAGES[source.suffix], *ARM, *PX4_FLAGS, *flags, f"-I{folder}/px4")
        shell(*line, "-c", source, "-o", objects[source.name])
    return objects


@pytest.mark.sampled(2)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("name", SUBJECTS)
def test_px4_s_flags_build_it_without_a_word_and_its_own_keep_the_bits(name: str, tmp_path: Path) -> None:
    """Every warning is an error there; no product is fused with a sum, nor divided by a reciprocal."""
    objects = compiled(name, tmp_path)
    controller = f"{SUBJECTS[name].code.prefix}.c"
    dump = require("arm-none-eabi-objdump", "binutils-arm-none-eabi")
    assert not re.search(r"\tvfn?m[as]\.", shell(dump, "-d", objects[controller]))
    if name == "design":
        sizes = shell(require("arm-none-eabi-size", "binutils-arm-none-eabi"), *objects.values()).splitlines()
        text = {line.rpartition("/")[2][:-2]: int(line.split()[0]) for line in sizes[1:]}
        assert text[controller] < LARGEST_CONTROLLER_BYTES
        assert sum(size for path, size in text.items() if path.endswith(".cpp")) < LARGEST_MODULE_BYTES


def test_every_file_includes_what_it_uses() -> None:
    """By itself or by the module's headers: the desk's stand-in has all of PX4's in one, PX4 has not."""
    files = render_target(SUBJECTS["learnt"], find_target("px4"), with_digest=False)
    code = {path.removeprefix(MODULE): text for path, text in files.items() if path.endswith(("pp", ".c"))}
    for path in filter(lambda path: path.endswith("pp"), code):
        for name, header in WHERE.items():
            if re.search(name, re.sub(r"//.*|/\*(.|\n)*?\*/|#include.*", "", code[path])):
                assert header in included(code, path), f"{path} uses {name}"


def included(code: Mapping[str, str], path: str) -> set[str]:
    """Return what a file of the module includes, itself or by its own headers."""
    named = set(re.findall(r'#include [<"](\S+)[>"]', code[path]))
    return named.union(*(included(code, own) for own in named & code.keys()))


def test_cmakelists_names_every_source_and_parameter() -> None:
    """And PX4 takes names of at most 16 letters."""
    files = render_target(SUBJECTS["prefix"], find_target("px4"), with_digest=False)
    names = {path.removeprefix(MODULE) for path in files if path.startswith(MODULE)}
    listed = re.findall(r"^\t\t([\w.]+\.(?:c|cpp|hpp))$", files[f"{MODULE}CMakeLists.txt"], re.MULTILINE)
    assert {*listed} == {name for name in names if name.endswith((".c", ".cpp", ".hpp"))}
    defined = re.findall(r"^        (\w+):$", files[f"{MODULE}module.yaml"], re.MULTILINE)
    used = re.findall(r"params::(MC_NMPC_\w+)", files[f"{MODULE}mc_nmpc.hpp"])
    assert defined == used
    assert max(map(len, defined)) <= 16


def test_settings_that_do_not_fly_the_height_are_refused(tmp_path: Path) -> None:
    """PX4 wants the thrust with the attitude; there is no preset, since no two drones are alike."""
    message = r"--for px4 wants settings with \[height\]"
    with pytest.raises(InvalidSettingsError, match=message):
        render_target(presets.preset("mambo"), find_target("px4"))
    assert "--for px4 has no preset" in run("generate", "--for", "px4", "-o", str(tmp_path), code=2)[1]
