"""The folder of a campaign: its identity, and the database of finished flights, which survives a killed run.

`campaign.json` identifies the campaign and marks the folder. `flights.sqlite` has a row for each finished
flight; the rows of a batch are one transaction. `flights.csv` is exported from it, sorted by flight.
"""

import contextlib
import hashlib
import json
import math
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from mambo_codegen import __version__
from mambo_codegen.atomic import put, put_stream
from mambo_codegen.errors import ForeignFilesError, UnwritableError, echo
from mambo_sil.errors import WorkerError
from mambo_sil.results.folders import GENERATOR, create_folder, lock

DATABASE: Final = "flights.sqlite"
TABLE: Final = "flights.csv"
FLIGHT: Final = "flight"
"""Column with the number of a flight."""

LINE_DIGEST: Final = "line_sha256"
"""Title of the last column of the CSV: `_DIGITS` digits of a SHA-256 of the campaign and the line."""

_DIGITS: Final = 16

Value = float | str


class FlightStore:
    """The open folder of a campaign; `finished` holds the numbers of the finished flights."""

    def __init__(self, folder: Path, columns: Sequence[str], key: str) -> None:
        self.folder = folder
        self._key = key
        self._titles = (FLIGHT, *columns)
        self._path = folder / DATABASE
        with convert_os_errors(self._path):
            _refuse_special_file(self._path)
            self._database = sqlite3.connect(self._path)
            self.finished = self._open()

    def close(self) -> None:
        """Close the database."""
        self._database.close()

    def add(self, rows: Mapping[int, Mapping[str, Value]]) -> None:
        """Insert finished flights in one transaction; raises UnwritableError."""
        cells = [(flight, *(row[title] for title in self._titles[1:])) for flight, row in rows.items()]
        places = ", ".join("?" * len(self._titles))
        with (
            convert_os_errors(
                self._path, "; the finished flights are kept, and the same command continues from there"
            ),
            self._database,
        ):
            self._database.executemany(f"INSERT INTO flights VALUES ({places})", cells)
        self.finished |= rows.keys()

    def export(self) -> None:
        """Write the CSV, atomically: number, seed, draws, results and digest of the line of each flight."""
        with convert_os_errors(self.folder), put_stream(self.folder / TABLE) as file:
            file.write(",".join((*self._titles, LINE_DIGEST)).encode() + b"\n")
            for row in self.rows():
                start = ",".join(map(str, row.values()))
                digest = hashlib.sha256(f"{self._key},{start}".encode()).hexdigest()[:_DIGITS]
                file.write(f"{start},{digest}\n".encode())

    def rows(self) -> Iterator[dict[str, Value]]:
        """Yield the cells of each flight by column, in the order of the flights."""
        return read_rows(self._database)

    def row(self, flight: int) -> dict[str, Value]:
        """Return the cells of a finished flight by column."""
        return _one(self._database, flight)

    def _open(self) -> set[int]:
        """Create the table if it is missing, and return the numbers of the flights in it.

        Raises ForeignFilesError for a file that is not the database of this campaign.
        """
        columns = ", ".join(f'"{title}"' for title in self._titles[1:])
        try:
            self._database.execute(
                f"CREATE TABLE IF NOT EXISTS flights ({FLIGHT} INTEGER PRIMARY KEY, {columns})"
            )
            found = self._database.execute("SELECT * FROM flights LIMIT 0").description
            if tuple(column[0] for column in found) == self._titles:
                return {flight for (flight,) in self._database.execute(f"SELECT {FLIGHT} FROM flights")}
        except sqlite3.OperationalError:
            raise
        except sqlite3.DatabaseError:
            pass
        name = echo(str(self._path))
        raise ForeignFilesError(
            f"{name}: is not the database of this campaign; move it away, or name another folder with -o",
            (str(self._path),),
        )


def read_rows(database: sqlite3.Connection, which: str = "") -> Iterator[dict[str, Value]]:
    """Yield the cells of each flight by column, in the order of the flights; SQLite stores NaN as NULL."""
    found = database.execute(f"SELECT * FROM flights {which} ORDER BY {FLIGHT}")
    titles = [column[0] for column in found.description]
    for row in found:
        yield {title: math.nan if cell is None else cell for title, cell in zip(titles, row, strict=True)}


def read_flight(path: Path, flight: int) -> dict[str, Value]:
    """Return the cells of a flight in the database at `path`; raises KeyError or sqlite3.Error."""
    with contextlib.closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as database:
        return _one(database, flight)


def _one(database: sqlite3.Connection, flight: int) -> dict[str, Value]:
    """Return the cells of a flight; raises KeyError if there is none."""
    for row in read_rows(database, f"WHERE {FLIGHT} = {flight}"):
        return row
    raise KeyError(flight)


def _refuse_special_file(path: Path) -> None:
    """Raise ForeignFilesError for a link, a folder and the like."""
    if path.is_symlink() or (path.exists() and not path.is_file()):
        raise ForeignFilesError(f"{echo(str(path))}: is not a plain file; move it away", (str(path),))


@contextlib.contextmanager
def open_store(
    folder: Path, campaign: Mapping[str, Any], columns: Sequence[str], beside: Mapping[str, Any]
) -> Iterator[FlightStore]:
    """Open and lock `folder` for a run of `campaign`.

    beside: what campaign.json has, too, and what no result depends on.

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
        claim(folder, "campaign", {"command": "campaign", **campaign}, beside)
        store = stack.enter_context(contextlib.closing(FlightStore(folder, columns, key)))
        try:
            yield store
        except WorkerError:
            if new and not store.finished:
                for path in folder.iterdir():
                    path.unlink()
            raise


@contextlib.contextmanager
def convert_os_errors(place: Path, advice: str = "") -> Iterator[None]:
    """Convert an OSError at or below `place`, or an error of the database there, to an UnwritableError."""
    try:
        yield
    except OSError as error:
        name = echo(str(error.filename or place))
        raise UnwritableError(f"{name}: cannot be written: {error.strerror or error}{advice}") from error
    except sqlite3.Error as error:
        raise UnwritableError(f"{echo(str(place))}: cannot be written: {error}{advice}") from error


def claim(
    folder: Path, kind: str, identity: Mapping[str, Any], beside: Mapping[str, Any] | None = None
) -> None:
    """Write `identity` to `<kind>.json` in an empty folder, or compare it with the one that is there.

    `beside` is written, too, and not compared.
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
        _write(path, identity | dict(beside or {}))
        return
    if held["generator"] != identity["generator"]:
        raise ForeignFilesError(
            f"{name}: holds a {kind} of {echo(str(held['generator']))}, which this version does not read; "
            "go on with that version, or name another folder with -o",
            (),
        )
    compared = {key: value for key, value in held.items() if key not in (beside or {})}
    difference = _difference("", compared, json.loads(json.dumps(identity)))
    if difference:
        raise ForeignFilesError(
            f"{name}: holds another {kind}, {difference}; name another folder with -o", ()
        )
    if compared | dict(beside or {}) != held:
        _write(path, identity | dict(beside or {}))


def _write(path: Path, document: Mapping[str, Any]) -> None:
    with convert_os_errors(path.parent):
        put(path, (json.dumps(document, indent=2) + "\n").encode())


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
