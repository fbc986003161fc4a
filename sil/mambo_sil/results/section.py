"""A section of the report: the part of the page on one result folder."""

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Section:
    """The part of a page on one result folder.

    template: name of a template in the folder report, without `_` and `.html.j2`; `content` is its context.
    good:     whether the result is good; None if there is no verdict.
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
