"""The table of a campaign as text: one line per flight, which ends in a digest of the line.

A line is number, seed, draws, results and digest, joined by commas; no cell holds a comma or a quote. The
digest covers the campaign, too: a line that was edited, or that another campaign has drawn, is noticed.
"""

import hashlib
from collections.abc import Callable, Container, Mapping, Sequence
from typing import Final

from mambo_codegen.errors import ForeignFilesError, echo
from mambo_sil.experiment.campaign.parameters import TRAJECTORY, Draw

FLIGHT: Final = "flight"
LINE_DIGEST: Final = "line_sha256"
"""Title of the last column: the first `_DIGITS` digits of a SHA-256 of the campaign and the line."""

_DIGITS: Final = 16
_MOST_FLIGHT_DIGITS: Final = 9
_TEXT: Final = "_sha256"
"""End of the title of a column that holds no number."""

Value = float | str


def is_number(title: str) -> bool:
    """Return whether the column of this title holds numbers."""
    return title != TRAJECTORY and not title.endswith(_TEXT)


def header(columns: Sequence[str]) -> str:
    """Return the first line of a table with these columns between flight and digest."""
    return ",".join((FLIGHT, *columns, LINE_DIGEST)) + "\n"


def line(flight: int, columns: Sequence[str], row: Mapping[str, Value], key: str) -> str:
    """Return the line of a flight whose cells `row` has by column; its digest covers `key` as well."""
    start = ",".join([str(flight), *(str(row[title]) for title in columns)])
    return f"{start},{_digest(start, key)}\n"


def read_lines(
    text: str, columns: Sequence[str], key: str, draw: Callable[[int], Draw], name: str
) -> dict[int, str]:
    """Return the lines of the table `text` by flight; `draw` returns what the campaign draws for a flight.

    Raises ForeignFilesError, which begins with `name`, for a line that was not written with this `key`.
    """
    titles = (FLIGHT, *columns, LINE_DIGEST)
    found: dict[int, str] = {}
    for number, whole in enumerate(text.split("\n")[:-1], start=1):
        start, _, digest = whole.rpartition(",")
        cells = whole.split(",")
        if number == 1:
            fault = None if f"{whole}\n" == header(columns) else "must be the header of this campaign's table"
        elif len(cells) != len(titles):
            fault = f"must have {len(titles)} cells, not {len(cells)}"
        elif digest == _digest(start, key) and int(cells[0]) not in found:
            fault = None
        else:
            fault = _find_fault(dict(zip(titles, cells, strict=True)), draw, found)
        if fault is not None:
            raise ForeignFilesError(
                f"{name}: line {number} is not a line of this campaign, the table was edited: {fault}; "
                "restore it, or name another folder with -o",
                (name,),
            )
        if number > 1:
            found[int(cells[0])] = f"{whole}\n"
    return found


def read_number(cell: str) -> float:
    """Return the number in a cell; raises ValueError, "must be a number"."""
    try:
        return float(cell)
    except ValueError:
        raise ValueError(f"{echo(cell) or 'an empty cell'} must be a number") from None


def _find_fault(cells: Mapping[str, str], draw: Callable[[int], Draw], before: Container[int]) -> str:
    """Return the first wrong cell of a wrong line, and its rule; `before` has the flights above it."""
    flight = cells[FLIGHT]
    if not (flight.isascii() and flight.isdigit() and len(flight) <= _MOST_FLIGHT_DIGITS):
        return f"{FLIGHT}: {echo(flight)} must be the number of a flight"
    if int(flight) in before:
        return f"{FLIGHT}: {flight} must not be that of an earlier line"
    drawn = draw(int(flight))
    for title, value in drawn.items():
        if cells[title] != str(value):
            return f"{title}: {echo(cells[title])} must be {value}, the draw of flight {int(flight)}"
    for title in cells:
        if is_number(title):
            try:
                read_number(cells[title])
            except ValueError as error:
                return f"{title}: {error}"
    return f"{LINE_DIGEST}: {echo(cells[LINE_DIGEST])} must be the digest of the line: a result was changed"


def _digest(start: str, key: str) -> str:
    """Return the digest of `key` and a line's text before its last comma."""
    return hashlib.sha256(f"{key},{start}".encode()).hexdigest()[:_DIGITS]
