"""Cycles of the instructions of an ATmega2560 (DS40002198, AVRe+; its program counter has 22 bits)."""

from typing import Final

from mambo_sil.board.firmware.avr import SKIPS, Line, decode
from mambo_sil.board.firmware.elf import Image
from mambo_sil.board.footprint.timing import NONE, Cycles, Timing, exactly

_JUMPS: Final = {
    **dict.fromkeys(("rjmp", "ijmp", "eijmp"), 2),
    **dict.fromkeys(("rcall", "icall", "eicall"), 4),
    "jmp": 3,
    **dict.fromkeys(("call", "ret", "reti"), 5),
}
_TWO_CYCLES: Final = frozenset(
    {"adiw", "sbiw", "mul", "muls", "mulsu", "fmul", "fmuls", "fmulsu", "push", "pop", "sbi", "cbi"}
    | {"ld", "ldd", "lds", "st", "std", "sts"}
)
_THREE_CYCLES: Final = frozenset({"lpm", "elpm"})
_NOWHERE: Final = (".+0",)
"""Operand of a jump or call to the instruction behind it, which takes its time but is not seen as taken."""


def atmega2560(image: Image) -> dict[int, Timing]:
    """Return the timing of every instruction of a program on an ATmega2560, by address.

    An instruction that is skipped takes a cycle for each of its words.
    """
    skipped: set[int] = set()
    timings = {}
    for line in decode(image):
        timings[line.address] = _timing(line, skippable=line.address in skipped)
        if line.mnemonic in SKIPS:
            skipped.add(line.next_address)
    return timings


def _timing(line: Line, *, skippable: bool) -> Timing:
    words = line.size_bytes // 2
    if line.mnemonic in _JUMPS:
        cycles = _JUMPS[line.mnemonic]
        if line.operands == _NOWHERE:
            return Timing(exactly(cycles), NONE)
        return Timing(exactly(words), exactly(cycles - words))
    if line.mnemonic.startswith("br"):
        return Timing(exactly(1), exactly(1))
    cycles = 2 if line.mnemonic in _TWO_CYCLES else 3 if line.mnemonic in _THREE_CYCLES else 1
    return Timing(Cycles(min(words, cycles) if skippable else cycles, cycles, cycles), NONE)
