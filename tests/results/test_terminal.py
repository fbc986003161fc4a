"""What commands print: tables and sentences that fit a terminal."""

import math

import pytest

from mambo_sil.results.number_format import distance
from mambo_sil.results.terminal import WIDTH, sentence, table
from tests.support.command import run


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
        ("fly --duration-s 20 --no-pictures", "mambo on mambo: 1.4 cm in the mean, 18 cm at most"),
        ("campaign --flights 2 -o c", "mambo: "),
        ("diff mambo crazyflie", "A: mambo, settings "),
        ("margins", "mambo on mambo, the true state, 10 ms an update"),
        ("vehicles", "cf2x-pyflyt "),
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
