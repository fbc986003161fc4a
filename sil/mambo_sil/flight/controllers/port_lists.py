"""The rows of the port as C: lists of members that the glue beside a bundle goes through."""

from collections.abc import Iterator
from typing import Final

from mambo_codegen.port.row import WHOLE, PortRow
from mambo_codegen.port.taken import MACROS, TAKEN
from mambo_sil.flight.columns import COMMAND, STATE, TARGET

_PLACES: Final = {"state": STATE, "target": TARGET, "command": COMMAND}


_WHOLE_OF: Final = (
    "#define WHOLE_OF(number) "
    "(((number) >= 0) && ((number) < 100) && !((number) > (WHOLE_TYPE)(int)(number)) ? "
    "(int)(number) : 100)"
)
"""An integer of a number of the type WHOLE_TYPE, which each file defines.

A fraction, NaN, and what is less than 0 or large become 100, which no `known` is.
"""


def port_lists() -> str:
    """Return macros STATE_REALS(EACH), STATE_WHOLES(EACH), and so on of target and command, and LIMITS_REALS.

    They expand to EACH(member, column in the closed loop, quantity) for each number of nmpc_state_t in its
    order, integers apart. NMPC_HAS_WHOLES is there where a state or a target has an integer.
    """
    lines = [_WHOLE_OF]
    for record in (*_PLACES, "limits"):
        for kind, is_whole in (("REALS", False), ("WHOLES", True)):
            rows = [row for row in TAKEN[record] if (row.kind == WHOLE) == is_whole]
            names = [f"{record.upper()}_{kind}_{number}" for number in range(len(rows))]
            for name, row in zip(names, rows, strict=True):
                lines += _listed(name, row, record)
            lines.append(
                f"#define {record.upper()}_{kind}(EACH) {' '.join(f'{name}(EACH)' for name in names)}"
            )
    return "\n".join(lines) + "\n"


def _listed(name: str, row: PortRow, record: str) -> Iterator[str]:
    """Yield the lines of the list of one row, which is empty where the controller has not got it."""
    conditions = [f"defined({MACROS[part][0]})" for part in row.when]
    entries = " ".join(_entries(row, record))
    if conditions:
        yield f"#if {' && '.join(conditions)}"
    yield f"#define {name}(EACH) {entries}"
    if row.kind == WHOLE and record in ("state", "target"):
        yield "#define NMPC_HAS_WHOLES 1"
    if conditions:
        yield "#else"
        yield f"#define {name}(EACH)"
        yield "#endif"


def _entries(row: PortRow, record: str) -> Iterator[str]:
    """Yield an entry for each number of a row; of limits, which are not in the loop, with column 0."""
    assert isinstance(row.count, int), "what is taken has a size"
    first = _PLACES[record][row.member].start if record in _PLACES else 0
    for axis in range(row.count):
        member = row.member if row.count == 1 else f"{row.member}[{axis}]"
        yield f"EACH({member}, {first + axis}, {row.quantity.upper()})"
