"""The parts of pages that the code writes into their Markdown, so that a source host has them too.

`python -m docs.pages.written`, a part of `make generated`, writes them anew.
"""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Final

from docs.pages.command_page import command_part
from docs.pages.python_page import python_text
from docs.pages.settings_page import controller_part, vehicle_part

DOCS: Final = Path(__file__).parents[1]

WRITTEN: Final[dict[str, Callable[[], str]]] = {
    "reference/settings.md": controller_part,
    "reference/vehicle-toml.md": vehicle_part,
    "reference/command-line.md": command_part,
    "reference/python-api.md": python_text,
}

_PART: Final = re.compile(
    r"(<!-- (?:written by the code|outside the manual) -->\n).*?(<!-- end -->)", re.DOTALL
)


def with_part(page: str, text: str) -> str:
    """Return the text of a page with the part that the code writes today."""
    part = WRITTEN[page]().strip("\n")
    return _PART.sub(lambda marks: f"{marks[1]}\n{part}\n\n{marks[2]}", text)


if __name__ == "__main__":
    for name in WRITTEN:
        place = DOCS / name
        place.write_text(with_part(name, place.read_text("utf-8")), "utf-8")
