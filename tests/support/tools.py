"""Tools that may be missing: a skip that names them, and a failure where they are demanded."""

import importlib.util
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn

import pytest

from mambo_codegen import boards
from mambo_codegen.toolchain import Toolchain
from mambo_sil.board.firmware.firmware_build import Builder, builder

CORES = {
    "mambo": "arm926",
    "rp2040": "cortex-m0",
    "crazyflie": "cortex-m4",
    "nano33ble": "cortex-m4",
    "stm32f103": "cortex-m3",
    "stm32h743": "cortex-m7",
    "teensy41": "cortex-m7",
    "rv32": "rv32",
    "mega": "avr",
}
"""The emulated core of each board."""


def require(tool: str, package: str) -> str:
    """Return the path of `tool`; without it skip the test, or fail it where CI is true."""
    path = shutil.which(tool)
    if path is None:
        _miss(f"{tool} is missing (Debian: {package})")
    return path


def require_file(path: Path, package: str) -> Path:
    """Return `path`; without that file skip the test, or fail it where CI is true."""
    if not path.is_file():
        _miss(f"{path} is missing (Debian: {package})")
    return path


def require_module(name: str) -> None:
    """Skip the test, or fail it where CI is true, without the Python package `name`."""
    if importlib.util.find_spec(name) is None:
        _miss(f"{name} is missing (pip install {name})")


def _miss(message: str) -> NoReturn:
    if os.environ.get("CI") == "true":
        pytest.fail(message)
    pytest.skip(message)


def board_builder(name: str) -> Builder:
    """Return the builder for a board; skip, or fail where CI is true, without its compiler or emulator."""
    board = boards.load(name)
    if not any(shutil.which(command) for command in board.compiler.candidates):
        require(board.compiler.candidates[0], " and ".join(board.compiler.packages))
    if board.emulated_core.value == "avr":
        require_file(Path("/usr/include/simavr/sim_avr.h"), "libsimavr-dev")
    return builder(board)


def only(folder: Path, *patterns: str) -> str:
    """Return a PATH that has nothing but the tools that match `patterns`, linked in `folder`."""
    for place in os.environ["PATH"].split(os.pathsep):
        for tool in (path for pattern in patterns for path in Path(place).glob(pattern)):
            if not (folder / tool.name).exists():
                (folder / tool.name).symlink_to(tool)
    return str(folder)


@contextmanager
def without_compilers_of_boards() -> Iterator[None]:
    """Hide all tools but the compiler of this machine.

    `fly --port` then counts no instructions on the emulated core of the board, which takes most of its time.
    """
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setenv("PATH", only(Path(folder), "gcc", "cc", "as", "ld"))
        yield


def toolchain(compiler: str, optimisation: str | None = None) -> Toolchain:
    """Return `compiler`, gcc or clang, at `optimisation`, if it is here."""
    require(compiler, compiler)
    return Toolchain((compiler,), optimisation)
