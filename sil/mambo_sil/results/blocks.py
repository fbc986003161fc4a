"""A result, written once: an answer and blocks, which console, page and Markdown show."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup


@dataclass(frozen=True)
class Sentence:
    """A sentence."""

    text: str


@dataclass(frozen=True)
class Note:
    """An explanation for a page; the console leaves it out."""

    text: str


@dataclass(frozen=True)
class Facts:
    """What was run, by name, for a page; whoever typed the command knows it."""

    values: Mapping[str, str]


@dataclass(frozen=True)
class ResultTable:
    """A table whose rows begin with what they are about; without heads it has names and values.

    texts: indices of the columns of text; the others hold numbers.
    wide:  indices of the columns that the console leaves out.
    title: stands above the table.
    """

    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    texts: Collection[int] = (0,)
    wide: Collection[int] = ()
    title: str = ""

    @property
    def text_columns(self) -> set[int]:
        """The indices of the columns of text, counted from the first."""
        return {index % len(self.heads) for index in self.texts} if self.heads else {0, 1}

    def narrow(self) -> "ResultTable":
        """Return the table without the columns `wide`."""
        if not self.wide:
            return self
        kept = [index for index in range(len(self.heads)) if index not in self.wide]
        heads, *rows = ([row[index] for index in kept] for row in (self.heads, *self.rows))
        texts = [kept.index(index) for index in self.text_columns if index in kept]
        return ResultTable(heads, rows, texts, title=self.title)

    def markdown(self) -> str:
        """Return the table as Markdown."""
        lines = [self.heads, ["---"] * len(self.heads), *self.rows]
        return "\n".join(f"| {' | '.join(line)} |" for line in lines)


@dataclass(frozen=True)
class Picture:
    """Pictures for a page, side by side; `draw` makes them of `files`, unless all of these are missing."""

    draw: Callable[[], Sequence[Markup]]
    caption: str
    files: Sequence[Path] = ()

    @property
    def drawable(self) -> bool:
        """Whether there is anything to draw."""
        return not self.files or any(path.is_file() for path in self.files)


@dataclass(frozen=True)
class MovingPicture(Picture):
    """A picture with its own caption, which takes the page's script to move."""


@dataclass(frozen=True)
class Commands:
    """Commands that show more, each with what it is about."""

    title: str
    rows: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Listing:
    """Text to be shown as it is, for a page."""

    text: str


@dataclass(frozen=True)
class Details:
    """Blocks that a page folds away, and the console leaves out."""

    title: str
    blocks: Sequence["Block"]


Block = Sentence | Note | Facts | ResultTable | Picture | Commands | Listing | Details


@dataclass(frozen=True)
class CommandResult:
    """What a command found.

    title:   for a page.
    good:    None if there is no verdict, as for a flight that nobody has set a bound.
    answer:  the result, in one sentence or more.
    subject: what the answer is about; the console begins with it.
    """

    title: str
    good: bool | None
    answer: Sequence[str]
    blocks: Sequence[Block] = ()
    subject: str = ""

    @property
    def finding(self) -> str:
        """The answer on one line."""
        return "; ".join(self.answer)

    @property
    def pictures(self) -> list[Picture]:
        """The pictures among the blocks."""
        return [block for block in self.blocks if isinstance(block, Picture)]

    @property
    def missing(self) -> list[str]:
        """Names of the files that a page would draw, and that are not there."""
        files = dict.fromkeys(path for picture in self.pictures for path in picture.files)
        return [path.name for path in files if not path.is_file()]
