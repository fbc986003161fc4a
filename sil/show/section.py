"""A section of the report: what the page shows of one result folder."""

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Section:
    """What a page shows of one folder.

    template: of templates/report, without `_` and `.html.j2`; `content` is what it is filled with.
    good:     whether what was run came out well; None if there is nothing to judge.
    finding:  the result in a line.
    missing:  files of the folder that would have shown more.
    moves:    whether it has an animation, which needs the page's script.
    """

    template: str
    title: str
    good: bool | None
    finding: str
    content: Any
    missing: list[str] = field(default_factory=list)
    moves: bool = False
