"""A result, written once: what console, page and Markdown make of its blocks, and what fits a terminal."""

import math
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
from mambo_sil.results.number_format import distance
from mambo_sil.results.terminal import WIDTH, result_text, sentence, table
from tests.support.command import run

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


def test_a_table_has_texts_left_and_numbers_right() -> None:
    """Headings stand on their columns; no line ends with a space."""
    found = table(("board", "flash B", ""), [("crazyflie", "5", "fits"), ("mega", "14914", "")], (0, -1))
    assert found == ["board      flash B", "crazyflie        5  fits", "mega         14914"]
    assert table((), [("a", "1"), ("bc", "23")]) == ["a    1", "bc  23"]


def test_headings_stand_in_several_lines_before_texts_are_wrapped() -> None:
    """And only if the table is too wide; its numbers stay whole."""
    heads = ("what", *["a long heading"] * 5)
    narrow = table(heads, [("short", *["1.234"] * 5)])
    assert [line.split() for line in narrow[:2]] == [["a", "long"] * 5, ["what", *["heading"] * 5]]
    wide = table(("what", "number"), [("some words " * 12, "1234567")])
    assert max(map(len, [*narrow, *wide])) <= WIDTH
    assert [line for line in wide if "1234567" in line] == [wide[1]]
    assert " ".join(wide).split().count("words") == 12


def test_words_are_not_broken() -> None:
    """A word that is wider than its column makes the table wider."""
    name = "x" * 90
    assert name in "\n".join(table(("name", "n"), [(name, "1")]))
    assert sentence(f"see {name}") == f"see\n{name}"


@pytest.mark.parametrize(
    ("value_m", "text"),
    [
        (0.0, "0 cm"),
        (0.0094494, "0.94 cm"),
        (0.1839, "18 cm"),
        (0.0300, "3 cm"),
        (0.9949, "99 cm"),
        (0.996, "1 m"),
        (4.786, "4.8 m"),
        (562.64, "560 m"),
        (math.nan, "\N{EN DASH}"),
    ],
)
def test_distances_are_in_cm_up_to_a_metre(value_m: float, text: str) -> None:
    """With two digits."""
    assert distance(value_m) == text


@pytest.mark.first_is_quick
@pytest.mark.usefixtures("in_an_empty_folder")
@pytest.mark.parametrize(
    ("arguments", "answer"),
    [
        ("fly --duration-s 20 --no-pictures", "mambo on mambo: 1.6 cm in the mean, 18 cm at most"),
        ("campaign --flights 2 -o c", "mambo: "),
        ("diff mambo crazyflie", "A: mambo, settings "),
        ("margins", "mambo on mambo, the true state, 10 ms an update"),
        ("vehicles", "cf2x-pybullet "),
        ("presets", "crazyflie "),
    ],
)
def test_commands_begin_with_the_answer_and_fit_a_terminal(arguments: str, answer: str) -> None:
    """All but commands to copy have 80 columns at most."""
    said, _ = run(*arguments.split(), code=1 if arguments.startswith("diff") else 0)
    lines = [line for line in said.splitlines() if "mambo-nmpc fly --repeat" not in line]
    assert lines[0].startswith(answer)
    assert max(map(len, lines)) <= WIDTH
    assert "|" not in said
