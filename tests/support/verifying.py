"""A bundle on disk as a check sees it, whole or harmed."""

import re
from pathlib import Path
from typing import NamedTuple

from codegen.render import render
from codegen.settings import Settings
from sil.verify.check import Subject


class Harm(NamedTuple):
    """A fault: in `path`, what first matches the pattern `right` reads `wrong`."""

    path: str
    right: str
    wrong: str


def subject(
    settings: Settings, folder: Path, harm: Harm | None = None, *, amalgamate: bool = False
) -> Subject:
    """Write the bundle of `settings` below `folder`, with `harm` done to it; an empty folder for evidence."""
    files = render(settings, amalgamate=amalgamate)
    if harm is not None:
        path = "nmpc.c" if amalgamate else harm.path
        files[path], count = re.subn(harm.right, harm.wrong, files[path], count=1)
        assert count == 1, "the template moved on: the harm must follow"
    for path, text in files.items():
        (folder / "controller" / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / "controller" / path).write_text(text, "utf-8")
    (folder / "evidence").mkdir()
    return Subject(settings, folder / "controller", folder / "evidence")
