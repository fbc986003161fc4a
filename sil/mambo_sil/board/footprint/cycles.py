"""A model of the clock cycles of executed instructions: the core's manual, and the flash's wait states.

Not in the model: interrupts, bus contention, prefetching.
"""

from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from mambo_codegen.boards import FlashWait
from mambo_sil.board.emulation.core import Executed
from mambo_sil.board.firmware.elf import Image
from mambo_sil.board.footprint.timing import Cycles, Timing, cortex_m0plus, cortex_m4, exactly


@dataclass(frozen=True)
class TimingSource:
    """Where the cycles of a core's instructions are from, and the function that returns them by address.

    The function is None of a core whose emulator counts cycles.
    """

    source: str
    timings: Callable[[Image], Mapping[int, Timing]] | None


MODELS: Final = {
    "cortex-m4": TimingSource("Cortex-M4 TRM, ARM DDI 0439D", cortex_m4),
    "cortex-m0": TimingSource("Cortex-M0+ TRM, ARM DDI 0484C", cortex_m0plus),
    "avr": TimingSource("simavr, which emulates cycle by cycle", None),
}
"""Models by emulated core. The other cores are estimated.

The Cortex-M7 issues two instructions at once, the ARM926 has caches of unknown content, and of the RV32 core
no timing is published.
"""


@dataclass(frozen=True)
class ModelledCycles:
    """Modelled cycles of one step: without wait states, and the wait states of a flash with empty caches."""

    without_wait: Cycles
    wait: int

    @property
    def most(self) -> int:
        """Return the most cycles, wait states included."""
        return self.without_wait.most + self.wait


class CycleModel:
    """The modelled cycles of a program on a core; `flash` is None if its flash has no wait states."""

    def __init__(self, image: Image, core: str, flash: FlashWait | None) -> None:
        timings = MODELS[core].timings
        self._timings = None if timings is None else timings(image)
        self._flash = flash

    def cycles(self, executed: Executed) -> ModelledCycles:
        """Add up the cycles of what was executed."""
        if self._timings is None:
            return ModelledCycles(exactly(executed.cycles.total()), 0)
        fewest = usual = most = 0  # plain numbers: this loop takes a fifth of the time of a count
        for address, times in executed.times.items():
            timing = self._timings[address]
            least, middle, largest = timing.cycles
            fewest, usual, most = fewest + times * least, usual + times * middle, most + times * largest
            if taken := executed.taken.get(address):
                least, middle, largest = timing.taken
                fewest, usual, most = fewest + taken * least, usual + taken * middle, most + taken * largest
        return ModelledCycles(Cycles(fewest, usual, most), self._wait(executed))

    def _wait(self, executed: Executed) -> int:
        """Return the wait states of every line that the caches, empty at the start, have to fetch."""
        flash = self._flash
        if flash is None:
            return 0
        code = (
            line
            for address, size in executed.blocks
            for line in range(address // flash.line_bytes, (address + size - 1) // flash.line_bytes + 1)
        )
        data = (address // flash.line_bytes for address in executed.flash_reads)
        misses = _misses(code, flash.code_lines) + _misses(data, flash.data_lines)
        return misses * flash.cycles_per_line


def _misses(lines: Iterable[int], kept: int) -> int:
    """Count the lines that are not among the `kept` ones used last."""
    cache: OrderedDict[int, None] = OrderedDict()
    misses = 0
    for line in lines:
        if line in cache:
            cache.move_to_end(line)
            continue
        misses += 1
        cache[line] = None
        if len(cache) > kept:
            cache.popitem(last=False)
    return misses
