"""Libraries for Arduino, PlatformIO and ESP-IDF: compiled as their builders do, an example flown here."""

import json
import re
from pathlib import Path

import pytest

from mambo_codegen import boards
from mambo_codegen.bundle.render import render_target
from mambo_codegen.bundle.targets import find_target
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from tests.support.bundles import place, write_target
from tests.support.height_settings import height_settings
from tests.support.shell import shell
from tests.support.tools import require, require_file

STUBS = Path(__file__).parent / "arduino_stubs"
CORE = Path("/usr/share/arduino/hardware/arduino/avr")
MEGA = (
    *(
        "-mmcu=atmega2560",
        "-DF_CPU=16000000L",
        "-DARDUINO=10819",
        "-DARDUINO_AVR_MEGA2560",
        "-DARDUINO_ARCH_AVR",
    ),
    *("-Os", "-ffunction-sections", "-fdata-sections"),
)
"""Flags of the core's platform.txt and boards.txt; -flto is left out, which hides no warning."""
STRICT = ("-Wall", "-Wextra", "-Werror")
SUBJECTS = {
    "mambo": presets.preset("mambo"),
    "fixed": with_option(presets.preset("mambo"), "code.scalar", "fixed"),
    "1-norm": presets.preset("mambo-1norm"),
    "height": height_settings(),
    "fixed height": with_option(height_settings("fixed"), "limits.speed_m_s", 2.0),
}


def library(folder: Path) -> list[Path]:
    """Return the sources that the builder compiles: all in src."""
    return sorted((folder / "src").glob("*.c"))


def sketch(folder: Path) -> Path:
    """Return the example as the builder passes it to the compiler: with the core's header."""
    text = (folder / "examples" / "Hover" / "Hover.ino").read_text("utf-8")
    source = folder / "Hover.cpp"
    source.write_text(f"#include <Arduino.h>\n{text}", "utf-8")
    return source


@pytest.mark.first_is_quick
@pytest.mark.parametrize("name", SUBJECTS)
def test_the_example_reaches_its_target_on_this_machine(name: str, tmp_path: Path) -> None:
    """The self-test passes, no input is refused, and the drone stands within a centimetre of its target."""
    folder = write_target("arduino", SUBJECTS[name], tmp_path)
    for source in library(folder):
        shell(require("gcc", "gcc"), "-std=gnu11", *STRICT, "-c", source, "-o", folder / f"{source.stem}.o")
    flags = ("-std=gnu++11", *STRICT, f"-I{STUBS}", f"-I{folder}/src")
    sources = (sketch(folder), STUBS / "main.cpp", *sorted(folder.glob("*.o")))
    shell(require("g++", "g++"), *flags, *sources, "-o", folder / "hover")
    version, self_test, *lines = shell(folder / "hover").splitlines()
    assert version.startswith("mambo-nmpc ")
    assert self_test == "self-test: all steps equal the reference"
    assert len(lines) == 20
    *position, refused = (float(number) for number in re.findall(r"-?[\d.]+", lines[-1]))
    target = (1.0, 0.0, 1.0) if SUBJECTS[name].height else (1.0, 0.0)
    assert position == pytest.approx(target, abs=0.01)
    assert refused == 0


@pytest.mark.sampled(2)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("name", SUBJECTS)
def test_the_core_of_debian_builds_and_links_the_example_for_the_mega(name: str, tmp_path: Path) -> None:
    """Library and sketch without a warning, with the core's own flags, into the memory of an ATmega2560."""
    core = require_file(CORE / "cores/arduino/Arduino.h", "arduino-core-avr").parent
    c, cxx = require("avr-gcc", "gcc-avr"), require("avr-g++", "gcc-avr")
    folder = write_target("arduino", SUBJECTS[name], tmp_path)
    headers = (f"-I{core}", f"-I{CORE / 'variants/mega'}", f"-I{folder / 'src'}")
    modern = ("-std=gnu++11", "-fno-exceptions", "-fno-threadsafe-statics")
    for source in library(folder):
        shell(c, *MEGA, "-std=gnu11", *STRICT, "-c", source, "-o", folder / f"{source.stem}.o")
    shell(cxx, *MEGA, *modern, *STRICT, *headers, "-c", sketch(folder), "-o", folder / "sketch.o")
    needed = ("main", "HardwareSerial", "HardwareSerial0", "Print", "Stream", "abi", "new")
    for stem in needed:
        shell(cxx, *MEGA, *modern, "-w", *headers, "-c", core / f"{stem}.cpp", "-o", folder / f"{stem}.o")
    for stem in ("wiring", "wiring_digital", "hooks"):
        shell(c, *MEGA, "-std=gnu11", "-w", *headers, "-c", core / f"{stem}.c", "-o", folder / f"{stem}.o")
    elf = folder / "hover.elf"
    shell(c, "-mmcu=atmega2560", "-Os", "-Wl,--gc-sections", *folder.glob("*.o"), "-lm", "-o", elf)
    sizes = shell(require("avr-size", "binutils-avr"), elf).splitlines()[1].split()
    text, data, bss = (int(size) for size in sizes[:3])
    assert text + data < 248 * 1024
    assert data + bss < 8 * 1024


def test_without_a_flag_the_bits_are_kept(tmp_path: Path) -> None:
    """An Arduino core for a Cortex-M4F has a GNU dialect and no place for a library's flags."""
    compiler = require("arm-none-eabi-gcc", "gcc-arm-none-eabi")
    folder = write_target("arduino", SUBJECTS["mambo"], tmp_path)
    flags = (*boards.load("crazyflie").compiler.flags, "-std=gnu11", "-Os", *STRICT, "-ffreestanding")
    shell(compiler, *flags, "-c", folder / "src/nmpc.c", "-o", folder / "nmpc.o")
    assert "\tvfm" not in shell(
        require("arm-none-eabi-objdump", "binutils-arm-none-eabi"), "-d", folder / "nmpc.o"
    )


@pytest.mark.parametrize("name", SUBJECTS)
def test_keywords_are_the_names_of_the_header(name: str, tmp_path: Path) -> None:
    """All functions, types and statuses of both headers, and no others; a tab separates name and kind."""
    folder = write_target("arduino", SUBJECTS[name], tmp_path)
    listed = dict(line.split("\t") for line in (folder / "keywords.txt").read_text("utf-8").splitlines())
    headers = "".join(path.read_text("utf-8") for path in sorted((folder / "src").glob("*.h")))
    header = re.sub(r"/\*.*?\*/", "", headers, flags=re.DOTALL)
    functions = set(re.findall(r"^[a-z][\w ]*[ *](nmpc_\w+)\(", header, re.MULTILINE))
    assert {word for word, kind in listed.items() if kind == "KEYWORD2"} == functions
    statuses = set(re.findall(r"\bNMPC_(?:OK|NULL_POINTER|BAD_\w+)(?= =)", header))
    literals = {word for word, kind in listed.items() if kind == "LITERAL1"}
    limits = set(re.findall(r"#define (NMPC_LIMIT_\w+)", header))
    assert literals == statuses | limits | {"NMPC_UPDATE_PERIOD_S", "NMPC_TILT_LIMIT_RAD"}
    for word, kind in listed.items():
        assert kind != "KEYWORD1" or re.search(rf"\b{word}\b", header)


def test_library_properties_have_every_field_that_the_ide_wants(tmp_path: Path) -> None:
    """Of its library specification, 1.5 format."""
    folder = write_target("arduino", SUBJECTS["mambo"], tmp_path)
    lines = (folder / "library.properties").read_text("utf-8").splitlines()
    fields = dict(line.split("=", 1) for line in lines)
    wanted = ("name", "version", "author", "maintainer", "sentence", "paragraph", "category", "architectures")
    assert all(fields[name] for name in wanted)
    assert re.fullmatch(r"\d+\.\d+\.\d+(-dev\d+)?", fields["version"])
    assert (folder / "src" / fields["includes"]).is_file()


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
        files = render_target(settings, find_target(name), with_digest=False)
        example = files["README.md"].partition("```c\n")[2].partition("```")[0]
        folder = place(files | {"example.c": example}, tmp_path / name)
        shell(
            *(require("gcc", "gcc"), "-std=c99", "-Wall", "-Wextra", "-Werror"),
            *(f"-I./{find_target(name).source_folder}", "-c", "example.c"),
            folder=folder,
        )
