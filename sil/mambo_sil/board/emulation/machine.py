"""Emulated cores: load a program, call its functions by name, count its instructions.

Unicorn, an optional package, emulates ARM and RISC-V, simavr AVR, both in this process. A call that faults or
exceeds its time limit raises EmulationError and leaves the machine usable.
"""

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeAlias

from mambo_sil.board.emulation.avr_machine import AvrMachine
from mambo_sil.errors import EmulatorError

if TYPE_CHECKING:
    from mambo_sil.board.emulation.unicorn_machine import UnicornMachine

TIME_LIMIT_S: Final = 1.0
AVR: Final = "avr"

Machine: TypeAlias = "AvrMachine | UnicornMachine"
"""A core with a program, a stack, and memory to allocate.

`word_bytes` is the size of int and of a pointer, `arena` the memory left to allocate, `stack` the
address range of the stack, including the return address if calls push it.
"""


def demand_emulator(core: str) -> None:
    """Raise EmulatorError, which says what to install, for a core whose optional package is missing."""
    if core != AVR and find_spec("unicorn") is None:
        raise EmulatorError(
            f"unicorn, the optional package that emulates {core}, is missing: pip install unicorn "
            '(the extra "emulation")'
        )


def start(elf: Path, core: str, time_limit_s: float = TIME_LIMIT_S, *, counting: bool = False) -> Machine:
    """Load a program into an emulated core; `take_executed` needs `counting`.

    Raises EmulatorError if the emulator is missing or the program does not fit into memory.
    """
    if core == AVR:
        return AvrMachine(elf, time_limit_s)
    demand_emulator(core)
    from mambo_sil.board.emulation.unicorn_machine import UnicornMachine  # noqa: PLC0415 - an extra

    return UnicornMachine(elf, core, time_limit_s, counting=counting)
