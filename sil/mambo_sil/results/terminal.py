"""What commands print: tables and sentences within the width of a terminal."""

import textwrap
from collections.abc import Collection, Iterator, Sequence
from typing import Final

from mambo_sil.results.blocks import Block, CommandResult, Commands, ResultTable, Sentence

WIDTH: Final = 80
"""Columns of a line; a word or a command of its own may be longer."""

_GAP: Final = "  "


def result_text(result: CommandResult) -> str:
    """Return a result as text: the answer, then the blocks that the console shows."""
    first, *others = result.answer
    lines = [sentence(one) for one in (f"{result.subject}: {first}" if result.subject else first, *others)]
    return "\n".join([*lines, *(line for block in result.blocks for line in _lines(block))])


def _lines(block: Block) -> Iterator[str]:
    """Yield the lines of a block; an empty one comes before tables and commands."""
    match block:
        case Sentence(text):
            yield sentence(text, "  ")
        case ResultTable(rows=[_, *_]):
            narrow = block.narrow()
            yield from ("", sentence(block.title)) if block.title else ("",)
            yield from table(narrow.heads, narrow.rows, narrow.text_columns)
        case Commands(title, [_, *_] as rows):
            yield from ("", sentence(title)) if title else ("",)
            for words, command in rows:
                yield from (sentence(words, "    "), f"    {command}")


def table(heads: Sequence[str], rows: Sequence[Sequence[str]], texts: Collection[int] = (0,)) -> list[str]:
    """Return a table as lines of at most `WIDTH`; without `heads` its rows only.

    texts: indices of the columns of text, flush left; the others hold numbers, flush right.

    If the table is too wide, headings stand in several lines, then texts are wrapped.
    """
    count = len(heads or rows[0])
    text_columns = {index % count for index in texts}
    widths = _widths(heads or [""] * count, rows, text_columns)
    lines = []
    for row, is_head in (*([(heads, True)] if heads else []), *((row, False) for row in rows)):
        cells = [
            _wrapped(cell, width) if is_head or index in text_columns else [cell]
            for index, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        height = max(map(len, cells))
        for line in range(height):
            shown = []
            for index, (cell, width) in enumerate(zip(cells, widths, strict=True)):
                place = line - (height - len(cell)) if is_head else line  # headings stand on their columns
                part = cell[place] if 0 <= place < len(cell) else ""
                shown.append(part.ljust(width) if index in text_columns else part.rjust(width))
            lines.append(_GAP.join(shown).rstrip())
    return lines


def sentence(text: str, indent: str = "") -> str:
    """Return a sentence in lines of at most `WIDTH`, those after the first with an indent."""
    return textwrap.fill(
        text, WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )


def _wrapped(cell: str, width: int) -> list[str]:
    return textwrap.wrap(cell, max(width, 1), break_long_words=False, break_on_hyphens=False) or [""]


def _widths(heads: Sequence[str], rows: Sequence[Sequence[str]], text_columns: set[int]) -> list[int]:
    """Return the widths of the columns, as narrow as the table must be."""
    cells = [max((len(row[index]) for row in rows), default=0) for index in range(len(heads))]
    widths = [max(len(head), cell) for head, cell in zip(heads, cells, strict=True)]
    room = WIDTH - len(_GAP) * (len(heads) - 1)
    if sum(widths) > room:
        words = [max(map(len, head.split()), default=0) for head in heads]
        widths = [max(word, cell) for word, cell in zip(words, cells, strict=True)]
    least = [
        max((len(word) for row in (heads, *rows) for word in row[index].split()), default=0)
        for index in range(len(heads))
    ]
    while sum(widths) > room:
        wide = [index for index in text_columns if widths[index] > least[index]]
        if not wide:
            break
        widths[max(wide, key=lambda index: widths[index])] -= 1
    return widths
