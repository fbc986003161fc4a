"""The site that MkDocs builds from docs/ and from the code."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.tools import require_module

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the built manual; a link, an anchor or a page out of the navigation would have failed it."""
    require_module("mkdocs")
    require_module("material")
    require_module("mkdocstrings")
    require_module("math_core")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.long
def test_it_has_the_pages_that_the_code_writes(site: Path) -> None:
    """Every setting, command and public name is in the reference."""
    from mambo_codegen.settings.controller_keys import KEYS  # noqa: PLC0415
    from mambo_nmpc import __all__ as names  # noqa: PLC0415 - beside what they are compared with

    settings = (site / "reference" / "settings.html").read_text("utf-8")
    assert [path for path in KEYS if f"<code>{path.rpartition('.')[2]}</code>" not in settings] == []
    commands = (site / "reference" / "command-line.html").read_text("utf-8")
    assert re.findall(r'<h2 id="([\w-]+)"', commands)[:4] == ["init", "doctor", "playground", "presets"]
    python = (site / "reference" / "python-api.html").read_text("utf-8")
    assert [name for name in names if f'.{name}"' not in python] == []


@pytest.mark.long
def test_it_loads_nothing_from_a_network(site: Path) -> None:
    """No script, style, font or picture of another host."""
    for page in site.rglob("*.html"):
        text = page.read_text("utf-8")
        assert not re.findall(r'<(?:script|img|iframe)[^>]*src="(?:https?:)?//', text), page
        assert not re.findall(
            r'<link[^>]*rel="(?:stylesheet|preconnect|icon)"[^>]*href="(?:https?:)?//', text
        )


@pytest.mark.long
def test_the_search_answers_what_a_pilot_asks_first(site: Path) -> None:
    """A section has the word in its title, which the search lists before all others."""
    index = json.loads((site / "search" / "search_index.json").read_text("utf-8"))
    titles = " | ".join(one["title"].lower() for one in index["docs"])
    asked = ("install", "license", "weight", "tilt limit", "wind", "height", "latency", "gps")
    flown = ("ros", "px4", "ardupilot", "betaflight", "axes and signs")
    assert [word for word in (*asked, *flown) if not re.search(rf"\b{word}\b", titles)] == []


@pytest.mark.long
def test_drawings_have_the_colour_of_the_page(site: Path) -> None:
    """They are part of it, on one page of each kind, in light and dark."""
    for page, count in (("index.html", 2), ("reference/axes.html", 1)):
        text = (site / page).read_text("utf-8")
        assert (
            text.count('<svg class="drawing"')
            == text.count("prefers-color-scheme: dark) { .drawing")
            == count
        )


@pytest.mark.long
def test_formulas_are_typeset(site: Path) -> None:
    """As MathML, on the pages that derive something; no LaTeX is left for a script."""
    for page in ("kernel", "limits", "plant"):
        assert (site / "explanation" / f"{page}.html").read_text("utf-8").count("<math") > 5, page
    assert [page for page in site.rglob("*.html") if 'class="arithmatex"' in page.read_text("utf-8")] == []


def test_formulas_have_no_macro_that_github_refuses() -> None:
    """There such a formula is an error in red; the build would draw it."""
    for page in (ROOT / "docs").rglob("*.md"):
        assert not re.search(
            r"\\(?:operatorname|mbox|phantom|DeclareMathOperator)\b", page.read_text("utf-8")
        ), page


@pytest.mark.long
def test_long_tables_are_folded(site: Path) -> None:
    """With their title and number of rows; a short table stands as it is."""
    faults = (site / "evidence" / "faults.html").read_text("utf-8")
    assert re.search(r'<details class="note">\s*<summary>Table: faults \(\d\d rows\)</summary>', faults)
    assert "<details" not in (site / "evidence" / "opponents.html").read_text("utf-8")


def test_links_of_the_readme_lead_somewhere() -> None:
    """README and its neighbours name files that are there, and headings that they have."""
    for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md"):
        for link in re.findall(r"\]\(([^)\s]+)\)", (ROOT / name).read_text("utf-8")):
            path, _, anchor = link.partition("#")
            if "://" in link:
                continue
            assert (ROOT / path).exists(), f"{name}: {link}"
            if anchor:
                titles = re.findall(r"^#+ (.*)$", (ROOT / (path or name)).read_text("utf-8"), re.MULTILINE)
                slugs = {re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles}
                assert anchor in slugs, f"{name}: {link}"
