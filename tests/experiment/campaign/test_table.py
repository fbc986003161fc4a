"""The table of a campaign as text: what is written reads back, and no other line is taken."""

import hashlib

import pytest

from mambo_codegen.errors import ForeignFilesError
from mambo_sil.experiment.campaign.parameters import Draw
from mambo_sil.experiment.campaign.table import header, is_number, line, read_lines, read_number

KEY = "ab" * 32
COLUMNS = ("seed", "trajectory", "mass_kg", "pd_iae_m_s", "pd_trace_sha256")


def draw(flight: int) -> Draw:
    """Return the draws of a flight."""
    return {"seed": 7 + flight, "trajectory": "circle", "mass_kg": 0.07}


def written(flight: int, key: str = KEY, **changes: float | str) -> str:
    """Return the line of a flight."""
    results: dict[str, float | str] = {"pd_iae_m_s": 0.1 + 0.2, "pd_trace_sha256": "cd"}
    return line(flight, COLUMNS, draw(flight) | results | changes, key)


def read(*lines: str) -> dict[int, str]:
    """Read a table."""
    return read_lines("".join(lines), COLUMNS, KEY, draw, "flights.csv")


def test_a_line_is_number_cells_and_digest() -> None:
    """Sixteen digits of the SHA-256 of key and cells; numbers have all their digits."""
    cells = "3,10,circle,0.07,0.30000000000000004,cd"
    digest = hashlib.sha256(f"{KEY},{cells}".encode()).hexdigest()[:16]
    assert written(3) == f"{cells},{digest}\n"
    assert header(COLUMNS) == "flight,seed,trajectory,mass_kg,pd_iae_m_s,pd_trace_sha256,line_sha256\n"


def test_lines_read_back_by_flight() -> None:
    """In any order; a last line without its end was not finished, and does not count."""
    lines = [written(2), written(0), written(123_456_789)]
    assert read(header(COLUMNS), *lines) == {2: lines[0], 0: lines[1], 123_456_789: lines[2]}
    assert read(header(COLUMNS), lines[0], lines[1][:-1]) == {2: lines[0]}
    assert read(header(COLUMNS)) == read() == {}


def edited(column: str, cell: str) -> str:
    """Return the line of flight 2 with another cell and the old digest."""
    cells = dict(zip(header(COLUMNS).strip().split(","), written(2).strip().split(","), strict=True))
    return ",".join((cells | {column: cell}).values()) + "\n"


@pytest.mark.parametrize(
    ("wrong", "fault"),
    [
        (written(2, "cd" * 32), "line_sha256: [0-9a-f]{16} must be the digest of the line: a result was"),
        (edited("seed", "8"), "seed: 8 must be 9, the draw of flight 2"),
        (edited("trajectory", "hover"), "trajectory: hover must be circle, the draw of flight 2"),
        (edited("pd_iae_m_s", "0.3"), "line_sha256: .* must be the digest of the line: a result was changed"),
        (edited("pd_iae_m_s", "fast"), "pd_iae_m_s: fast must be a number"),
        (edited("pd_iae_m_s", ""), "pd_iae_m_s: an empty cell must be a number"),
        (edited("pd_trace_sha256", "ef"), "line_sha256: .* must be the digest of the line"),
        (edited("line_sha256", "0" * 16), "line_sha256: 0000000000000000 must be the digest of the line"),
        (edited("flight", "x"), "flight: x must be the number of a flight"),
        (edited("flight", "-2"), "flight: -2 must be the number of a flight"),
        (edited("flight", "\u0662"), "flight: .* must be the number of a flight"),
        (edited("flight", "1234567890"), "flight: 1234567890 must be the number of a flight"),
        (edited("flight", "123456789"), "seed: 9 must be 123456796, the draw of flight 123456789"),
        (edited("flight", "5"), "flight: 5 must not be that of an earlier line"),
        (written(5), "flight: 5 must not be that of an earlier line"),
        ("2,3\n", "must have 7 cells, not 2"),
        ("\n", "must have 7 cells, not 1"),
        (header(COLUMNS), "flight: flight must be the number of a flight"),
    ],
)
def test_a_line_that_the_campaign_did_not_write_is_refused(wrong: str, fault: str) -> None:
    """Its number, the first wrong cell and the rule are named."""
    with pytest.raises(ForeignFilesError, match=rf"^flights\.csv: line 3 is not a line .*: {fault}"):
        read(header(COLUMNS), written(5), wrong)


def test_the_header_is_the_first_line() -> None:
    """A table without it, or with other columns, is not this campaign's."""
    for first in (written(0), header(COLUMNS[1:])):
        with pytest.raises(
            ForeignFilesError, match=r"line 1 .*: must be the header of this campaign's table"
        ):
            read(first, written(1))


def test_cells_that_hold_text_are_no_numbers() -> None:
    """The curve and all digests; every other cell is a number, a lost flight's is NaN."""
    numbers = [title for title in header(COLUMNS).strip().split(",") if is_number(title)]
    assert numbers == ["flight", "seed", "mass_kg", "pd_iae_m_s"]
    assert read_number("-1e-300") == -1e-300
    assert str(read_number("nan")) == "nan"
