"""An emulated core: a program in memory, its functions called by name; Unicorn, QEMU's core, does the work.

Everything happens inside this process, so a guest that dies, hangs or is interrupted leaves nothing behind: a
call that faults or does not return within its time limit raises EmulationError.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import unicorn
from elftools.elf.elffile import ELFFile
from unicorn import arm_const, riscv_const

from sil.errors import EmulationError

TIME_LIMIT_S: Final = 1.0

_WATCHED_SLOWDOWN: Final = 30
"""How much longer a call may take when every run of instructions is reported to Python."""

_CODE_BYTES: Final = 0x100000
_RETURN_ADDRESS: Final = _CODE_BYTES - 0x1000
_RAM_ADDRESS: Final = 0x20000000
_STACK_BYTES: Final = 0x10000
_STACK_TOP: Final = _RAM_ADDRESS + _STACK_BYTES
_ALIGNMENT: Final = 16


@dataclass(frozen=True)
class Core:
    """How one kind of core is made and called."""

    architecture: int
    mode: int
    model: int
    arguments: tuple[int, ...]
    stack_pointer: int
    return_address: int
    result: int
    program_counter: int
    thumb: bool = False


def _arm(model: int, *, thumb: bool) -> Core:
    return Core(
        architecture=unicorn.UC_ARCH_ARM,
        mode=unicorn.UC_MODE_THUMB if thumb else unicorn.UC_MODE_ARM,
        model=model,
        arguments=tuple(arm_const.UC_ARM_REG_R0 + index for index in range(4)),
        stack_pointer=arm_const.UC_ARM_REG_SP,
        return_address=arm_const.UC_ARM_REG_LR,
        result=arm_const.UC_ARM_REG_R0,
        program_counter=arm_const.UC_ARM_REG_PC,
        thumb=thumb,
    )


CORES: Final = {
    "arm926": _arm(arm_const.UC_CPU_ARM_926, thumb=False),
    "cortex-m0": _arm(arm_const.UC_CPU_ARM_CORTEX_M0, thumb=True),
    "cortex-m4": _arm(arm_const.UC_CPU_ARM_CORTEX_M4, thumb=True),
    "cortex-m7": _arm(arm_const.UC_CPU_ARM_CORTEX_M7, thumb=True),
    "rv32": Core(
        architecture=unicorn.UC_ARCH_RISCV,
        mode=unicorn.UC_MODE_RISCV32,
        model=riscv_const.UC_CPU_RISCV32_ANY,
        arguments=tuple(riscv_const.UC_RISCV_REG_A0 + index for index in range(8)),
        stack_pointer=riscv_const.UC_RISCV_REG_SP,
        return_address=riscv_const.UC_RISCV_REG_RA,
        result=riscv_const.UC_RISCV_REG_A0,
        program_counter=riscv_const.UC_RISCV_REG_PC,
    ),
}
"""The cores that boards name as `emulated_core`. All are little-endian, with pointers and int of 32 bits."""


class Machine:
    """A core with the program of an ELF file, a stack, and room for data."""

    def __init__(self, elf: Path, core: str, data_bytes: int, time_limit_s: float = TIME_LIMIT_S) -> None:
        self._core = CORES[core]
        self._time_limit_s = time_limit_s
        with elf.open("rb") as file:
            program = ELFFile(file)
            self._symbols = {symbol.name: symbol["st_value"] for symbol in _symbols(program)}
            segments = [(segment["p_vaddr"], segment.data()) for segment in program.iter_segments("PT_LOAD")]
        self._engine = unicorn.Uc(self._core.architecture, self._core.mode)
        self._engine.ctl_set_cpu_model(self._core.model)
        self._engine.mem_map(0, _CODE_BYTES)
        self._engine.mem_map(_RAM_ADDRESS, _STACK_BYTES + _pages(data_bytes))
        for address, content in segments:
            self._engine.mem_write(address, content)
        if "__global_pointer$" in self._symbols:
            self._engine.reg_write(riscv_const.UC_RISCV_REG_GP, self._symbols["__global_pointer$"])
        self._next = _STACK_TOP
        self._end = _STACK_TOP + _pages(data_bytes)

    def allocate(self, size: int) -> int:
        """Return the address of `size` bytes of data."""
        address = self._next
        self._next += -(-size // _ALIGNMENT) * _ALIGNMENT
        assert self._next <= self._end, "the machine was made too small"
        return address

    def write(self, address: int, content: bytes) -> None:
        """Write memory."""
        self._engine.mem_write(address, content)

    def read(self, address: int, size: int) -> bytes:
        """Read memory."""
        return bytes(self._engine.mem_read(address, size))

    def watch_blocks(self, watch: Callable[[int, int], None]) -> None:
        """Have `watch` called with address and size in bytes of every run of instructions, before it runs."""

        def hook(_engine: Any, address: int, size: int, _data: Any) -> None:
            watch(address, size)

        self._time_limit_s *= _WATCHED_SLOWDOWN
        self._engine.ctl_flush_tb()
        self._engine.hook_add(unicorn.UC_HOOK_BLOCK, hook)

    def call(self, function: str, *arguments: int) -> int:
        """Call `function` with up to four words in registers, the others on the stack; returns its result."""
        core, engine = self._core, self._engine
        in_registers, on_stack = arguments[: len(core.arguments)], arguments[len(core.arguments) :]
        words = b"".join(word.to_bytes(4, "little") for word in on_stack)
        stack_top = _STACK_TOP - _ALIGNMENT - -(-len(words) // _ALIGNMENT) * _ALIGNMENT
        engine.mem_write(stack_top, words)
        for register, word in zip(core.arguments, in_registers, strict=False):
            engine.reg_write(register, word)
        engine.reg_write(core.stack_pointer, stack_top)
        engine.reg_write(core.return_address, _RETURN_ADDRESS | core.thumb)
        entry = self._symbols[function] | core.thumb
        try:
            engine.emu_start(entry, _RETURN_ADDRESS, timeout=round(self._time_limit_s * 1e6))
        except unicorn.UcError as error:
            raise EmulationError(f"{function} died at {self._where()}: {error}") from error
        if engine.reg_read(core.program_counter) != _RETURN_ADDRESS:
            raise EmulationError(
                f"{function} did not return within {self._time_limit_s:g} s, at {self._where()}"
            )
        return int(engine.reg_read(core.result))

    def _where(self) -> str:
        return f"address {self._engine.reg_read(self._core.program_counter):#x}"


def _symbols(program: Any) -> Any:
    return program.get_section_by_name(".symtab").iter_symbols()


def _pages(size: int) -> int:
    return -(-size // 0x1000) * 0x1000
