"""Build a bundle for a board: a minimal firmware, the same without the controller, or a program to emulate.

Programs are linked statically to fixed addresses, without start-up code and C library; freestanding.c defines
memset and memcpy, which compilers call. If clang compiles, the board's GCC links, since its libgcc has the
arithmetic.
"""

import hashlib
import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Final

from mambo_codegen.boards import Board
from mambo_codegen.bundle.flags import COMPILE_FLAGS
from mambo_codegen.errors import BuildError
from mambo_codegen.toolchain import Toolchain
from mambo_sil.results.build_folders import write_sources

ENTRY: Final = "run"
PREFIX: Final = "nmpc"
OPTIMISATIONS: Final = ("-O0", "-O2", "-O3", "-Os")

_COMPILE: Final = ("-ffunction-sections", "-fdata-sections", "-fno-pie")
_NO_LIBRARY: Final = ("-fno-tree-loop-distribute-patterns",)
"""Without this flag GCC compiles the loop of memset in freestanding.c to a call of memset."""
_LINK: Final = ("-static", "-nostartfiles", "-nodefaultlibs", "-Wl,--gc-sections", "-Wl,--build-id=none")
_GUEST_ADDRESS: Final = "-Wl,-Ttext=0x10000"
_CLANG: Final = "clang"
_CLANG_TARGETS: Final = {
    "arm926": "arm-none-eabi",
    "cortex-m0": "arm-none-eabi",
    "cortex-m3": "arm-none-eabi",
    "cortex-m4": "arm-none-eabi",
    "cortex-m7": "arm-none-eabi",
    "cortex-m33": "arm-none-eabi",
    "rv32": "riscv32-unknown-elf",
}
"""Clang's target of each emulated core; the board's flags choose core and FPU."""
_CLANG_NO_LIBRARY: Final = ("-ffreestanding",)
_PACKAGE: Final = resources.files("mambo_sil.board.firmware")


@dataclass(frozen=True)
class Builder:
    """Compiler and linker for a board; the linker is always a GCC."""

    board: Board
    toolchain: Toolchain
    linker: Toolchain
    own_flags: tuple[str, ...] = _NO_LIBRARY

    @property
    def compiler(self) -> str:
        """First line of the compiler's --version."""
        return self.toolchain.identity().partition("\n")[0]

    def firmware(self, files: dict[str, str], folder: Path, *, empty: bool = False) -> Path:
        """Link a minimal firmware with the bundle `files`, or without if `empty`; returns the ELF file."""
        main = {"main.c": (_PACKAGE / "firmware.c").read_text("utf-8")}
        place = folder / ("empty" if empty else "firmware")
        return self._link(files | main, (ENTRY,), place, define=["-DEMPTY"] if empty else [])

    def guest(self, files: dict[str, str], glue: str, keep: tuple[str, ...], folder: Path) -> Path:
        """Link the bundle `files` with `glue`, C whose functions `keep` stay; returns the ELF file."""
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
        """Compile and link the C of `sources` {path: text}; the symbols `keep` stay, the entry first.

        All programs in one folder share the objects of the bundle, which is everything but the main program.
        """
        freestanding = (_PACKAGE / "freestanding.c").read_text("utf-8")
        main = {"freestanding.c": freestanding, "main.c": sources["main.c"]}
        files = {path: text for path, text in sources.items() if path not in main}
        core, optimisation = self.board.compiler.flags, self.toolchain.optimisation
        flags = [*COMPILE_FLAGS, *core, *([optimisation] if optimisation else []), *_COMPILE, *self.own_flags]
        chosen = sorted(path for path in files if re.fullmatch(r"[^/]*\.c", path))
        key = repr((self.toolchain.command, flags, sorted(files.items())))
        bundle = place.parent.resolve() / f"bundle-{hashlib.sha256(key.encode()).hexdigest()[:16]}"
        parts = [bundle / Path(source).with_suffix(".o").name for source in chosen]
        if not all(part.is_file() for part in parts):
            write_sources(files, bundle)
            self._run(self.toolchain, [*flags, "-c", *chosen], bundle)
        write_sources(main, place)
        self._run(self.toolchain, [*flags, *define, f"-I{bundle}", "-c", *main], place)
        objects = [*(Path(source).with_suffix(".o").name for source in main), *map(str, parts)]
        kept = [f"-Wl,-e,{keep[0]}", *(f"-Wl,-u,{symbol}" for symbol in keep[1:])]
        link = [*core, *objects, *_LINK, *address, *kept, *self.board.compiler.libraries]
        self._run(self.linker, [*link, "-o", "program.elf"], place)
        return place / "program.elf"

    def _run(self, tool: Toolchain, arguments: Sequence[str], place: Path) -> None:
        """Run compiler or linker; raises BuildError, which says what the board demands of it."""
        try:
            tool.run(arguments, place)
        except BuildError as error:
            compiler = self.board.compiler
            raise BuildError(
                f"{self.board.title}: {tool.command[0]} does not build for it; it must be a C99 compiler for "
                f"{self.board.core.value} that takes {' '.join(compiler.flags)} (compiler.candidates and "
                f"compiler.flags of the board; Debian: {' '.join(compiler.packages)})\n{error}"
            ) from error


def builder(board: Board, optimisation: str | None = None) -> Builder:
    """Return a builder with the first of the board's compilers on the PATH.

    Raises BuildError, which names the Debian packages, if there is none.
    """
    for command in board.compiler.candidates:
        if shutil.which(command):
            toolchain = Toolchain((command,), optimisation)
            return Builder(board, toolchain, toolchain)
    raise BuildError(
        f"no compiler for {board.title} found: {' or '.join(board.compiler.candidates)} "
        f"(Debian: {' '.join(board.compiler.packages)})"
    )


def clang_builder(board: Board, optimisation: str | None = None) -> Builder:
    """Return a builder that compiles with clang and links with the board's GCC.

    Raises BuildError if either is missing, or if clang does not support the board's core.
    """
    core = board.emulated_core.value
    if core not in _CLANG_TARGETS:
        raise BuildError(f"{board.title}: clang is not supported for {core}")
    if shutil.which(_CLANG) is None:
        raise BuildError(f"{_CLANG} is missing (Debian: {_CLANG})")
    toolchain = Toolchain((_CLANG, f"--target={_CLANG_TARGETS[core]}"), optimisation)
    return Builder(board, toolchain, builder(board).toolchain, _CLANG_NO_LIBRARY)
