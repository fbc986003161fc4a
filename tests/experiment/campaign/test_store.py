"""The database of a campaign: what is stored reads back to the bit, and becomes the CSV."""

import contextlib
import hashlib
import math
import sqlite3
from pathlib import Path

import pytest

from mambo_codegen.errors import ForeignFilesError, UnwritableError
from mambo_sil.experiment.campaign.store import DATABASE, TABLE, FlightStore, Value

KEY = "ab" * 32
COLUMNS = ("seed", "trajectory", "mass_kg", "pd_iae_m_s", "pd_trace_sha256")


def flown(flight: int, iae_m_s: float = 0.1 + 0.2) -> dict[str, Value]:
    """Return draws and results of a flight."""
    return dict(zip(COLUMNS, (7 + flight, "circle", 0.07, iae_m_s, "cd"), strict=True))


def test_a_line_is_number_cells_and_digest(tmp_path: Path) -> None:
    """Sixteen digits of the SHA-256 of key and cells; numbers have all their digits; flights are in order."""
    with contextlib.closing(FlightStore(tmp_path, COLUMNS, KEY)) as store:
        store.add({3: flown(3)})
        store.add({0: flown(0), 2: flown(2)})
        store.export()
    header, *lines = (tmp_path / TABLE).read_text("utf-8").splitlines()
    assert header == "flight,seed,trajectory,mass_kg,pd_iae_m_s,pd_trace_sha256,line_sha256"
    cells = "3,10,circle,0.07,0.30000000000000004,cd"
    assert lines[2] == f"{cells},{hashlib.sha256(f'{KEY},{cells}'.encode()).hexdigest()[:16]}"
    assert [line.partition(",")[0] for line in lines] == ["0", "2", "3"]


@pytest.mark.parametrize(
    "number", [0, 1, 2**63 - 1, 0.0, -0.0, 1.0, 0.1 + 0.2, 5e-324, 1e300, math.nan, math.inf, -math.inf]
)
def test_a_number_reads_back_as_it_was_written(number: float, tmp_path: Path) -> None:
    """Integers as integers, and every real with its spelling, that of a lost flight too."""
    with contextlib.closing(FlightStore(tmp_path, COLUMNS, KEY)) as store:
        store.add({0: flown(0, number)})
    with contextlib.closing(FlightStore(tmp_path, COLUMNS, KEY)) as store:
        (row,) = store.rows()
        assert store.finished == {0}
    assert str(row["pd_iae_m_s"]) == str(number)
    assert list(row.items())[:4] == [("flight", 0), ("seed", 7), ("trajectory", "circle"), ("mass_kg", 0.07)]


def test_a_batch_is_stored_whole_or_not_at_all(tmp_path: Path) -> None:
    """A flight that is there already undoes its batch."""
    with contextlib.closing(FlightStore(tmp_path, COLUMNS, KEY)) as store:
        store.add({1: flown(1)})
        with pytest.raises(UnwritableError, match=r"flights\.sqlite: cannot be written: UNIQUE.*continues"):
            store.add({0: flown(0), 1: flown(1)})
        assert store.finished == {1}
    with contextlib.closing(FlightStore(tmp_path, COLUMNS, KEY)) as store:
        assert store.finished == {1}


@pytest.mark.parametrize("kind", ["text", "other columns", "folder", "link"])
def test_what_is_not_the_database_of_the_campaign_is_refused(kind: str, tmp_path: Path) -> None:
    """It stays as it is."""
    path = tmp_path / DATABASE
    match kind:
        case "text":
            path.write_text("thesis " * 1000, "utf-8")
        case "other columns":
            with contextlib.closing(sqlite3.connect(path)) as database:
                database.execute("CREATE TABLE flights (flight INTEGER PRIMARY KEY, seed)")
        case "folder":
            path.mkdir()
        case "link":
            path.symlink_to("elsewhere")
    before = path.read_bytes() if path.is_file() else None
    rule = "is not the database of this campaign" if before else "is not a plain file"
    with pytest.raises(ForeignFilesError, match=rf"flights\.sqlite: {rule}; move it away"):
        FlightStore(tmp_path, COLUMNS, KEY)
    assert (path.read_bytes() if path.is_file() else None) == before
