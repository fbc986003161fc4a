"""Subjects of checks: a bundle on disk, as it is generated or with something put wrong."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from mambo_codegen.bundle.render import render
from mambo_codegen.settings.model import Settings
from mambo_sil.verify import tape_replay
from mambo_sil.verify.calls import Outcomes, Tape
from mambo_sil.verify.cases import cases
from mambo_sil.verify.check import Subject
from tests.support.bundles import place
from tests.support.tools import require


class Harm(NamedTuple):
    """A fault: in `path`, what first matches the pattern `right` reads `wrong`."""

    path: str
    right: str
    wrong: str


def subject(settings: Settings, folder: Path, *harms: Harm | tuple[str, str, str]) -> Subject:
    """Write the bundle of `settings` below `folder`, with `harms` done to it; an empty folder for evidence.

    A plain tuple is a harm too, but names what is right as it stands.
    """
    files = render(settings)
    for harm in harms:
        path, right, wrong = harm
        if not isinstance(harm, Harm):
            right, wrong = re.escape(right), wrong.replace("\\", r"\\")
        files[path], count = re.subn(right, wrong, files[path], count=1)
        assert count == 1, "the template moved on: the harm must follow"
    (folder / "evidence").mkdir()
    return Subject(settings, place(files, folder / "controller"), folder / "evidence")


def played_fault(
    its: Subject, *flags: str, played: tuple[Sequence[Tape], Sequence[Outcomes]] | None = None
) -> str | None:
    """Build the C with gcc, play tapes, by default all cases, and return what differs from the reference."""
    program = tape_replay.build(its, require("gcc", "gcc"), flags, its.folder)
    tapes, expected = played or cases(its.settings)
    tape_replay.write_tapes(its.settings, tapes, its.folder / "tapes.bin")
    return tape_replay.fault(
        tape_replay.play(program, its.folder / "tapes.bin", its.settings, tapes), expected
    )
