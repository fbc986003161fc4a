"""The port of one controller: the rows of the table that its settings leave, as the lists others read."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

from mambo_codegen.port.kept import KEPT, WORDS
from mambo_codegen.port.row import NUMBER, RANGES, WHOLE, Number, PortRow, Table
from mambo_codegen.port.taken import MACROS, TAKEN

_CHECKED: Final = ("state", "target")
"""The records whose comments tell the ranges."""
_NAMED_BITS: Final = {name: f"NMPC_{name.upper()}_BITS" for name in ("thrust", "braking", "factor")}
"""The formats that a unit does not tell."""


@dataclass(frozen=True)
class Member:
    """A member of a struct of nmpc.h: its type, its name with the size of an array, and its comment."""

    kind: str
    name: str
    comment: str

    @property
    def width(self) -> int:
        """The characters before the comment."""
        return len(f"{self.kind} {self.name};")


@dataclass(frozen=True)
class StepNumber:
    """A number among the inputs of a step in one row.

    record: state, target or thrust.
    member: in C; none of the thrust, which is an argument.
    """

    record: str
    member: str
    quantity: str
    column: int


@dataclass(frozen=True)
class ControllerPort:
    """What one controller takes, gives and keeps.

    method: its `controller.method`.
    parts:  the parts that it has.
    sizes:  the constants of nmpc.h that are sizes.
    names:  what stands in braces in the words of rows.
    """

    method: str
    parts: frozenset[str]
    sizes: Mapping[str, int] = field(hash=False)
    names: Mapping[str, str] = field(hash=False)

    @cached_property
    def _table(self) -> Table:
        table = TAKEN | KEPT[self.method]
        return {name: tuple(row for row in rows if self.has(row)) for name, rows in table.items()}

    def has(self, row: PortRow) -> bool:
        """Return whether a row is there."""
        return self.parts.issuperset(row.when)

    def rows(self, record: str) -> tuple[PortRow, ...]:
        """Return the rows of a record."""
        return self._table[record]

    def count(self, row: PortRow) -> int:
        """Return how many numbers, or records, a row is."""
        return row.count if isinstance(row.count, int) else self.sizes[row.count]

    def kept(self, record: str, *kinds: str) -> Iterator[PortRow]:
        """Yield the row of each single member of some kinds in a record and in the records inside."""
        for row in self.rows(record):
            for _ in range(self.count(row)):
                if row.kind in self._table:
                    yield from self.kept(row.kind, *kinds)
                elif row.kind in kinds:
                    yield row

    def numbers(self, record: str) -> tuple[Number, ...]:
        """Return the numbers of a record without records inside, integers too."""
        found: list[Number] = []
        for row in self.rows(record):
            for axis in range(self.count(row)):
                member = row.member if self.count(row) == 1 else f"{row.member}[{axis}]"
                found.append(Number(row, axis, member, len(found)))
        return tuple(found)

    def reals(self, record: str) -> tuple[Number, ...]:
        """Return the same less the integers, which come last."""
        return tuple(number for number in self.numbers(record) if number.row.kind == NUMBER)

    def wholes(self, record: str) -> tuple[Number, ...]:
        """Return the integers."""
        return tuple(number for number in self.numbers(record) if number.row.kind == WHOLE)

    def quantities(self, record: str) -> tuple[str, ...]:
        """Return the quantity of each number of a record."""
        return tuple(number.quantity for number in self.numbers(record))

    def distinct(self, records: Iterable[str], *others: str) -> list[str]:
        """Return the quantities of the numbers of records, and others, each once."""
        found = [one.quantity for record in records for one in self.reals(record)]
        return [*dict.fromkeys([*found, *others])]

    def step_row(self, *, wholes: bool = True) -> tuple[StepNumber, ...]:
        """Return the inputs of a step in one row: state and target, the thrust before what of it is optional.

        With a height state and target, and no thrust. Without `wholes` only numbers that are no integers.
        """
        of = self.numbers if wholes else self.reals
        target = [("target", one.member, one.quantity) for one in of("target")]
        if "height" not in self.parts:
            optional = [place for place, one in enumerate(of("target")) if one.row.when]
            target.insert(min(optional, default=len(target)), ("thrust", "", "thrust"))
        row = [*(("state", one.member, one.quantity) for one in of("state")), *target]
        return tuple(StepNumber(*one, column) for column, one in enumerate(row))

    def thrust_column(self, *, wholes: bool = True) -> int | None:
        """Return the column of the thrust in such a row; None with a height."""
        found = [one.column for one in self.step_row(wholes=wholes) if one.record == "thrust"]
        return found[0] if found else None

    @property
    def axes(self) -> int:
        """Along how many axes there is a position."""
        return self.quantities("state").count("position")

    @property
    def shift(self) -> tuple[str, ...]:
        """Return the quantity of each number by which a frame jumps: positions, velocities and heading."""
        state = self.quantities("state")
        return tuple(one for one in ("position", "velocity", "yaw") for each in state if each == one)

    @property
    def records(self) -> list[tuple[str, str]]:
        """The name of each record inside nmpc_t, the innermost first, and what nmpc.h says of it."""
        inside, found = [*self.rows("controller")], set()
        while inside:
            row = inside.pop()
            if row.kind in self._table:
                found.add(row.kind)
                inside += self.rows(row.kind)
        return [(name, WORDS.get(name, "")) for name in KEPT[self.method] if name in found]

    @property
    def macros(self) -> list[tuple[str, str]]:
        """The macros by which nmpc.h says which parts are there, and what each means."""
        return [macro for part, macro in MACROS.items() if part in self.parts]

    def members(self, record: str, number: str = NUMBER) -> list[Member]:
        """Return the members of a record's struct, whose numbers have the type `number`."""
        return [
            Member(
                self._type(row, number),
                row.member if row.count == 1 else f"{row.member}[{row.count}]",
                self._comment(record, row) if number == NUMBER else row.unit,
            )
            for row in self.rows(record)
        ]

    def _type(self, row: PortRow, number: str) -> str:
        """Return the type of a member in C."""
        if row.kind == NUMBER:
            return number
        return f"nmpc_{row.kind}_t" if row.kind in self._table else row.kind

    def _comment(self, record: str, row: PortRow) -> str:
        """Return the comment of a member."""
        range_of = RANGES.get(row.quantity) if record in _CHECKED else None
        words = [row.words.format_map(self.names)] if row.words else []
        if range_of:
            words.append(f"within +/- {range_of}{row.note}")
        if record in TAKEN and "fixed" in self.parts and row.quantity in _NAMED_BITS:
            words.append(f"has {_NAMED_BITS[row.quantity]}")
        told = "; ".join(words)
        return f"{told}, {row.unit}" if row.unit else told
