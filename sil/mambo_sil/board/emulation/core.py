"""What all emulated cores have: memory that their program leaves free, and what they have executed."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Executed:
    """Instructions executed, by address.

    `times` counts every instruction, a skipped conditional one too, since it is issued. Where the emulator
    counts clock cycles, `cycles` has them. Else `taken` counts how often the next instruction was not the one
    behind it, and there are, in order of time, `blocks`, address and size of each basic block, and
    `flash_reads`, addresses of data read from flash.
    """

    times: Counter[int] = field(default_factory=Counter)
    taken: Counter[int] = field(default_factory=Counter)
    blocks: list[tuple[int, int]] = field(default_factory=list)
    flash_reads: list[int] = field(default_factory=list)
    cycles: Counter[int] = field(default_factory=Counter)

    def only(self, own: Callable[[int], bool]) -> "Executed":
        """Return the part of it at addresses that are `own`."""
        return Executed(
            Counter({address: times for address, times in self.times.items() if own(address)}),
            Counter({address: times for address, times in self.taken.items() if own(address)}),
            [block for block in self.blocks if own(block[0])],
            [address for address in self.flash_reads if own(address)],
            Counter({address: cycles for address, cycles in self.cycles.items() if own(address)}),
        )


class Arena:
    """Hands out the addresses from `start` to `end` in multiples of `alignment`; nothing is ever freed."""

    def __init__(self, start: int, end: int, alignment: int) -> None:
        self._alignment = alignment
        self._next = self._round_up(start)
        self._end = end

    @property
    def free_bytes(self) -> int:
        """Return the bytes left to allocate; negative if `start` already lies beyond `end`."""
        return self._end - self._next

    def allocate(self, size: int) -> int:
        """Allocate `size` bytes; returns their address."""
        address = self._next
        self._next += self._round_up(size)
        assert self.free_bytes >= 0
        return address

    def _round_up(self, size: int) -> int:
        return -(-size // self._alignment) * self._alignment
