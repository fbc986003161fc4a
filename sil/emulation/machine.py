"""An emulated core: a program in memory, its functions called by name, its instructions counted.

Unicorn runs ARM and RISC-V inside this process; AVR, which it has not, runs in a QEMU beside it. Either way
a guest that dies, hangs or is interrupted leaves nothing behind, and a call that faults or does not return
within its time limit raises EmulationError.
"""

from collections import Counter
from pathlib import Path
from typing import Final, Protocol

from mambo_nmpc.sil.emulation.avr import AvrMachine
from mambo_nmpc.sil.emulation.unicorn import MODELS, UnicornMachine

TIME_LIMIT_S: Final = 1.0
AVR: Final = "avr"
CORES: Final = (*MODELS, AVR)
"""The cores that boards name as `emulated_core`. All are little-endian."""


class Machine(Protocol):
    """A core with the program of an ELF file, a stack, and room for data.

    `word_bytes` is the width of an int and of a pointer; `free_bytes` what can still be allocated; `stack`
    the addresses that a call can use, its return address included where a call pushes it.
    """

    @property
    def word_bytes(self) -> int: ...  # noqa: D102 - see above
    @property
    def free_bytes(self) -> int: ...  # noqa: D102
    @property
    def stack(self) -> range: ...  # noqa: D102

    def allocate(self, size: int) -> int:
        """Return the address of `size` bytes of data."""
        ...

    def write(self, address: int, content: bytes) -> None:
        """Write memory."""
        ...

    def read(self, address: int, size: int) -> bytes:
        """Read memory."""
        ...

    def call(self, function: str, *arguments: int) -> int:
        """Call `function` with ints, pointers and Long's; returns its result, an unsigned long.

        Raises EmulationError if it dies or does not return in time; the next call is none the worse for it.
        """
        ...

    def counted(self) -> Counter[int]:
        """Return the instructions run since the last time, by the address at which a run of them begins."""
        ...


def start(elf: Path, core: str, time_limit_s: float = TIME_LIMIT_S, *, counting: bool = False) -> Machine:
    """Put a program on a core, of which `counted` works only if it is `counting`.

    Raises EmulatorError if there is no emulator for the core, or the program does not fit into it.
    """
    if core == AVR:
        return AvrMachine(elf, time_limit_s, counting=counting)
    return UnicornMachine(elf, core, time_limit_s, counting=counting)
