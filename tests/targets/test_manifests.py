"""PlatformIO and ESP-IDF: their manifests are read, and the library is compiled as they say."""

import json
import re
from pathlib import Path

import pytest

from mambo_codegen import boards
from mambo_codegen.bundle.render import render_target
from mambo_codegen.bundle.targets import TARGETS
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from tests.support.bundles import place, write_target
from tests.support.height_settings import height_settings
from tests.support.shell import shell
from tests.support.tools import require

ARDUINO_FLAGS = ("-std=gnu11", "-Wall", "-Wextra", "-Werror", "-ffunction-sections", "-fdata-sections")
"""A dialect that contracts, and warnings as errors."""

# What a component calls, with flags as ESP-IDF builds for the ESP32-C3.
PROJECT = """
cmake_minimum_required(VERSION 3.16)
project(main C)
function(idf_component_register)
    cmake_parse_arguments(PARSE_ARGV 0 its "" "" "SRCS;INCLUDE_DIRS")
    add_library(component STATIC ${its_SRCS})
    target_include_directories(component PUBLIC ${its_INCLUDE_DIRS})
    target_compile_options(component PRIVATE
        -march=rv32imc -mabi=ilp32 -ffreestanding -std=gnu17 -Og -Wall -Wextra -Werror)
    set(COMPONENT_LIB component PARENT_SCOPE)
endfunction()
add_subdirectory(component)
"""


def fused(folder: Path, *flags: str) -> int:
    """Compile the library for a Cortex-M4F with `flags`, and count its fused multiply-adds."""
    require("arm-none-eabi-gcc", "gcc-arm-none-eabi")
    core = boards.load("crazyflie").compiler.flags
    source = folder / "src" / "nmpc.c"
    shell("arm-none-eabi-gcc", *core, *ARDUINO_FLAGS, *flags, "-c", source, "-o", "nmpc.o", folder=folder)
    code = shell(require("arm-none-eabi-objdump", "binutils-arm-none-eabi"), "-d", "nmpc.o", folder=folder)
    return code.count("\tvfma") + code.count("\tvfms")


def test_flags_of_library_json_keep_the_bits(tmp_path: Path) -> None:
    """PlatformIO adds them to those of the board; without them a GNU dialect fuses products and sums."""
    folder = write_target("platformio", presets.preset("mambo"), tmp_path)
    listed = json.loads((folder / "library.json").read_text("utf-8"))
    assert (listed["name"], listed["headers"]) == ("nmpc", "nmpc.h")
    assert re.fullmatch(r"\d+\.\d+\.\d+(-dev\d+)?", listed["version"])
    assert (folder / "src" / listed["headers"]).is_file()
    assert fused(folder, *listed["build"]["flags"]) == 0
    assert fused(folder, "-O2") > 0


def test_the_component_is_compiled_by_its_cmakelists(tmp_path: Path) -> None:
    """With CMake and a RISC-V compiler, and `-ffp-contract=off` on its command line."""
    require("cmake", "cmake")
    require("riscv64-unknown-elf-gcc", "gcc-riscv64-unknown-elf")
    write_target("espidf", presets.preset("mambo"), tmp_path / "component")
    (tmp_path / "CMakeLists.txt").write_text(PROJECT, "utf-8")
    shell(
        *(
            "cmake",
            "-B",
            "build",
            "-DCMAKE_SYSTEM_NAME=Generic",
            "-DCMAKE_C_COMPILER=riscv64-unknown-elf-gcc",
        ),
        *("-DCMAKE_TRY_COMPILE_TARGET_TYPE=STATIC_LIBRARY", "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON"),
        folder=tmp_path,
    )
    shell("cmake", "--build", "build", folder=tmp_path)
    lines = json.loads((tmp_path / "build" / "compile_commands.json").read_text("utf-8"))
    assert {Path(line["file"]).name for line in lines} == {"nmpc.c", "nmpc_self_test.c"}
    assert all("-ffp-contract=off" in line["command"].split() for line in lines)
    assert (tmp_path / "build" / "component" / "libcomponent.a").is_file()


@pytest.mark.parametrize("scalar", ["float32", "fixed"])
@pytest.mark.parametrize("has_height", [False, True])
def test_the_example_of_a_page_compiles(scalar: str, has_height: bool, tmp_path: Path) -> None:
    """What a README shows is C that a compiler takes."""
    level = with_option(presets.preset("mambo"), "code.scalar", scalar)
    settings = height_settings(scalar) if has_height else level
    for name in ("platformio", "espidf"):
        files = render_target(settings, TARGETS[name], with_digest=False)
        example = files["README.md"].partition("```c\n")[2].partition("```")[0]
        folder = place(files | {"example.c": example}, tmp_path / name)
        shell(
            *(require("gcc", "gcc"), "-std=c99", "-Wall", "-Wextra", "-Werror"),
            *(f"-I./{TARGETS[name].source_folder}", "-c", "example.c"),
            folder=folder,
        )
