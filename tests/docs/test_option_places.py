"""The guide's list of the places of an option is whole."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDERS = ("codegen", "sil", "templates/mambo_templates")
SUFFIXES = {".py", ".c", ".h", ".j2"}


def test_the_guide_names_every_place_of_the_newest_option() -> None:
    """Those of its law, its numbers and its C; firmware only tells a pilot of it."""
    guide = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    found = re.search(r"<!-- option: (\S+) -->\n(.+?)<!-- end of option -->", guide, re.DOTALL)
    assert found
    option = re.compile(found[1], re.IGNORECASE)
    named = [
        path.relative_to(ROOT).as_posix()
        for folder in FOLDERS
        for path in (ROOT / folder).rglob("*")
        if path.suffix in SUFFIXES and "firmware" not in path.parts
        if option.search(path.read_text("utf-8"))
    ]
    assert sorted(re.findall(r"^\| `(\S+)`", found[2], re.MULTILINE)) == sorted(named)
