"""An ATmega2560 emulated by simavr, in this process, which counts instructions and clock cycles."""

from collections import Counter
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Final

import cffi
import numpy as np
from elftools.elf.elffile import ELFFile
from numpy.typing import NDArray

from mambo_codegen.errors import BuildError
from mambo_codegen.toolchain import host_toolchain
from mambo_sil.board.emulation.core import Arena, Executed
from mambo_sil.errors import EmulationError, EmulatorError
from mambo_sil.results.shared_library import LibrarySource, load_shared_library

_PART: Final = "an ATmega2560"

_FLASH_BYTES: Final = 0x40000
_RETURN_ADDRESS: Final = _FLASH_BYTES - 0x1000
_DATA_SPACE: Final = 0x800000
"""Offset of data addresses in ELF files."""
_RAM: Final = range(0x200, 0x2200)
_STACK_BYTES: Final = 3072
_GUARD: Final = b"\x5a" * 32
"""Pattern between data and stack; it is overwritten if the stack overflows."""
_ALIGNMENT: Final = 2
_AVR6: Final = 6
"""Machine in the ELF flags of AVR parts with more than 128 KiB of flash."""

_STACK_POINTER: Final = 0x5D
_RESULT: Final = 22
_ARGUMENTS: Final = range(8, 26)
"""Registers, the first bytes of data memory: of the result, and of arguments, allocated from the highest down
(avr-gcc, calling convention)."""
_CYCLES_PER_S: Final = 1e8
"""Cycles that count as a second of the time limit: about what simavr takes in one."""

_DECLARATIONS: Final = """
    void *machine_create(void);
    void machine_destroy(void *avr);
    uint8_t *machine_flash(void *avr);
    uint8_t *machine_data(void *avr);
    uint32_t machine_place(const void *avr);
    int machine_run(void *avr, uint32_t start, uint32_t end, uint64_t limit_cycles,
                    uint64_t *times, uint64_t *cycles);
"""
_FAULTED: Final = 1
_LATE: Final = 2


class Long(int):
    """An argument of type unsigned long: 32 bits also where int has 16."""


class AvrMachine:
    """A `Machine` in this process."""

    word_bytes: Final = 2

    def __init__(self, elf: Path, time_limit_s: float) -> None:
        flash, data, self._symbols = _read_program(elf)
        used = max((start + len(content) for start, content in data), default=_RAM.start)
        self.arena = Arena(used, self.stack.start - len(_GUARD), _ALIGNMENT)
        if self.arena.free_bytes < 0:
            size, stack = used - _RAM.start, _STACK_BYTES
            raise EmulatorError(
                f"{size} B of data and {stack} B of stack do not fit the {len(_RAM)} B of {_PART}"
            )
        self._time_limit_s = time_limit_s
        self._ffi, self._library = _interface(), _load_simavr()
        self._avr = self._ffi.gc(self._library.machine_create(), self._library.machine_destroy)
        self._ffi.memmove(self._library.machine_flash(self._avr), flash, len(flash))
        self._data = self._ffi.buffer(self._library.machine_data(self._avr), _RAM.stop)
        self._times, self._cycles = np.zeros((2, _FLASH_BYTES // 2), np.uint64)
        for start, content in data:
            self.write(start, content)
        self.write(self.stack.start - len(_GUARD), _GUARD)

    @property
    def stack(self) -> range:
        """Return the address range of the stack, including the return address."""
        return _RAM[-_STACK_BYTES:]

    def write(self, address: int, content: bytes) -> None:
        """Write data memory; `address` with or without the offset of ELF files."""
        start = address % _DATA_SPACE
        self._data[start : start + len(content)] = content

    def read(self, address: int, size: int) -> bytes:
        """Read data memory; `address` with or without the offset of ELF files."""
        start = address % _DATA_SPACE
        return bytes(self._data[start : start + size])

    def take_executed(self) -> Executed:
        """Return what was executed since the last call, and its cycles."""
        return Executed(_take(self._times), cycles=_take(self._cycles))

    def call(self, function: str, *arguments: int) -> int:
        """Call `function` with arguments of type int, pointer or Long; returns an unsigned long.

        Raises EmulationError if it faults or exceeds the time limit; the machine stays usable.
        """
        registers = bytearray(32)
        pushed = (_RETURN_ADDRESS // 2).to_bytes(3, "big")
        free = _ARGUMENTS.stop
        for argument in arguments:
            content = argument.to_bytes(4 if isinstance(argument, Long) else self.word_bytes, "little")
            free -= len(content)
            if free >= _ARGUMENTS.start:
                registers[free : free + len(content)] = content
            else:
                pushed += content
        self.write(0, bytes(registers))
        self.write(_RAM.stop - len(pushed), pushed)
        self.write(_STACK_POINTER, (_RAM.stop - len(pushed) - 1).to_bytes(2, "little"))
        ended = self._run(self._symbols[function])
        place = self._library.machine_place(self._avr)
        if ended == _LATE:
            raise EmulationError(
                f"{function} did not return within {self._time_limit_s:g} s, at address {place:#x}"
            )
        if ended == _FAULTED:
            raise EmulationError(f"{function} faulted at address {place:#x}: illegal instruction or address")
        if self.read(self.stack.start - len(_GUARD), len(_GUARD)) != _GUARD:
            raise EmulationError(f"{function} overflowed its stack of {_STACK_BYTES} B")
        return int.from_bytes(self.read(_RESULT, 4), "little")

    def _run(self, start: int) -> int:
        """Run from an address until the function there returns; returns how it ended."""
        tables = [self._ffi.from_buffer("uint64_t[]", table) for table in (self._times, self._cycles)]
        limit = round(self._time_limit_s * _CYCLES_PER_S)
        return int(self._library.machine_run(self._avr, start, _RETURN_ADDRESS, limit, *tables))


def _read_program(elf: Path) -> tuple[bytes, list[tuple[int, bytes]], dict[str, int]]:
    """Return the contents of flash (0xFF where unused), the data by address, and the symbols."""
    flash = bytearray(b"\xff" * _FLASH_BYTES)
    data: list[tuple[int, bytes]] = []
    with elf.open("rb") as file:
        program = ELFFile(file)
        if program["e_machine"] != "EM_AVR" or program["e_flags"] & 0x7F != _AVR6:
            raise EmulatorError(f"{elf.name}: not built for {_PART}, the only AVR that is emulated")
        symbols = {
            symbol.name: symbol["st_value"]
            for symbol in program.get_section_by_name(".symtab").iter_symbols()
        }
        for segment in program.iter_segments("PT_LOAD"):
            start = segment["p_vaddr"]
            if start >= _DATA_SPACE:
                data.append((start - _DATA_SPACE, segment.data().ljust(segment["p_memsz"], b"\0")))
            elif start + segment["p_filesz"] > _RETURN_ADDRESS:
                raise EmulatorError(f"{elf.name}: does not fit the {_FLASH_BYTES} B of flash of {_PART}")
            else:
                flash[start : start + segment["p_filesz"]] = segment.data()
    return bytes(flash), data, symbols


def _take(table: NDArray[np.uint64]) -> Counter[int]:
    """Return the numbers of a table by byte address, and set them to 0."""
    words = np.flatnonzero(table)
    taken = Counter({2 * int(word): int(table[word]) for word in words})
    table[words] = 0
    return taken


@cache
def _interface() -> Any:
    ffi = cffi.FFI()
    ffi.cdef(_DECLARATIONS)
    return ffi


def _load_simavr() -> Any:
    """Return the library of simavr.c; compiled for the installed simavr and cached."""
    text = resources.files("mambo_sil.board.emulation").joinpath("simavr.c").read_text("utf-8")
    files = {"simavr.c": text}
    source = LibrarySource("simavr", text, lambda: files, ("-O2",), _interface(), ("-lsimavr",))
    try:
        return load_shared_library(source, host_toolchain())
    except BuildError as error:
        raise EmulatorError(
            f"simavr, needed to emulate {_PART}, cannot be built here (Debian: libsimavr-dev): {error}"
        ) from error
