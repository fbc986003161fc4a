"""The folder of a campaign: its identity, and the table of finished flights, which survives a killed run.

`campaign.json` identifies the campaign and marks the folder. `flights.csv` has one line per finished flight.
A batch is appended and flushed to the disk as soon as it returns. The next run drops a last line that a kill
or a full disk truncated. When all flights are finished the lines are sorted by flight.
"""

import contextlib
import hashlib
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from mambo_codegen import __version__
from mambo_codegen.atomic import put
from mambo_codegen.errors import ForeignFilesError, UnwritableError, echo
from mambo_sil.errors import WorkerError
from mambo_sil.experiment.campaign.parameters import Draw
from mambo_sil.experiment.campaign.table import FLIGHT, Value, header, line, read_lines
from mambo_sil.results.folders import GENERATOR, create_folder, lock

TABLE: Final = "flights.csv"


class FlightStore:
    """The open folder of a campaign; `lines` holds the table's line of each finished flight by number."""

    def __init__(self, folder: Path, columns: Sequence[str], key: str, draw: Callable[[int], Draw]) -> None:
        self.folder = folder
        self._key = key
        self._columns = columns
        self._table = folder / TABLE
        self.lines = self._read(draw)
        self._file = self._table.open("ab", buffering=0)

    def close(self) -> None:
        """Close the table."""
        self._file.close()

    def add(self, rows: Mapping[int, Mapping[str, Value]]) -> None:
        """Append finished flights and flush them to the disk; raises UnwritableError."""
        lines = {flight: line(flight, self._columns, row, self._key) for flight, row in rows.items()}
        with convert_os_errors(
            self._table, "; the finished flights are kept, and the same command continues from there"
        ):
            left = memoryview("".join(lines.values()).encode())
            while left:
                left = left[self._file.write(left) :]
            os.fsync(self._file.fileno())
        self.lines |= lines

    def put_in_order(self) -> None:
        """Sort the table by flight, atomically."""
        ordered = [header(self._columns), *(self.lines[flight] for flight in sorted(self.lines))]
        with convert_os_errors(self.folder):
            put(self._table, "".join(ordered).encode())

    def rows(self) -> Iterator[dict[str, str]]:
        """Yield the cells of each flight by column, in the order of the flights."""
        for flight in sorted(self.lines):
            cells = self.lines[flight].rstrip("\n").split(",")[:-1]
            yield dict(zip((FLIGHT, *self._columns), cells, strict=True))

    def _read(self, draw: Callable[[int], Draw]) -> dict[int, str]:
        """Return the lines of an earlier run by flight, after removing a truncated last line.

        Raises ForeignFilesError for a table that this campaign did not write.
        """
        name = echo(str(self._table))
        with convert_os_errors(self.folder):
            if self._table.is_symlink() or (self._table.exists() and not self._table.is_file()):
                raise ForeignFilesError(f"{name}: is not a plain file; move it away", (str(self._table),))
            content = self._table.read_bytes() if self._table.exists() else b""
            whole = content[: content.rfind(b"\n") + 1]
            if not whole:
                put(self._table, header(self._columns).encode())
                return {}
            lines = read_lines(whole.decode("utf-8", "replace"), self._columns, self._key, draw, name)
            if len(whole) < len(content):
                os.truncate(self._table, len(whole))
        return lines


@contextlib.contextmanager
def open_store(
    folder: Path, campaign: Mapping[str, Any], columns: Sequence[str], draw: Callable[[int], Draw]
) -> Iterator[FlightStore]:
    """Open and lock `folder` for a run of `campaign`, which draws flight n as `draw(n)`.

    Raises ForeignFilesError for a folder with other files or another campaign, BusyError if another run has
    locked it, UnwritableError if the file system refuses an access. A folder that is new, in which no flight
    finishes because the workers fail, is removed.
    """
    key = hashlib.sha256(json.dumps(campaign, sort_keys=True).encode()).hexdigest()
    with contextlib.ExitStack() as stack:
        with convert_os_errors(folder):
            stack.enter_context(create_folder(folder))
        stack.enter_context(lock(folder))
        new = not any(folder.iterdir())
        claim(folder, "campaign", {"command": "campaign", **campaign})
        store = stack.enter_context(contextlib.closing(FlightStore(folder, columns, key, draw)))
        try:
            yield store
        except WorkerError:
            if new and not store.lines:
                for path in folder.iterdir():
                    path.unlink()
            raise


@contextlib.contextmanager
def convert_os_errors(place: Path, advice: str = "") -> Iterator[None]:
    """Convert an OSError at or below `place` to an UnwritableError."""
    try:
        yield
    except OSError as error:
        name = echo(str(error.filename or place))
        raise UnwritableError(f"{name}: cannot be written: {error.strerror or error}{advice}") from error


def claim(folder: Path, kind: str, identity: Mapping[str, Any]) -> None:
    """Write `identity` to `<kind>.json` in an empty folder, or compare it with the one that is there.

    Raises ForeignFilesError for a folder with other files or another identity.
    """
    name, path = echo(str(folder)), folder / f"{kind}.json"
    identity = {"generator": f"{GENERATOR}{__version__}", **identity}
    try:
        held = json.loads(path.read_text("utf-8")) if path.is_file() and not path.is_symlink() else None
    except (ValueError, RecursionError):
        held = None
    if not isinstance(held, dict) or not str(held.get("generator")).startswith(GENERATOR):
        if any(not one.name.startswith(f".{path.name}") for one in folder.iterdir()):
            raise ForeignFilesError(
                f"{name}: holds files that are not from a mambo-nmpc {kind}; name another folder with -o", ()
            )
        with convert_os_errors(folder):
            put(path, (json.dumps(identity, indent=2) + "\n").encode())
        return
    difference = _difference("", held, json.loads(json.dumps(identity)))
    if difference:
        raise ForeignFilesError(
            f"{name}: holds another {kind}, {difference}; name another folder with -o", ()
        )


def _difference(where: str, held: Any, asked: Any) -> str | None:
    """Return a phrase on the first difference of two documents, or None."""
    if isinstance(held, dict) and isinstance(asked, dict):
        for key in dict.fromkeys((*held, *asked)):
            found = _difference(f"{where}.{key}" if where else key, held.get(key), asked.get(key))
            if found:
                return found
        return None
    if isinstance(held, list) and isinstance(asked, list) and len(held) == len(asked):
        pairs = enumerate(zip(held, asked, strict=True))
        differences = (_difference(f"{where}[{i}]", one, other) for i, (one, other) in pairs)
        return next((found for found in differences if found), None)
    if held == asked:
        return None
    return f"with {echo(where)} = {echo(json.dumps(held))} instead of {echo(json.dumps(asked))}"
