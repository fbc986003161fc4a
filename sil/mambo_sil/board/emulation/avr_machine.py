"""An ATmega2560 emulated by QEMU, controlled over GDB's remote protocol; a plugin counts instructions."""

import hashlib
import itertools
import mmap
import os
import re
import shutil
import subprocess
from collections import Counter
from importlib import resources
from pathlib import Path
from typing import Final

import numpy as np
from elftools.elf.elffile import ELFFile
from numpy.typing import NDArray

from mambo_codegen.errors import BuildError
from mambo_codegen.toolchain import Toolchain, host_toolchain
from mambo_sil.board.emulation.core import Arena, Executed
from mambo_sil.board.emulation.gdb import GdbStub
from mambo_sil.board.firmware.avr import DISASSEMBLER, SKIPS, decode
from mambo_sil.board.firmware.elf import load
from mambo_sil.errors import EmulationError, EmulatorError
from mambo_sil.results.build_folders import build_cached

_EMULATOR: Final = "qemu-system-avr"
_TOOLS: Final = {_EMULATOR: "qemu-system-misc", "setpriv": "util-linux", DISASSEMBLER: "binutils-avr"}
_PART: Final = "an ATmega2560"

_FLASH_BYTES: Final = 0x40000
_RETURN_ADDRESS: Final = _FLASH_BYTES - 0x1000
_DATA_SPACE: Final = 0x800000
"""Offset of data addresses in ELF files and in GDB's protocol."""
_RAM: Final = range(0x200, 0x2200)
_STACK_BYTES: Final = 3072
_GUARD: Final = b"\x5a" * 32
"""Pattern between data and stack; it is overwritten if the stack overflows."""
_ALIGNMENT: Final = 2
_AVR6: Final = 6
"""Machine in the ELF flags of AVR parts with more than 128 KiB of flash."""

_REGISTER_BYTES: Final = 39
_STACK_POINTER: Final = slice(33, 35)
_PROGRAM_COUNTER: Final = slice(35, 39)
_RESULT: Final = slice(22, 26)
_ARGUMENTS: Final = range(8, 26)
"""Registers of arguments, allocated from the highest down (avr-gcc, calling convention)."""

_TWO_WORDS: Final = ((0xFE0F, 0x9000), (0xFE0F, 0x9200), (0xFE0E, 0x940C), (0xFE0E, 0x940E))
"""Mask and opcode of the instructions of two words: lds, sts, jmp, call (DS40002198)."""
_NOT_SKIPPED: Final = frozenset({"ret", "reti", "ijmp", "eijmp", "icall", "eicall"})
"""Instructions over which QEMU 7.2 does not skip: it executes the basic block before them again.

Where such an instruction is skipped, the translator leaves the program counter at the start of the block
(target/avr/translate.c, `avr_tr_translate_insn`: no case for DISAS_LOOKUP and DISAS_EXIT).
"""
_COUNTING_SLOWDOWN: Final = 3


class Long(int):
    """An argument of type unsigned long: 32 bits also where int has 16."""


class AvrMachine:
    """A `Machine` in a QEMU process."""

    word_bytes: Final = 2

    def __init__(self, elf: Path, time_limit_s: float, *, counting: bool = False) -> None:
        for tool, package in _TOOLS.items():
            if shutil.which(tool) is None:
                raise EmulatorError(f"{tool}, needed to emulate {_PART}, is missing (Debian: {package})")
        flash, data, self._symbols = _read_program(elf)
        demand_skips(elf)
        used = max((start + len(content) for start, content in data), default=_RAM.start)
        self.arena = Arena(used, self.stack.start - len(_GUARD), _ALIGNMENT)
        if self.arena.free_bytes < 0:
            size, stack = used - _RAM.start, _STACK_BYTES
            raise EmulatorError(
                f"{size} B of data and {stack} B of stack do not fit the {len(_RAM)} B of {_PART}"
            )
        self._time_limit_s = time_limit_s * (_COUNTING_SLOWDOWN if counting else 1)
        files = [_open_memory_file("flash", flash)]
        options = ["-bios", f"/proc/self/fd/{files[0]}"]
        if counting:
            tables = _count_tables(flash)
            files.append(_open_memory_file("counts", tables.tobytes()))
            shared = mmap.mmap(files[1], tables.nbytes)
            self._times, self._taken, _ = np.frombuffer(shared, np.uint64).reshape(tables.shape)
            options += ["-plugin", f"{_build_plugin()},counts={files[1]}"]
        quiet = ["-display", "none", "-monitor", "none", "-serial", "none"]
        command = [_EMULATOR, "-M", "mega2560", "-S", "-gdb", "stdio", *quiet, *options]
        try:
            self._stub = GdbStub(command, files)
        finally:
            for file in files:
                os.close(file)
        self._stub.set_breakpoint(_RETURN_ADDRESS)
        for start, content in data:
            self.write(start, content)
        self.write(self.stack.start - len(_GUARD), _GUARD)

    @property
    def stack(self) -> range:
        """Return the address range of the stack, including the return address."""
        return _RAM[-_STACK_BYTES:]

    def write(self, address: int, content: bytes) -> None:
        """Write data memory; `address` with or without the offset of ELF files."""
        self._stub.write(address | _DATA_SPACE, content)

    def read(self, address: int, size: int) -> bytes:
        """Read data memory; `address` with or without the offset of ELF files."""
        return self._stub.read(address | _DATA_SPACE, size)

    def take_executed(self) -> Executed:
        """Return what was executed since the last call, without blocks and reads of flash."""
        return Executed(_take(self._times), _take(self._taken))

    def call(self, function: str, *arguments: int) -> int:
        """Call `function` with arguments of type int, pointer or Long; returns an unsigned long.

        Raises EmulationError if it faults or exceeds the time limit; the machine stays usable.
        """
        registers = bytearray(_REGISTER_BYTES)
        pushed = (_RETURN_ADDRESS // 2).to_bytes(3, "big")
        free = _ARGUMENTS.stop
        for argument in arguments:
            content = argument.to_bytes(4 if isinstance(argument, Long) else self.word_bytes, "little")
            free -= len(content)
            if free >= _ARGUMENTS.start:
                registers[free : free + len(content)] = content
            else:
                pushed += content
        self.write(_RAM.stop - len(pushed), pushed)
        registers[_STACK_POINTER] = (_RAM.stop - len(pushed) - 1).to_bytes(2, "little")
        registers[_PROGRAM_COUNTER] = self._symbols[function].to_bytes(4, "little")
        self._stub.set_registers(bytes(registers))
        stopped = self._stub.run(self._time_limit_s)
        after = self._stub.registers()
        place = int.from_bytes(after[_PROGRAM_COUNTER], "little")
        if not stopped:
            raise EmulationError(
                f"{function} did not return within {self._time_limit_s:g} s, at address {place:#x}"
            )
        if place != _RETURN_ADDRESS:
            raise EmulationError(f"{function} faulted at address {place:#x}: illegal instruction")
        if self.read(self.stack.start - len(_GUARD), len(_GUARD)) != _GUARD:
            raise EmulationError(f"{function} overflowed its stack of {_STACK_BYTES} B")
        return int.from_bytes(after[_RESULT], "little")


def demand_skips(elf: Path) -> None:
    """Raise EmulatorError if an AVR program has a skip directly before an instruction of `_NOT_SKIPPED`."""
    image = load(elf)
    lines = decode(image)
    for line, after in itertools.pairwise(lines):
        if line.mnemonic in SKIPS and after.mnemonic in _NOT_SKIPPED:
            raise EmulatorError(
                f"{elf.name}: `{line.text}; {after.text}` in {image.name_of(line.address)}: where the first "
                "instruction skips the second, QEMU repeats what is before them, so it is not emulated; "
                f"{_PART} and simavr run it. Another optimisation, such as -Os, or -fno-reorder-blocks in "
                "compiler.flags of the board's file may avoid the pair"
            )


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


def _count_tables(flash: bytes) -> NDArray[np.uint64]:
    """Return the plugin's tables (3, words of flash) before the first step: 0, 0, lengths in words."""
    words = np.frombuffer(flash, "<u2")
    tables = np.zeros((3, len(words)), np.uint64)
    tables[2] = 1 + np.any([words & mask == opcode for mask, opcode in _TWO_WORDS], axis=0)
    return tables


def _take(table: NDArray[np.uint64]) -> Counter[int]:
    """Return the numbers of a table by byte address, and set them to 0."""
    words = np.flatnonzero(table)
    taken = Counter({2 * int(word): int(table[word]) for word in words})
    table[words] = 0
    return taken


def _open_memory_file(name: str, content: bytes) -> int:
    """Write `content` to an anonymous file in memory; returns its descriptor."""
    descriptor = os.memfd_create(name)
    with os.fdopen(os.dup(descriptor), "wb") as file:
        file.write(content)
    return descriptor


def _build_plugin() -> Path:
    """Return QEMU's plugin that counts instructions; compiled for the installed QEMU and cached."""
    source = resources.files("mambo_sil.board.emulation").joinpath("qemu_count.c").read_text("utf-8")
    output = subprocess.run([_EMULATOR, "--version"], capture_output=True, text=True, check=False).stdout
    version = re.search(r"version (\d+)", output)
    if version is None:
        raise EmulatorError(f"{_EMULATOR} --version prints no version")
    interface = 1 if int(version[1]) < 9 else 2  # QEMU 9 requires at least 2
    try:
        toolchain = host_toolchain()
    except BuildError as error:
        raise EmulatorError(f"cannot compile the instruction counter for {_PART}: {error}") from error
    contents = "\n".join([source, str(interface), toolchain.identity()])
    name = f"qemu-count-{hashlib.sha256(contents.encode()).hexdigest()[:32]}.so"
    return build_cached(name, lambda folder: _compile_plugin(source, interface, toolchain, folder))


def _compile_plugin(source: str, interface: int, toolchain: Toolchain, folder: Path) -> Path:
    (folder / "count.c").write_text(source, "utf-8")
    flags = ["-O2", "-shared", "-fPIC", f"-DQEMU_PLUGIN_INTERFACE={interface}"]
    toolchain.run([*flags, "count.c", "-o", "count.so"], folder)
    return folder / "count.so"
