"""Small programs linked for a board, without its start-up code and without a C library."""

import subprocess
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Literal

from mambo_nmpc.codegen.flags import COMPILE_FLAGS
from mambo_nmpc.codegen.render import render
from mambo_nmpc.codegen.settings import presets
from mambo_nmpc.codegen.settings.controller_toml import with_option
from tests.support.tools import require

GUEST = """
#include "nmpc_self_test.h"
nmpc_t nmpc_instance;
nmpc_state_t state;
nmpc_target_t target;
nmpc_real_t thrust;
nmpc_command_t command;
long run(void) { return nmpc_self_test(&nmpc_instance); }
long fly(void) { return nmpc_step(&nmpc_instance, &state, &target, thrust, &command); }
"""
"""A program that runs the self-test, or one step from variables."""

_LINK = (
    "-ffunction-sections",
    "-fdata-sections",
    "-fno-tree-loop-distribute-patterns",
    "-static",
    "-fno-pie",
    "-nostartfiles",
    "-nodefaultlibs",
    "-Wl,--gc-sections",
    "-Wl,--build-id=none",
    "-Wl,-Ttext=0x10000",
    "-Wl,-e,run",
    "-Wl,-u,fly",
)


@dataclass(frozen=True)
class Board:
    """A processor and its cross compiler."""

    name: str
    compiler: str
    package: str
    flags: tuple[str, ...]
    libraries: tuple[str, ...] = ("-lgcc",)


def _board(name: str, compiler: str, package: str, flags: str) -> Board:
    return Board(name, compiler, package, tuple(flags.split()))


_ARM = ("arm-none-eabi-gcc", "gcc-arm-none-eabi")
_HARD = "-mthumb -mfloat-abi=hard -mfpu"
BOARDS = {
    board.name: board
    for board in (
        _board(
            "arm926",
            "arm-linux-gnueabi-gcc",
            "gcc-arm-linux-gnueabi",
            "-mcpu=arm926ej-s -marm -mfloat-abi=soft",
        ),
        _board("m4f", *_ARM, f"-mcpu=cortex-m4 {_HARD}=fpv4-sp-d16"),
        _board("m7", *_ARM, f"-mcpu=cortex-m7 {_HARD}=fpv5-d16"),
        _board("m0plus", *_ARM, "-mcpu=cortex-m0plus -mthumb"),
        _board(
            "rv32imac",
            "riscv64-unknown-elf-gcc",
            "gcc-riscv64-unknown-elf",
            "-march=rv32imac -mabi=ilp32 -ffreestanding",
        ),
        Board("avr", "avr-gcc", "gcc-avr and avr-libc", ("-mmcu=atmega2560",), ("-lm", "-lgcc")),
    )
}


def link(board: Board, text: str, folder: Path, *flags: str, name: str = "guest") -> Path:
    """Compile and link `text`, C with the entry run(), for `board`; `flags` may name further sources."""
    compiler = require(board.compiler, board.package)
    freestanding = resources.files("mambo_nmpc.sil.firmware").joinpath("freestanding.c").read_text("utf-8")
    (folder / f"{name}.c").write_text(text + freestanding)
    command = [
        compiler,
        *COMPILE_FLAGS,
        *board.flags,
        *_LINK,
        f"{name}.c",
        *flags,
        *board.libraries,
        "-o",
        f"{name}.elf",
    ]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / f"{name}.elf"


def link_controller(
    board: Board, folder: Path, *flags: str, scalar: Literal["float32", "float64", "fixed"] = "float32"
) -> Path:
    """Link GUEST with the controller of preset mambo; -fstack-usage writes gcc's frame sizes beside it."""
    settings = with_option(presets.load("mambo"), "code.scalar", scalar)
    for path, text in render(settings, with_digest=False).items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)
    sources = sorted(str(path.relative_to(folder)) for path in folder.glob("src/*.c"))
    return link(board, GUEST, folder, "-fstack-usage", *flags, "-Iinclude", *sources)
