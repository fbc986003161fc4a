"""Build a bundle for a board: the least firmware, the same without the controller, or a guest to emulate.

Programs are linked statically at a fixed address, without start-up code and without a C library; what the
compiler calls of one, memset and memcpy, stands in freestanding.c.
"""

import shutil
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Final

from codegen.boards import Board
from codegen.errors import BuildError
from codegen.flags import COMPILE_FLAGS
from codegen.toolchain import Toolchain

ENTRY: Final = "run"
PREFIX: Final = "nmpc"
OPTIMISATIONS: Final = ("-O0", "-O2", "-O3", "-Os")

_COMPILE: Final = ("-ffunction-sections", "-fdata-sections", "-fno-tree-loop-distribute-patterns", "-fno-pie")
_LINK: Final = (
    "-static",
    "-nostartfiles",
    "-nodefaultlibs",
    "-Wl,--gc-sections",
    "-Wl,--build-id=none",
)
_GUEST_ADDRESS: Final = "-Wl,-Ttext=0x10000"
_PACKAGE: Final = resources.files("codegen.footprint")


@dataclass(frozen=True)
class Builder:
    """The compiler for a board, and the optimisation that replaces the bundle's own."""

    board: Board
    toolchain: Toolchain

    @property
    def compiler(self) -> str:
        """Name and version, as the compiler gives them."""
        return self.toolchain.identity().partition("\n")[0]

    def firmware(self, files: dict[str, str], folder: Path, *, empty: bool = False) -> Path:
        """Link the least firmware with the bundle `files`, or without it; returns the ELF."""
        main = {"main.c": (_PACKAGE / "firmware.c").read_text("utf-8")}
        flags = ["-DEMPTY"] if empty else []
        return self._link(files | main, (ENTRY,), flags, folder / ("empty" if empty else "firmware"))

    def guest(self, files: dict[str, str], glue: str, keep: tuple[str, ...], folder: Path) -> Path:
        """Link the bundle `files` with `glue`, of which `keep` stays callable; returns the ELF."""
        return self._link(files | {"main.c": glue}, keep, [_GUEST_ADDRESS], folder / "guest")

    def _link(self, sources: dict[str, str], keep: tuple[str, ...], flags: list[str], place: Path) -> Path:
        """Compile and link all C in `sources` {path: text}; the symbols `keep` stay, entry first."""
        sources = sources | {"freestanding.c": (_PACKAGE / "freestanding.c").read_text("utf-8")}
        for path, text in sources.items():
            (place / path).parent.mkdir(parents=True, exist_ok=True)
            (place / path).write_text(text, "utf-8")
        self.toolchain.run(
            [
                *COMPILE_FLAGS,
                *self.board.compiler.flags,
                *([self.toolchain.optimisation] if self.toolchain.optimisation else []),
                *_COMPILE,
                *flags,
                "-Iinclude",
                *sorted(path for path in sources if path.endswith(".c") and not path.startswith("example/")),
                *_LINK,
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
            return Builder(board, Toolchain((command,), optimisation))
    raise BuildError(
        f"no compiler for {board.title} found ({', '.join(board.compiler.candidates)}); "
        f"Debian's {' and '.join(board.compiler.packages)} bring one"
    )
