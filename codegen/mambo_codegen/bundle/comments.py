"""Comments of C whose lines have become too long, because words in them depend on settings."""

from collections.abc import Iterator
from typing import Final

LONGEST: Final = 120
"""Columns of a line of C."""

_TEXT: Final = " * "


def fitted(text: str) -> str:
    """Return C in which words beyond the last column of a comment's line begin the next one.

    A line that is indented, as those of formulas and lists are, stays.
    """
    lines: list[str] = []
    moved = ""
    for line in text.split("\n"):
        goes_on = line.startswith(_TEXT) and not _is_indented(line) and line != _TEXT
        if moved and goes_on:
            kept, moved = _split(f"{_TEXT}{moved} {line.removeprefix(_TEXT)}")
        else:
            lines += _whole(moved)
            kept, moved = _split(line)
        lines.append(kept)
        if moved.endswith("*/"):
            lines += _whole(moved)
            moved = ""
    return "\n".join(lines)


def _whole(words: str) -> Iterator[str]:
    """Yield the comment's lines of words that nothing follows."""
    while words:
        line, words = _split(_TEXT + words)
        yield line


def _split(line: str) -> tuple[str, str]:
    """Return what of a comment's line fits, and the words beyond; of any other line all fits."""
    if len(line) <= LONGEST or not line.startswith((_TEXT, "/* ")) or _is_indented(line):
        return line, ""
    end = line.rindex(" ", 0, LONGEST + 1)
    return line[:end], line[end + 1 :]


def _is_indented(line: str) -> bool:
    return line.startswith(f"{_TEXT} ")
