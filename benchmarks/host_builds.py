"""Build the C of peers and ours as shared libraries for this machine, in the same way, and call them.

A library exports only `run`, so that compiler and linker can optimise the rest as in one program; heap calls
are counted.
"""

import ctypes
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from elftools.elf.elffile import ELFFile
from numpy.typing import NDArray

from benchmarks.peers_c import definitions, run_tool, sources
from benchmarks.peers_programs import Program
from mambo_nmpc.codegen.toolchain import host_toolchain

Array = NDArray[Any]

PORTABLE: Final = ("-O2",)
NATIVE: Final = ("-O3", "-march=native")
_COMMON: Final = ("-w", "-fPIC", "-fvisibility=hidden", "-ffunction-sections", "-fdata-sections")
_ALLOCATORS: Final = ("malloc", "calloc", "realloc", "_Znwm", "_Znam")
"""Allocators of C, and operators new of C++."""
_COUNTERS: Final = """#include <stddef.h>

__attribute__((visibility("default"))) unsigned long heap_calls;

#define COUNTED(name, parameters, arguments) \\
    void *__real_##name parameters __attribute__((weak)); \\
    void *__wrap_##name parameters; \\
    void *__wrap_##name parameters { heap_calls++; return __real_##name arguments; }

COUNTED(malloc, (size_t bytes), (bytes))
COUNTED(calloc, (size_t count, size_t bytes), (count, bytes))
COUNTED(realloc, (void *old, size_t bytes), (old, bytes))
COUNTED(_Znwm, (size_t bytes), (bytes))
COUNTED(_Znam, (size_t bytes), (bytes))
"""
_CODE: Final = (".text", ".rodata")
_RAM: Final = (".data", ".bss")


@dataclass(frozen=True)
class Sizes:
    """Bytes of a library: code with constants, and static variables."""

    code: int
    ram: int


def build(program: Program, folder: Path, flags: tuple[str, ...], library: Path) -> Path:
    """Build `program`, whose C is in `folder`, as the shared library `library`; raises NotHereError.

    Peers may use fused multiply-add if `flags` allow it; ours and the roll-out do not, to keep their bits.
    """
    work = library.with_suffix("")
    work.mkdir(parents=True)
    suffix = "cpp" if program.language == "c++" else "c"
    glue, counters = work / f"glue.{suffix}", work / "counters.c"
    glue.write_text(program.glue, "utf-8")
    counters.write_text(_COUNTERS, "utf-8")
    c = [*host_toolchain().command]
    compiler = c if program.language == "c" else ["c++", "-fno-gnu-unique"]
    contract = "off" if program.name in ("ours", "rollout") else "fast"
    line = [*compiler, program.dialect, *_COMMON, *flags, f"-ffp-contract={contract}"]
    line += [*definitions(program, folder), "-c"]
    objects: list[str] = []
    for source in sources(program, folder):
        objects.append(str(work / f"{len(objects)}.o"))
        run_tool([*line, str(source), "-o", objects[-1]])
    run_tool([*line, "-fvisibility=default", str(glue), "-o", str(work / "glue.o")])
    run_tool([*c, "-O2", "-fPIC", "-c", str(counters), "-o", str(work / "counters.o")])
    wrapped = [f"-Wl,--wrap={name}" for name in _ALLOCATORS]
    link = [*compiler, "-shared", "-Wl,--gc-sections", "-Wl,-Bsymbolic", *wrapped, *objects]
    run_tool([*link, str(work / "glue.o"), str(work / "counters.o"), "-lm", "-o", str(library)])
    return library


def sizes(library: Path) -> Sizes:
    """Measure a library, including its heap counters."""
    with library.open("rb") as stream:
        found = [(s.name, s["sh_size"]) for s in ELFFile(stream).iter_sections()]
    code, ram = (
        sum(size for name, size in found if name in kinds or name.startswith(tuple(f"{k}." for k in kinds)))
        for kinds in (_CODE, _RAM)
    )
    return Sizes(code, ram)


def silence() -> None:
    """Discard the stdout of this process, since some peers print every solve."""
    with Path(os.devnull).open("w") as nowhere:
        os.dup2(nowhere.fileno(), 1)


def plans(library: Path, inputs: Array, *, follows: bool) -> tuple[Array, Array, list[int]]:
    """Plan for each of `inputs` (n, 6), error and last command, in order.

    If `follows`, the last command is that of the previous plan, initially 0. Returns the last commands
    (n, 2), the plans (n, 4), and the number of heap calls of each update.
    """
    loaded = ctypes.CDLL(str(library))
    heap = ctypes.c_ulong.in_dll(loaded, "heap_calls")
    errors = np.ascontiguousarray(inputs[:, :4], np.float32)
    lasts = np.ascontiguousarray(inputs[:, 4:], np.float32)
    found = np.zeros((len(inputs), 4), np.float32)
    calls = []
    for i, (error, last, moves) in enumerate(zip(errors, lasts, found, strict=True)):
        if follows:
            last[:] = found[i - 1, :2] if i else 0
        before = heap.value
        loaded.run(*(row.ctypes.data_as(ctypes.c_void_p) for row in (error, last, moves)))
        calls.append(heap.value - before)
    return lasts, found, calls
