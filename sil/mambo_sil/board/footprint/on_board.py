"""What was measured on a real board, by an extension that speaks to it."""

import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from pydantic import BaseModel, ConfigDict


class Spread(BaseModel):
    """Least, median and most of something measured in every step."""

    model_config = ConfigDict(frozen=True)

    least: float
    median: float
    most: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Self:
        """Return the spread of `values`."""
        return cls(least=min(values), median=statistics.median(values), most=max(values))

    @property
    def milliseconds(self) -> str:
        """Least, median and most, of times in s."""
        return " / ".join(f"{1e3 * value:.3g}" for value in (self.least, self.median, self.most))


@dataclass(frozen=True)
class BoardMeasurement:
    """What a board measured in the steps of a flight that its controller accepted."""

    port: str
    board_says: str
    """The name of the board in its firmware."""
    clock_hz: int
    ticks: int
    cycles: Spread
    """Of `nmpc_step`, at `clock_hz`."""
    mean_cycles: float
    stack_bytes: int
    different_steps: int
    """Steps with other bits than on this machine."""
    link_faults: dict[str, int]
    """What went wrong on the link and was made good."""

    @property
    def sentence(self) -> str:
        """What was flown on which board, and whether its bits are those of this machine."""
        bits = (
            f"{self.different_steps} STEPS HAVE OTHER BITS THAN ON THIS MACHINE"
            if self.different_steps
            else "all bits equal those of this machine"
        )
        clock = f"{self.clock_hz / 1e6:g} MHz"
        return f"{self.board_says} at {clock}, {self.port}: {self.ticks} steps of the counted flight, {bits}"
