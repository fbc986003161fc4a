"""What an emulated core has executed."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Executed:
    """Instructions executed, by address.

    `times` counts every instruction, a skipped conditional one too, since it is issued. `taken` counts how
    often the next instruction was not the one behind it. In order of time, where the emulator reports it:
    `blocks`, address and size of each basic block, and `flash_reads`, addresses of data read from flash.
    """

    times: Counter[int] = field(default_factory=Counter)
    taken: Counter[int] = field(default_factory=Counter)
    blocks: list[tuple[int, int]] = field(default_factory=list)
    flash_reads: list[int] = field(default_factory=list)

    def only(self, own: Callable[[int], bool]) -> "Executed":
        """Return the part of it at addresses that are `own`."""
        return Executed(
            Counter({address: times for address, times in self.times.items() if own(address)}),
            Counter({address: times for address, times in self.taken.items() if own(address)}),
            [block for block in self.blocks if own(block[0])],
            [address for address in self.flash_reads if own(address)],
        )
