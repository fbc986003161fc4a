"""The base of the record of a command: printed, written as the summary of its result folder, reported."""

import json
import math
from abc import abstractmethod
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar

from markupsafe import Markup
from pydantic import BaseModel, BeforeValidator, ConfigDict

from mambo_codegen import __version__
from mambo_sil.results.folders import GENERATOR, SUMMARY, finite

Number = Annotated[int | float, BeforeValidator(lambda value: math.nan if value is None else value)]
"""A measured value: NaN and infinity become null in JSON, null is read as NaN, a whole number stays whole."""


class Summary(BaseModel):
    """The keys of every summary; unknown keys, which a later version may add, are ignored."""

    model_config = ConfigDict(frozen=True, extra="ignore", defer_build=True)

    command: ClassVar[str]
    generator: str = f"{GENERATOR}{__version__}"

    def text(self) -> str:
        """Return the summary as JSON."""
        whole = {"generator": self.generator, "command": self.command} | self.model_dump(mode="json")
        return json.dumps(finite(whole), indent=2, allow_nan=False) + "\n"

    def write(self, folder: Path) -> None:
        """Write the summary of a result folder."""
        (folder / SUMMARY).write_text(self.text(), "utf-8")


@dataclass(frozen=True)
class PageTable:
    """A table on a page: heads, rows that begin with what they are about, and which columns are text."""

    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: Collection[int] = ()


@dataclass(frozen=True)
class Section:
    """The part of a page of the report on one result folder.

    template: name of a template in the folder report, without `_` and `.html.j2`; `content` is its context.
    good:     whether the result is good; None if there is no verdict, as for a flight that nobody has set a
              bound.
    finding:  the result in one line.
    missing:  files missing in the folder, whose content the section would show.
    moves:    whether the section has an animation, which needs the page's script.
    """

    template: str
    title: str
    good: bool | None
    finding: str
    content: Any
    missing: list[str] = field(default_factory=list)
    moves: bool = False


def plain_section(
    title: str,
    good: bool | None,
    finding: str,
    tables: Sequence[PageTable],
    *,
    sentences: Sequence[str] = (),
    pictures: Sequence[Markup] = (),
    missing: Sequence[str] = (),
) -> Section:
    """Return a section of sentences, pictures and tables."""
    content = {"sentences": sentences, "pictures": pictures, "tables": tables}
    return Section("plain", title, good, finding, content, list(missing))


class ReportedSummary(Summary):
    """A summary in a result folder that the command `report` reads."""

    @abstractmethod
    def section(self, folder: Path, /) -> Section:
        """Return the section of the report on the result in `folder`; raises ResultsError and TraceError.

        The results may be incomplete: files other than the summary may be missing.
        """
