"""The log of a flight as CSV, which `mambo-nmpc replay` and `identify` read."""

import csv
import itertools
import sys
import tempfile
from pathlib import Path
from typing import TextIO

from .calls import Rows
from .radio import GROUP, LOGGED


def save(path: Path, rows: Rows) -> None:
    """Write the log to a new file, and print what it has.

    In the folder of `path`, else in another one, else on the terminal.
    """
    for folder in (path.parent, Path(tempfile.gettempdir()), Path.home()):
        try:
            written = write(folder / path.name, rows)
        except OSError as error:
            print(f"The log cannot be written to {folder / path.name}: {error.strerror}.", file=sys.stderr)
            continue
        refused = sum(row.get(f"{GROUP}.status", 0) != 0 for row in rows.values())
        print(f"{written}: {len(rows)} rows, {refused} refused updates")
        return
    write_rows(sys.stdout, rows)


def write(path: Path, rows: Rows) -> Path:
    """Write the log to `path`, or if there is such a file to one with a number; return which."""
    for number in itertools.count(1):
        name = path if number == 1 else path.with_stem(f"{path.stem}-{number}")
        try:
            with name.open("x", newline="", encoding="utf-8") as file:
                write_rows(file, rows)
        except FileExistsError:
            continue
        except OSError:
            name.unlink(missing_ok=True)  # half a log
            raise
        return name
    raise AssertionError("the numbers do not end")


def write_rows(file: TextIO, rows: Rows) -> None:
    """Write the log as CSV."""
    writer = csv.writer(file)
    names = list(dict.fromkeys(name for block in LOGGED for name in block))
    writer.writerow(["Timestamp", *names])
    for timestamp in sorted(rows):
        writer.writerow([timestamp, *(rows[timestamp].get(name, "") for name in names)])
