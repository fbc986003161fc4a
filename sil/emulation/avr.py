"""An ATmega2560 in a QEMU of its own, driven as a debugger would; a plugin counts its instructions."""

import hashlib
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

from mambo_nmpc.codegen.errors import BuildError
from mambo_nmpc.codegen.toolchain import Toolchain, host_toolchain
from mambo_nmpc.sil.emulation.gdb import GdbStub
from mambo_nmpc.sil.errors import EmulationError, EmulatorError
from mambo_nmpc.sil.files.cache import cached

_EMULATOR: Final = "qemu-system-avr"
_TOOLS: Final = {_EMULATOR: "qemu-system-misc", "setpriv": "util-linux"}
_PART: Final = "an ATmega2560"

_FLASH_BYTES: Final = 0x40000
_RETURN_ADDRESS: Final = _FLASH_BYTES - 0x1000
_DATA_SPACE: Final = 0x800000
"""Where the linker and the debugger put the data, which a program sees from 0."""
_RAM: Final = range(0x200, 0x2200)
_STACK_BYTES: Final = 2048
_GUARD: Final = b"\x5a" * 32
"""What lies between data and stack, and must still be there after a call."""
_ALIGNMENT: Final = 2
_AVR6: Final = 6
"""Machine in an ELF header of what is built for more than 128 KiB of flash."""

_REGISTER_BYTES: Final = 39
_STACK_POINTER: Final = slice(33, 35)
_PROGRAM_COUNTER: Final = slice(35, 39)
_RESULT: Final = slice(22, 26)
_ARGUMENTS: Final = range(8, 26)
"""Registers that hold arguments, the first ones highest (avr-gcc, calling convention)."""

_COUNT_BYTES: Final = 8 * _FLASH_BYTES // 2
_COUNTING_SLOWDOWN: Final = 3


class Long(int):
    """An argument of type unsigned long, which takes 32 bits wherever an int has 16."""


class AvrMachine:
    """An ATmega2560 with the program of an ELF file, a stack, and room for data."""

    word_bytes: Final = 2

    def __init__(self, elf: Path, time_limit_s: float, *, counting: bool = False) -> None:
        _demand_tools()
        flash, data, self._symbols = _program(elf)
        used = max((start + len(content) for start, content in data), default=_RAM.start)
        self._next = -(-used // _ALIGNMENT) * _ALIGNMENT
        if self.free_bytes < 0:
            size, stack = used - _RAM.start, _STACK_BYTES
            raise EmulatorError(
                f"{size} B of data and {stack} B of stack do not fit the {len(_RAM)} B of {_PART}"
            )
        self._time_limit_s = time_limit_s * (_COUNTING_SLOWDOWN if counting else 1)
        files = [_file("flash", flash)]
        options = ["-bios", f"/proc/self/fd/{files[0]}"]
        if counting:
            files.append(_file("counts", bytes(_COUNT_BYTES)))
            self._counts = np.frombuffer(mmap.mmap(files[1], _COUNT_BYTES), np.uint64)
            options += ["-plugin", f"{_plugin()},counts={files[1]}"]
        quiet = ["-display", "none", "-monitor", "none", "-serial", "none"]
        command = [_EMULATOR, "-M", "mega2560", "-S", "-gdb", "stdio", *quiet, *options]
        try:
            self._stub = GdbStub(command, files)
        finally:
            for file in files:
                os.close(file)
        self._stub.break_at(_RETURN_ADDRESS)
        for start, content in data:
            self.write(start, content)
        self.write(self.stack.start - len(_GUARD), _GUARD)

    @property
    def free_bytes(self) -> int:
        """Return how much can still be allocated."""
        return self.stack.start - len(_GUARD) - self._next

    @property
    def stack(self) -> range:
        """Return the addresses that a call can use, its return address included."""
        return _RAM[-_STACK_BYTES:]

    def allocate(self, size: int) -> int:
        """Return the address of `size` bytes of data."""
        address = self._next
        self._next += -(-size // _ALIGNMENT) * _ALIGNMENT
        assert self.free_bytes >= 0
        return address

    def write(self, address: int, content: bytes) -> None:
        """Write data memory, at an address as the program or as the linker has it."""
        self._stub.write(address | _DATA_SPACE, content)

    def read(self, address: int, size: int) -> bytes:
        """Read data memory, at an address as the program or as the linker has it."""
        return self._stub.read(address | _DATA_SPACE, size)

    def counted(self) -> Counter[int]:
        """Return the instructions run since the last time, by the address at which a run of them begins."""
        words = np.flatnonzero(self._counts)
        counts = Counter({2 * int(word): int(self._counts[word]) for word in words})
        self._counts[words] = 0
        return counts

    def call(self, function: str, *arguments: int) -> int:
        """Call `function` with what fits in registers, the others on the stack; returns its result."""
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
            raise EmulationError(f"{function} died at address {place:#x}: {_PART} has no such instruction")
        if self.read(self.stack.start - len(_GUARD), len(_GUARD)) != _GUARD:
            raise EmulationError(f"{function} took more than the {_STACK_BYTES} B of stack that it has")
        return int.from_bytes(after[_RESULT], "little")


def _demand_tools() -> None:
    for tool, package in _TOOLS.items():
        if shutil.which(tool) is None:
            raise EmulatorError(f"no {tool} found to emulate {_PART}; Debian's {package} brings it")


def _program(elf: Path) -> tuple[bytes, list[tuple[int, bytes]], dict[str, int]]:
    """Return the flash, erased where the program is not, the data by address, and the symbols."""
    flash = bytearray(b"\xff" * _FLASH_BYTES)
    data: list[tuple[int, bytes]] = []
    with elf.open("rb") as file:
        program = ELFFile(file)
        if program["e_machine"] != "EM_AVR" or program["e_flags"] & 0x7F != _AVR6:
            raise EmulatorError(f"{elf.name}: not built for {_PART}, the one AVR that is emulated here")
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


def _file(name: str, content: bytes) -> int:
    """Put `content` into a file that has no place in any folder; returns its descriptor."""
    descriptor = os.memfd_create(name)
    with os.fdopen(os.dup(descriptor), "wb") as file:
        file.write(content)
    return descriptor


def _plugin() -> Path:
    """Return the plugin that counts, built here for the QEMU that is here, once."""
    source = resources.files("mambo_nmpc.sil.emulation").joinpath("qemu_count.c").read_text("utf-8")
    said = subprocess.run([_EMULATOR, "--version"], capture_output=True, text=True, check=False).stdout
    version = re.search(r"version (\d+)", said)
    if version is None:
        raise EmulatorError(f"{_EMULATOR} does not tell its version")
    interface = 1 if int(version[1]) < 9 else 2  # QEMU 9 asks for 2 at least
    try:
        toolchain = host_toolchain()
    except BuildError as error:
        raise EmulatorError(f"what counts instructions of {_PART} is compiled here: {error}") from error
    made_of = "\n".join([source, str(interface), toolchain.identity()])
    name = f"qemu-count-{hashlib.sha256(made_of.encode()).hexdigest()[:32]}.so"
    return cached(name, lambda folder: _built(source, interface, toolchain, folder))


def _built(source: str, interface: int, toolchain: Toolchain, folder: Path) -> Path:
    (folder / "count.c").write_text(source, "utf-8")
    flags = ["-O2", "-shared", "-fPIC", f"-DQEMU_PLUGIN_INTERFACE={interface}"]
    toolchain.run([*flags, "count.c", "-o", "count.so"], folder)
    return folder / "count.so"
