"""Emulated cores: load a program, call its functions by name, count its instructions.

Unicorn emulates ARM and RISC-V in this process, QEMU emulates AVR in a process of its own. A call that faults
or exceeds its time limit raises EmulationError and leaves the machine usable; no process outlives it.
"""

from pathlib import Path
from typing import Final

from mambo_sil.board.emulation.avr_machine import AvrMachine
from mambo_sil.board.emulation.unicorn_machine import MODELS, UnicornMachine

TIME_LIMIT_S: Final = 1.0
AVR: Final = "avr"
CORES: Final = (*MODELS, AVR)
"""Values of a board's `emulated_core`; all cores are little-endian."""


Machine = AvrMachine | UnicornMachine
"""A core with a program, a stack, and memory to allocate.

`word_bytes` is the size of int and of a pointer, `arena` the memory left to allocate, `stack` the
address range of the stack, including the return address if calls push it.
"""


def start(elf: Path, core: str, time_limit_s: float = TIME_LIMIT_S, *, counting: bool = False) -> Machine:
    """Load a program into an emulated core; `take_executed` needs `counting`.

    Raises EmulatorError if the emulator is missing or the program does not fit into memory.
    """
    if core == AVR:
        return AvrMachine(elf, time_limit_s, counting=counting)
    return UnicornMachine(elf, core, time_limit_s, counting=counting)
