"""The columns of states, targets and commands in the closed loop, from the rows of the port.

A controller of the height takes and gives all rows, another one those that are not the height's. These come
first, so that all columns of a level controller are the first ones of the others.
"""

from dataclasses import dataclass
from typing import Final

from mambo_codegen.port.port import ControllerPort
from mambo_codegen.port.row import PortRow
from mambo_codegen.port.taken import TAKEN


def _placed(record: str) -> dict[str, slice]:
    """Return the columns of each member of a record in the closed loop, which has all of them."""
    found, last = dict[str, slice](), 0
    for row in sorted(TAKEN[record], key=lambda one: one.is_upward):
        assert isinstance(row.count, int), "what is taken has a size"
        found[row.member] = slice(last, last + row.count)
        last += row.count
    return found


STATE: Final = _placed("state")
TARGET: Final = _placed("target")
COMMAND: Final = _placed("command")
"""Columns by member."""


@dataclass(frozen=True)
class Columns:
    """How many numbers the loop gives a controller, of a state and of a target, and takes of a command."""

    state: int
    target: int
    command: int

    @classmethod
    def of(cls, *, upward: bool) -> "Columns":
        """Return those of all rows, or of those that are not the height's."""

        def count(record: str, places: dict[str, slice]) -> int:
            rows: list[PortRow] = [row for row in TAKEN[record] if upward or not row.is_upward]
            return sum(places[row.member].stop - places[row.member].start for row in rows)

        return cls(count("state", STATE), count("target", TARGET), count("command", COMMAND))

    @property
    def commands_thrust(self) -> bool:
        """Whether the controller commands the thrust."""
        return self.command > LEVEL.command


LEVEL: Final = Columns.of(upward=False)
SPACE: Final = Columns.of(upward=True)
"""Those of controllers without and with a height."""


def own_columns(port: ControllerPort, record: str) -> list[int]:
    """Return where the numbers of a controller's state or target stand in the closed loop."""
    places = STATE if record == "state" else TARGET
    return [places[number.row.member].start + number.axis for number in port.numbers(record)]
