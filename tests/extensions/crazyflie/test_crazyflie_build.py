"""The app for the Crazyflie, as its firmware builds it."""

import itertools
import re
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.bundle.render import render_target
from mambo_codegen.bundle.targets import find_target
from mambo_codegen.errors import InvalidSettingsError
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import to_toml, with_option
from tests.extensions.crazyflie.support.crazyflie import (
    FIRMWARE_FLAGS,
    HOST,
    LIBRARY,
    STAND_INS,
    Built,
    Crazyflie,
    app_sources,
    compile_host,
    link,
    send,
)
from tests.support.bundles import write_target
from tests.support.command import run
from tests.support.height_settings import height_settings
from tests.support.one_norm import ONE_NORM
from tests.support.shell import shell
from tests.support.tools import require

SETTINGS = presets.preset("crazyflie")
LIBC = Path(__file__).parents[2] / "support" / "crazyflie_libc"
"""Headers of a C library, which a compiler for Arm may lack."""
ARM = ("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16", "-fconserve-stack")
LARGEST_STACK_BYTES = 500


SUBJECTS = {
    "crazyflie": SETTINGS,
    "float64": with_option(SETTINGS, "code.scalar", "float64"),
    "fixed": with_option(presets.preset("mambo"), "code.scalar", "fixed"),
    "1-norm": ONE_NORM,
    "height": height_settings(),
    "limits": with_option(SETTINGS, "limits.speed_m_s", 2.0),
    "prefix": with_option(presets.preset("mambo-1norm"), "code.prefix", "left"),
}


@pytest.mark.sampled(2)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("name", SUBJECTS)
def test_the_firmware_s_flags_build_it_without_a_word(name: str, tmp_path: Path) -> None:
    """Every warning of the firmware is an error there."""
    compiler = require("arm-none-eabi-gcc", "gcc-arm-none-eabi")
    folder = write_target("crazyflie", SUBJECTS[name], tmp_path)
    for source in sorted((folder / "src").glob("*.c")):
        shell(
            *(compiler, *ARM, *FIRMWARE_FLAGS, "-ffp-contract=off", "-ffreestanding"),
            *(f"-I{LIBC}", f"-I{STAND_INS}", "-c", source, "-o", folder / "object.o"),
        )


@pytest.mark.parametrize("name", ["crazyflie", "prefix"])
def test_names_that_are_linked_have_the_prefix(name: str, tmp_path: Path) -> None:
    """All files are linked into one firmware, whose names they must not meet."""
    folder, prefix = write_target("crazyflie", SUBJECTS[name], tmp_path), SUBJECTS[name].code.prefix
    sources = sorted((folder / "src").glob("*_app*.c"))
    objects = [compile_host(source, folder / f"{source.stem}.o") for source in sources]
    listed = shell(require("nm", "binutils"), "--defined-only", "-g", "-j", *objects).split()
    names = {one for one in listed if not one.endswith(":")}
    assert f"{prefix}_app_step" in names
    tables = {"host_logged", "host_parameters"}
    entries = {one for one in names if one.startswith("controllerOutOfTree")}
    assert len(entries) == 3
    assert {one for one in names - tables - entries if not one.startswith(f"{prefix}_app_")} == set()


@pytest.mark.parametrize("name", SUBJECTS)
def test_every_log_and_parameter_has_its_documentation(name: str) -> None:
    """One line in front of it, from which the firmware builds its pages; the group has one too."""
    files = render_target(SUBJECTS[name], find_target("crazyflie"), with_digest=False)
    kinds = {"LOG": 0, "PARAM": 0}
    for text in (text for path, text in files.items() if path.endswith(".c")):
        for before, line in itertools.pairwise(text.splitlines()):
            if added := re.match(r"(LOG|PARAM)_(ADD|GROUP_START)\(", line):
                opening = "/** " if added[2] == "GROUP_START" else "/** @brief "
                assert before.startswith(opening), line
                assert before.endswith(". */"), line
                kinds[added[1]] += 1
    assert kinds["LOG"] > 25
    assert kinds["PARAM"] > 3


@pytest.mark.long
def test_the_deepest_call_is_within_the_stack(tmp_path: Path) -> None:
    """By the compiler's figures, along the calls that it saw: a tick without the PID controller's."""
    compiler = require("arm-none-eabi-gcc", "gcc-arm-none-eabi")
    folder = write_target("crazyflie", SETTINGS, tmp_path)
    frames: dict[str, int] = {}
    calls: dict[str, set[str]] = {}
    for source in (folder / "src" / "nmpc.c", *app_sources(folder)):
        shell(
            *(compiler, *ARM, *FIRMWARE_FLAGS, "-ffp-contract=off", "-ffreestanding", "-fcallgraph-info=su"),
            *(f"-I{LIBC}", f"-I{STAND_INS}", "-c", source, "-o", folder / f"{source.stem}.o"),
        )
        graph = (folder / f"{source.stem}.ci").read_text("utf-8")
        for title, label in re.findall(r'node: { title: "([^"]*)" label: "([^"]*)"', graph):
            if size := re.search(r"(\d+) bytes \(static\)", label):
                frames[short(title)] = int(size[1])
        for caller, called in re.findall(r'edge: { sourcename: "([^"]*)" targetname: "([^"]*)"', graph):
            calls.setdefault(short(caller), set()).add(short(called))

    def deepest(function: str) -> int:
        return frames.get(function, 0) + max(
            (deepest(called) for called in calls.get(function, ())), default=0
        )

    assert "nmpc_step" in frames
    assert 0 < deepest("controllerOutOfTree") <= LARGEST_STACK_BYTES


def short(title: str) -> str:
    """Return the name of a function without the file that it is static in."""
    return title.rpartition(":")[2]


def test_kbuild_lists_every_source_with_the_flag(built: Built) -> None:
    """A source that is not listed is not linked; without the flag the Cortex-M4F's bits differ."""
    text = (built.folder / "src" / "Kbuild").read_text("utf-8")
    sources = {path.stem for path in (built.folder / "src").glob("nmpc*.c")}
    assert {*LIBRARY, "nmpc_app", "nmpc_app_step"} <= sources
    assert {*re.findall(r"^obj-y \+= (\w+)\.o$", text, re.MULTILINE)} == sources
    assert {*re.findall(r"^CFLAGS_(\w+)\.o \+= -ffp-contract=off$", text, re.MULTILINE)} == sources
    assert "CONFIG_CONTROLLER_OOT=y\n" in (built.folder / "app-config").read_text("utf-8")


def test_an_update_period_that_the_firmware_cannot_keep_is_refused() -> None:
    """Its loop runs at 1000 Hz."""
    settings = with_option(SETTINGS, "horizon.update_period_s", 0.0125)
    with pytest.raises(
        InvalidSettingsError, match=r"update_period_s = 0\.0125 must be a whole multiple of 0\.001"
    ):
        render_target(settings, find_target("crazyflie"))


USER_C = """#include "nmpc_app.h"

void nmpc_app_hook(const nmpc_state_t *state, nmpc_target_t *wanted)
{
    wanted->position_m[0] = state->position_m[0] + 0.25f;
}
"""


@pytest.mark.long
def test_a_file_of_the_user_s_own_stays_and_is_called(tmp_path: Path) -> None:
    """`generate` neither writes nor removes src/user.c; Kbuild lists it, and its hook changes the target."""
    folder = tmp_path / "app"
    generate = ("generate", "crazyflie", "--for", "crazyflie", "-o", str(folder))
    run(*generate)
    assert "user.o" not in listed_by_kbuild(folder)
    user = folder / "src" / "user.c"
    user.write_text(USER_C, "utf-8")
    assert "user.o" in listed_by_kbuild(folder)
    settings = with_option(SETTINGS, "limits.tilt_rad", 0.4)
    (tmp_path / "other.toml").write_text(to_toml(settings), "utf-8")
    run("generate", str(tmp_path / "other.toml"), *generate[2:])
    run("generate", str(tmp_path / "other.toml"), *generate[2:], "--check")
    assert user.read_text("utf-8") == USER_C
    sources = [*(folder / "src").glob("*.c"), HOST]
    objects = [compile_host(source, folder / f"{source.stem}.o", "-ffp-contract=off") for source in sources]
    app = Crazyflie(link(objects, folder / "app.so"))
    app.modes("modeAbs")
    send(app, 3.0)
    app.update(np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    assert app.logged("targetX") == 0.75


def listed_by_kbuild(folder: Path) -> list[str]:
    """Return the objects that src/Kbuild lists, as make reads it."""
    text = f"OOT := {folder}\ninclude {folder}/src/Kbuild\n$(info $(obj-y))\nall:\n"
    makefile = folder.parent / "kbuild.mk"
    makefile.write_text(text, "utf-8")
    return shell(require("make", "make"), "-s", "-f", makefile).split()
