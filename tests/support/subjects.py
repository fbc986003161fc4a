"""Subjects of checks: a bundle on disk, as it is generated or with something put wrong."""

import re
from pathlib import Path
from typing import NamedTuple

from mambo_nmpc.codegen.render import render
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.verify.check import Subject


class Harm(NamedTuple):
    """A fault: in `path`, what first matches the pattern `right` reads `wrong`."""

    path: str
    right: str
    wrong: str


def subject(
    settings: Settings, folder: Path, *harms: Harm | tuple[str, str, str], amalgamate: bool = False
) -> Subject:
    """Write the bundle of `settings` below `folder`, with `harms` done to it; an empty folder for evidence.

    A plain tuple is a harm too, but names what is right as it stands.
    """
    files = render(settings, amalgamate=amalgamate)
    for harm in harms:
        path, right, wrong = harm
        path = "nmpc.c" if amalgamate else path
        if not isinstance(harm, Harm):
            right, wrong = re.escape(right), wrong.replace("\\", r"\\")
        files[path], count = re.subn(right, wrong, files[path], count=1)
        assert count == 1, "the template moved on: the harm must follow"
    for path, text in files.items():
        (folder / "controller" / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / "controller" / path).write_text(text, "utf-8")
    (folder / "evidence").mkdir()
    return Subject(settings, folder / "controller", folder / "evidence")
