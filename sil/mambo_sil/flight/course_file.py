"""Read courses from CSV files: rows of numbers under a header; messages name file, line, column and rule."""

import contextlib
import csv
import io
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from mambo_codegen.errors import echo
from mambo_codegen.plain_file import guess_name, read_plain_file
from mambo_sil.errors import TrajectoryError

LARGEST_FILE_BYTES: Final = 10_000_000


@contextlib.contextmanager
def named(path: Path) -> Iterator[None]:
    """Put the name of a file before what a block raises, which becomes a `TrajectoryError`."""
    name = echo(str(path))
    try:
        yield
    except OSError as error:
        raise TrajectoryError(f"{name}: cannot be read: {error.strerror}{guess_name(path)}") from error
    except UnicodeDecodeError:
        raise TrajectoryError(f"{name}: is not UTF-8; save the file as UTF-8") from None
    except TrajectoryError as error:
        raise TrajectoryError(f"{name}: {error}") from None


def read_text(path: Path) -> str:
    """Return the text of a file in a block of `named`."""
    content = read_plain_file(path, LARGEST_FILE_BYTES + 1)
    if len(content) > LARGEST_FILE_BYTES:
        raise TrajectoryError("is larger than 10 MB; some thousand rows take less")
    return content.decode("utf-8-sig")


def header_of(text: str) -> list[str]:
    """Return the names of a CSV file's columns, in lower case; none if its first line is not CSV."""
    with contextlib.suppress(csv.Error):
        return [name.strip().lower() for name in next(csv.reader(io.StringIO(text, newline="")), [])]
    return []


def rows_of(
    text: str, columns: Sequence[str], may_be_empty: Sequence[str] = ()
) -> dict[str, tuple[float, ...]]:
    """Return the numbers under `columns` of every row of a CSV file that is not blank, by its line.

    may_be_empty: columns whose fields may be empty: NaN.

    Raises `TrajectoryError`, which names line, column and rule.
    """
    rows, found = csv.reader(io.StringIO(text, newline=""), strict=True), {}
    try:
        header = [name.strip().lower() for name in next(rows, [])]
        for column in columns:
            if header.count(column) != 1:
                fault = "appears more than once" if column in header else "is missing"
                raise TrajectoryError(
                    f"line 1: column {column} {fault}; the header must name {','.join(columns)}"
                )
        for row in filter(None, rows):
            line = f"line {rows.line_num}"
            if len(row) > len(header):
                raise TrajectoryError(f"{line}: has more fields than the {len(header)} of the header")
            found[line] = tuple(
                _number(row[header.index(name) :][:1], line, name, may_be_empty=name in may_be_empty)
                for name in columns
            )
    except csv.Error as error:
        raise TrajectoryError(f"line {rows.line_num}: is not CSV: {error}") from None
    return found


def _number(field: Sequence[str], line: str, column: str, *, may_be_empty: bool) -> float:
    """Return one field of a CSV row as a number; no field is one missing at the end of the row."""
    text = "".join(field)
    if not text.strip():
        if may_be_empty:
            return math.nan
        raise TrajectoryError(f"{line}: {column} is missing")
    try:
        return float(text)
    except ValueError:
        raise TrajectoryError(f"{line}: {column} = {echo(text)} must be a number") from None
