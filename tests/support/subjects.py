"""Subjects of checks: a bundle on disk, as it is generated or with one line put wrong."""

from pathlib import Path

from codegen.render import render
from codegen.settings import Settings
from sil.verify.check import Subject


def subject(settings: Settings, folder: Path, *faults: tuple[str, str, str]) -> Subject:
    """Write the bundle of `settings` into `folder`; a fault is a path, what is right, and what is wrong."""
    files = render(settings)
    for path, right, wrong in faults:
        assert right in files[path], "the template moved on: the fault must follow"
        files[path] = files[path].replace(right, wrong)
    for path, text in files.items():
        (folder / "bundle" / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / "bundle" / path).write_text(text, "utf-8")
    (folder / "check").mkdir()
    return Subject(settings, folder / "bundle", folder / "check")
