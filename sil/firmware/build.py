"""Build a bundle for a board: the least firmware, the same without the controller, or a guest to emulate.

Programs are linked statically at a fixed address, without start-up code and without a C library; what the
compiler calls of one, memset and memcpy, stands in freestanding.c. Clang compiles for most boards too; then
the board's own compiler links, for its helpers.
"""

import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Final

from mambo_nmpc.codegen.boards import Board
from mambo_nmpc.codegen.errors import BuildError
from mambo_nmpc.codegen.flags import COMPILE_FLAGS
from mambo_nmpc.codegen.toolchain import Toolchain

ENTRY: Final = "run"
PREFIX: Final = "nmpc"
OPTIMISATIONS: Final = ("-O0", "-O2", "-O3", "-Os")

_COMPILE: Final = ("-ffunction-sections", "-fdata-sections", "-fno-pie")
_NO_LIBRARY: Final = ("-fno-tree-loop-distribute-patterns",)
"""Lest memset in freestanding.c becomes a call of itself."""
_LINK: Final = (
    "-static",
    "-nostartfiles",
    "-nodefaultlibs",
    "-Wl,--gc-sections",
    "-Wl,--build-id=none",
)
_GUEST_ADDRESS: Final = "-Wl,-Ttext=0x10000"
_CLANG: Final = "clang"
_CLANG_TARGETS: Final = {
    "arm926": "arm-none-eabi",
    "cortex-m0": "arm-none-eabi",
    "cortex-m4": "arm-none-eabi",
    "cortex-m7": "arm-none-eabi",
    "rv32": "riscv32-unknown-elf",
}
"""What clang calls the architecture of an emulated core; the rest it reads from the board's flags."""
_CLANG_NO_LIBRARY: Final = ("-ffreestanding",)
_PACKAGE: Final = resources.files("mambo_nmpc.sil.firmware")


@dataclass(frozen=True)
class Builder:
    """The compiler for a board, and the optimisation that replaces the bundle's own; `linker` is a gcc."""

    board: Board
    toolchain: Toolchain
    linker: Toolchain
    own_flags: tuple[str, ...] = _NO_LIBRARY

    @property
    def compiler(self) -> str:
        """Name and version, as the compiler gives them."""
        return self.toolchain.identity().partition("\n")[0]

    def firmware(self, files: dict[str, str], folder: Path, *, empty: bool = False) -> Path:
        """Link the least firmware with the bundle `files`, or without it; returns the ELF."""
        main = {"main.c": (_PACKAGE / "firmware.c").read_text("utf-8")}
        place = folder / ("empty" if empty else "firmware")
        return self._link(files | main, (ENTRY,), place, define=["-DEMPTY"] if empty else [])

    def guest(self, files: dict[str, str], glue: str, keep: tuple[str, ...], folder: Path) -> Path:
        """Link the bundle `files` with `glue`, of which `keep` stays callable; returns the ELF."""
        return self._link(files | {"main.c": glue}, keep, folder / "guest", address=[_GUEST_ADDRESS])

    def _link(
        self,
        sources: dict[str, str],
        keep: tuple[str, ...],
        place: Path,
        *,
        define: Sequence[str] = (),
        address: Sequence[str] = (),
    ) -> Path:
        """Compile and link all C in `sources` {path: text}; the symbols `keep` stay, entry first."""
        sources = sources | {"freestanding.c": (_PACKAGE / "freestanding.c").read_text("utf-8")}
        for path, text in sources.items():
            (place / path).parent.mkdir(parents=True, exist_ok=True)
            (place / path).write_text(text, "utf-8")
        chosen = sorted(path for path in sources if re.fullmatch(r"(src/)?[^/]*\.c", path))
        self.toolchain.run(
            [
                *COMPILE_FLAGS,
                *self.board.compiler.flags,
                *([self.toolchain.optimisation] if self.toolchain.optimisation else []),
                *_COMPILE,
                *self.own_flags,
                *define,
                "-Iinclude",
                "-c",
                *chosen,
            ],
            place,
        )
        self.linker.run(
            [
                *self.board.compiler.flags,
                *(Path(source).with_suffix(".o").name for source in chosen),
                *_LINK,
                *address,
                f"-Wl,-e,{keep[0]}",
                *(f"-Wl,-u,{symbol}" for symbol in keep[1:]),
                *self.board.compiler.libraries,
                "-o",
                "program.elf",
            ],
            place,
        )
        return place / "program.elf"


def builder(board: Board, optimisation: str | None = None) -> Builder:
    """Find the compiler for `board`: the first of its candidates that is here.

    Raises BuildError naming the packages that bring one.
    """
    for command in board.compiler.candidates:
        if shutil.which(command):
            toolchain = Toolchain((command,), optimisation)
            return Builder(board, toolchain, toolchain)
    raise BuildError(
        f"no compiler for {board.title} found ({', '.join(board.compiler.candidates)}); "
        f"Debian's {' and '.join(board.compiler.packages)} bring one"
    )


def clang_builder(board: Board, optimisation: str | None = None) -> Builder:
    """Find clang for `board`, and the board's own compiler, which links.

    Raises BuildError if either is missing, or if clang's name for the board's architecture is not known here.
    """
    core = board.emulated_core.value
    if core not in _CLANG_TARGETS:
        raise BuildError(f"{board.title}: nothing known of clang for {core}")
    if shutil.which(_CLANG) is None:
        raise BuildError(f"{_CLANG} is not here; Debian's {_CLANG} brings it")
    toolchain = Toolchain((_CLANG, f"--target={_CLANG_TARGETS[core]}"), optimisation)
    return Builder(board, toolchain, builder(board).toolchain, _CLANG_NO_LIBRARY)
