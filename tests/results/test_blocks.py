"""A result, written once: what the console, a page and Markdown make of its blocks."""

from pathlib import Path

import pytest
from markupsafe import Markup

from mambo_sil.results.blocks import (
    CommandResult,
    Commands,
    Details,
    Facts,
    Listing,
    MovingPicture,
    Note,
    Picture,
    ResultTable,
    Sentence,
)
from mambo_sil.results.html_page import results_page
from mambo_sil.results.terminal import result_text

TABLE = ResultTable(
    ("board", "flash", "clock", "core"), [("mega", "14", "16", "AVR, 5 m^2")], (0, -1), (2,), "all boards"
)
TEXT = """\
mine: it fits
by little
a sentence

all boards
board  flash  core
mega      14  AVR, 5 m^2

name  value

to see more
the worst
    mambo-nmpc fly --repeat out/x^2.json"""


def found(folder: Path) -> CommandResult:
    """Return a result with every kind of block, two of them empty."""
    return CommandResult(
        "A title",
        None,
        ["it fits", "by little"],
        [
            Sentence("a sentence"),
            Note("an explanation"),
            Facts({"fact": "what was run"}),
            TABLE,
            ResultTable((), [("name", "value")]),
            ResultTable(("empty",), []),
            Commands("to see more", [("the worst", "mambo-nmpc fly --repeat out/x^2.json")]),
            Commands("nothing more", []),
            Picture(lambda: [Markup("<b>drawn</b>")], "a caption", [folder / "here.csv"]),
            MovingPicture(lambda: [Markup("<i>moves</i>")], "", [folder / "gone.csv"]),
            Details("folded", [Listing("a <listing>")]),
        ],
        "mine",
    )


def test_the_console_has_the_answer_tables_and_commands(tmp_path: Path) -> None:
    """It leaves out pictures, explanations and what was run; an empty block is nothing."""
    assert result_text(found(tmp_path)) == TEXT


def test_a_page_has_every_block(tmp_path: Path) -> None:
    """With all columns, and the signs of print, which no command has; no script without what moves."""
    (tmp_path / "here.csv").touch()
    page = results_page([("out", found(tmp_path))], ["mine"])
    for words in (
        "by little",
        "an explanation",
        "what was run",
        ">16<",
        "AVR, 5 m²",
        "out/x^2.json",
        "folded",
    ):
        assert words in page, words
    assert "<b>drawn</b>" in page
    assert "a &lt;listing&gt;" in page
    assert "Missing in out and therefore not shown: gone.csv" in page
    for words in ("moves", "empty", "nothing more", "<script>"):
        assert words not in page, words
    (tmp_path / "gone.csv").touch()
    page = results_page([("out", found(tmp_path))], ["mine"])
    assert "<i>moves</i>" in page
    assert "<script>" in page


@pytest.mark.parametrize("table", [TABLE, TABLE.narrow()])
def test_a_table_is_markdown_too(table: ResultTable) -> None:
    """A row a line."""
    lines = table.markdown().splitlines()
    assert [line.count("|") for line in lines] == [len(table.heads) + 1] * 3
    assert lines[2].startswith("| mega | 14 | ")
