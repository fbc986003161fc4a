"""ARM and RISC-V cores, emulated in this process by Unicorn."""

import bisect
import itertools
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import unicorn
from elftools.elf.elffile import ELFFile
from unicorn import arm_const, riscv_const

from mambo_sil.board.emulation.core import Arena, Executed
from mambo_sil.board.firmware.disassembly import disassemble
from mambo_sil.board.firmware.elf import load
from mambo_sil.errors import EmulationError

_COUNTING_SLOWDOWN: Final = 30
"""Factor on the time limit when Unicorn reports every basic block to Python."""

_DATA_BYTES: Final = 0x100000

_CODE_BYTES: Final = 0x100000
_RETURN_ADDRESS: Final = _CODE_BYTES - 0x1000
_RAM_ADDRESS: Final = 0x20000000
_STACK_BYTES: Final = 0x10000
_STACK_TOP: Final = _RAM_ADDRESS + _STACK_BYTES
_ALIGNMENT: Final = 16
_IT_BITS: Final = 0x0600FC00
"""Of the program status register of a Cortex-M: which instructions of an IT block are left."""


@dataclass(frozen=True)
class CoreModel:
    """Unicorn's constants of one core: its model, and the registers of its calling convention."""

    architecture: int
    mode: int
    model: int
    arguments: tuple[int, ...]
    stack_pointer: int
    return_address: int
    result: int
    program_counter: int
    thumb: bool = False


def _arm(model: int, *, thumb: bool) -> CoreModel:
    return CoreModel(
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


MODELS: Final = {
    "arm926": _arm(arm_const.UC_CPU_ARM_926, thumb=False),
    "cortex-m0": _arm(arm_const.UC_CPU_ARM_CORTEX_M0, thumb=True),
    "cortex-m3": _arm(arm_const.UC_CPU_ARM_CORTEX_M3, thumb=True),
    "cortex-m4": _arm(arm_const.UC_CPU_ARM_CORTEX_M4, thumb=True),
    "cortex-m7": _arm(arm_const.UC_CPU_ARM_CORTEX_M7, thumb=True),
    "cortex-m33": _arm(arm_const.UC_CPU_ARM_CORTEX_M33, thumb=True),
    "rv32": CoreModel(
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
"""Little-endian cores with pointers and int of 32 bits."""


class UnicornMachine:
    """A `Machine` in this process."""

    word_bytes: Final = 4

    def __init__(self, elf: Path, core: str, time_limit_s: float, *, counting: bool = False) -> None:
        self._core = MODELS[core]
        self._time_limit_s = time_limit_s
        with elf.open("rb") as file:
            program = ELFFile(file)
            symbols = program.get_section_by_name(".symtab").iter_symbols()
            self._symbols = {symbol.name: symbol["st_value"] for symbol in symbols}
            segments = [(segment["p_vaddr"], segment.data()) for segment in program.iter_segments("PT_LOAD")]
        self._engine = unicorn.Uc(self._core.architecture, self._core.mode)
        self._engine.ctl_set_cpu_model(self._core.model)
        self._engine.mem_map(0, _CODE_BYTES)
        self._engine.mem_map(_RAM_ADDRESS, _STACK_BYTES + _DATA_BYTES)
        for address, content in segments:
            self._engine.mem_write(address, content)
        if "__global_pointer$" in self._symbols:
            self._engine.reg_write(riscv_const.UC_RISCV_REG_GP, self._symbols["__global_pointer$"])
        self.arena = Arena(_STACK_TOP, _STACK_TOP + _DATA_BYTES, _ALIGNMENT)
        self._blocks: list[tuple[int, int]] = []
        self._flash_reads: list[int] = []
        if counting:
            self._starts = sorted(disassemble(load(elf)).instructions)
            self._time_limit_s *= _COUNTING_SLOWDOWN
            self._engine.hook_add(unicorn.UC_HOOK_BLOCK, self._record_block)
            self._engine.hook_add(unicorn.UC_HOOK_MEM_READ, self._record_read, begin=0, end=_CODE_BYTES - 1)

    @property
    def stack(self) -> range:
        """Return the address range of the stack."""
        return range(_RAM_ADDRESS, _STACK_TOP - _ALIGNMENT)

    def write(self, address: int, content: bytes) -> None:
        """Write memory."""
        self._engine.mem_write(address, content)

    def read(self, address: int, size: int) -> bytes:
        """Read memory."""
        return bytes(self._engine.mem_read(address, size))

    def take_executed(self) -> Executed:
        """Return what was executed since the last call."""
        executed = Executed(blocks=self._blocks, flash_reads=self._flash_reads)
        self._blocks, self._flash_reads = [], []
        for block, number in Counter(executed.blocks).items():
            for start in self._instructions(*block):
                executed.times[start] += number
        for (block, after), number in Counter(itertools.pairwise(executed.blocks)).items():
            if after[0] != sum(block):
                executed.taken[self._instructions(*block)[-1]] += number
        return executed

    def _instructions(self, address: int, size: int) -> list[int]:
        """Return the addresses of the instructions in a block."""
        first, end = (bisect.bisect_left(self._starts, place) for place in (address, address + size))
        return self._starts[first:end]

    def _record_block(self, _engine: Any, address: int, size: int, _data: Any) -> None:
        self._blocks.append((address, size))

    def _record_read(self, engine: Any, _access: int, address: int, *_: Any) -> None:
        self._flash_reads.append(address)
        if self._core.thumb:
            self._end_it_block(engine)

    @staticmethod
    def _end_it_block(engine: Any) -> None:
        """Clear the IT bits that Unicorn 2.1 leaves behind when a hook is called in an IT block.

        The conditions of the block are in the translated code. A translation that ends before the end of its
        basic block, at a page of 1 KiB, would pass the bits on to the next one.
        """
        status = engine.reg_read(arm_const.UC_ARM_REG_XPSR)
        if status & _IT_BITS:
            engine.reg_write(arm_const.UC_ARM_REG_XPSR, status & ~_IT_BITS)

    def call(self, function: str, *arguments: int) -> int:
        """Call `function` with arguments of 32 bits; returns an unsigned long.

        Raises EmulationError if it faults or exceeds the time limit; the machine stays usable.
        """
        core, engine = self._core, self._engine
        in_registers, on_stack = arguments[: len(core.arguments)], arguments[len(core.arguments) :]
        words = b"".join(word.to_bytes(4, "little") for word in on_stack)
        stack_top = _STACK_TOP - _ALIGNMENT - -(-len(words) // _ALIGNMENT) * _ALIGNMENT
        engine.mem_write(stack_top, words)
        for register, word in zip(core.arguments, in_registers, strict=False):
            engine.reg_write(register, word)
        engine.reg_write(core.stack_pointer, stack_top)
        engine.reg_write(core.return_address, _RETURN_ADDRESS | core.thumb)
        self._run(function)
        return int(engine.reg_read(core.result))

    def _run(self, function: str) -> None:
        """Run until `function` returns; the limit is processor time, which a busy machine does not use up."""
        engine, program_counter = self._engine, self._core.program_counter
        began_s, place = time.thread_time(), self._symbols[function]
        while place != _RETURN_ADDRESS:
            if time.thread_time() - began_s >= self._time_limit_s:
                raise EmulationError(
                    f"{function} did not return within {self._time_limit_s:g} s, at {self._where()}"
                )
            try:
                engine.emu_start(
                    place | self._core.thumb, _RETURN_ADDRESS, timeout=round(self._time_limit_s * 1e6)
                )
            except unicorn.UcError as error:
                raise EmulationError(f"{function} faulted at {self._where()}: {error}") from error
            place = engine.reg_read(program_counter)

    def _where(self) -> str:
        return f"address {self._engine.reg_read(self._core.program_counter):#x}"
