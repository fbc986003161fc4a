"""Build programs as shared libraries for this machine, in the same way, and call them.

A library exports only `run`, so that compiler and linker can optimise the rest as in one program; heap calls
are counted.
"""

import ctypes
import os
from pathlib import Path
from typing import Any, Final

import numpy as np
from elftools.elf.elffile import ELFFile
from numpy.typing import NDArray

from benchmarks.peers.ours import Ours
from benchmarks.peers.programs import HERE, Program, run_tool
from mambo_codegen.toolchain import host_toolchain

Array = NDArray[Any]

_COMMON: Final = ("-w", "-fPIC", "-fvisibility=hidden", "-ffunction-sections", "-fdata-sections")
_ALLOCATORS: Final = ("malloc", "calloc", "realloc", "_Znwm", "_Znam")
"""Allocators of C, and operators new of C++."""


def build(program: Program, folder: Path, flags: str, library: Path) -> Path:
    """Build `program`, whose C is in `folder`, as the shared library `library`; raises NotHereError.

    Peers may use fused multiply-add if `flags` allow it; ours does not, to keep its bits.
    """
    work = library.with_suffix("")
    work.mkdir(parents=True)
    c = [*host_toolchain().command]
    compiler = c if program.language == "c" else ["c++", "-fno-gnu-unique"]
    contract = "off" if isinstance(program, Ours) else "fast"
    line = [*compiler, *_COMMON, *flags.split(), f"-ffp-contract={contract}"]
    objects = program.compile(line, folder, work)
    objects.append(str(work / "heap_calls.o"))
    run_tool([*c, "-O2", "-fPIC", "-c", str(HERE / "glue/heap_calls.c"), "-o", objects[-1]])
    wrapped = [f"-Wl,--wrap={name}" for name in _ALLOCATORS]
    link = [*compiler, "-shared", "-Wl,--gc-sections", "-Wl,-Bsymbolic", *wrapped, *objects]
    run_tool([*link, "-lm", "-o", str(library)])
    return library


def sizes(library: Path) -> tuple[int, int]:
    """Return bytes of code with constants, and of static variables, heap counters included."""
    with library.open("rb") as stream:
        found = [(f"{section.name}.", section["sh_size"]) for section in ELFFile(stream).iter_sections()]
    code, ram = (
        sum(size for name, size in found if name.startswith(kinds))
        for kinds in ((".text.", ".rodata."), (".data.", ".bss."))
    )
    return code, ram


def silence() -> None:
    """Discard the stdout of this process, since some peers print every solve."""
    with Path(os.devnull).open("w") as nowhere:
        os.dup2(nowhere.fileno(), 1)


def plans(library: Path, inputs: Array, *, follows: bool) -> tuple[Array, list[int]]:
    """Plan for each of `inputs` (n, 6), error and last command, in order.

    If `follows`, the last command is that of the previous plan, initially 0. Returns the plans
    (n, 4) and the number of heap calls of each update.
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
    return found, calls
