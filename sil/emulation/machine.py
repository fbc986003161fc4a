"""Emulated cores: load a program, call its functions by name, count its instructions.

Unicorn emulates ARM and RISC-V in this process, QEMU emulates AVR in a process of its own. A call that faults
or exceeds its time limit raises EmulationError and leaves the machine usable; no process outlives it.
"""

from collections import Counter
from pathlib import Path
from typing import Final, Protocol

from mambo_nmpc.sil.emulation.avr import AvrMachine
from mambo_nmpc.sil.emulation.unicorn import MODELS, UnicornMachine

TIME_LIMIT_S: Final = 1.0
AVR: Final = "avr"
CORES: Final = (*MODELS, AVR)
"""Values of a board's `emulated_core`; all cores are little-endian."""


class Machine(Protocol):
    """A core with a program, a stack, and memory to allocate.

    `word_bytes` is the size of int and of a pointer, `free_bytes` the memory left to allocate, `stack` the
    address range of the stack, including the return address if calls push it.
    """

    @property
    def word_bytes(self) -> int: ...  # noqa: D102 - see above
    @property
    def free_bytes(self) -> int: ...  # noqa: D102
    @property
    def stack(self) -> range: ...  # noqa: D102

    def allocate(self, size: int) -> int:
        """Allocate `size` bytes; returns their address."""
        ...

    def write(self, address: int, content: bytes) -> None:
        """Write memory."""
        ...

    def read(self, address: int, size: int) -> bytes:
        """Read memory."""
        ...

    def call(self, function: str, *arguments: int) -> int:
        """Call `function` with arguments of type int, pointer or Long; returns an unsigned long.

        Raises EmulationError if it faults or exceeds the time limit; the machine stays usable.
        """
        ...

    def take_counts(self) -> Counter[int]:
        """Return the instructions executed since the last call, by start address of their basic block."""
        ...


def start(elf: Path, core: str, time_limit_s: float = TIME_LIMIT_S, *, counting: bool = False) -> Machine:
    """Load a program into an emulated core; `take_counts` needs `counting`.

    Raises EmulatorError if the emulator is missing or the program does not fit into memory.
    """
    if core == AVR:
        return AvrMachine(elf, time_limit_s, counting=counting)
    return UnicornMachine(elf, core, time_limit_s, counting=counting)
