"""Cycles of one instruction where it stands, as the manual of its core gives them."""

from dataclasses import dataclass
from typing import Final, NamedTuple


class Cycles(NamedTuple):
    """Cycles without wait states: the fewest and the most that a manual allows, and what its table says."""

    fewest: int
    usual: int
    most: int

    def plus(self, other: "Cycles") -> "Cycles":
        """Return the sum."""
        return Cycles(self.fewest + other.fewest, self.usual + other.usual, self.most + other.most)


def exactly(cycles: int) -> Cycles:
    """Return the cycles of what the manual gives one number for."""
    return Cycles(cycles, cycles, cycles)


NONE: Final = exactly(0)


@dataclass(frozen=True)
class Timing:
    """Cycles of one instruction, with the delay of the one behind it; `taken` is added each time it jumps."""

    cycles: Cycles
    taken: Cycles
