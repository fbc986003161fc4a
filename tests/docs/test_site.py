"""The site that MkDocs builds from docs/ and from the code."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from importlib import resources
from pathlib import Path

import pytest

from mambo_codegen.settings import presets
from tests.support.browser import PHONE_PX, Browser, browser
from tests.support.tools import require, require_module

ROOT = Path(__file__).parents[2]
DECLARED = re.compile(r"^\w[^;{}/\n]*?\b(nmpc_\w+)\(", re.MULTILINE)
"""A function of a header."""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the manual that plain `mkdocs` builds; a broken link or anchor would have failed it."""
    require_module("mkdocs")
    require_module("material")
    require_module("mkdocstrings")
    require_module("math_core")
    folder = tmp_path_factory.mktemp("site")
    script = Path(sys.executable).with_name("mkdocs")
    command: list[str | Path] = [script, "build", "--strict", "--site-dir", folder]
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
def test_the_functions_of_the_c_stand_on_their_page_and_in_its_source(site: Path) -> None:
    """With the comments of the header; and the C of each preset can be read."""
    page = (site / "reference" / "c-api.html").read_text("utf-8")
    headers = [(site / "c" / name / "nmpc.h").read_text("utf-8") for name in presets.names()]
    declared = {name for header in headers for name in DECLARED.findall(header)}
    assert {"nmpc_step", "nmpc_set_limits", "nmpc_has_converged"} <= declared
    source = (ROOT / "docs" / "reference" / "c-api.md").read_text("utf-8")
    assert [name for name in declared if name not in page or f"`{name}`" not in source] == []
    assert "Forget everything, and take level attitude for the last command." in page
    assert "outside the manual" not in page
    links = re.findall(r'href="\.\./(c/[^"]+)"', page)
    assert len(links) == 2 * len(presets.names())
    assert [link for link in links if not (site / link).is_file()] == []


@pytest.mark.long
def test_the_playground_is_part_of_its_page(site: Path) -> None:
    """The manual has page and frame, the controllers are those of the commands that the page names."""
    require("clang", "clang")
    require("wasm-ld", "lld")
    text = (site / "playground.html").read_text("utf-8")
    assert ('<iframe id="play" src="play.html' in text, "outside the manual" in text) == (True, False)
    source = (ROOT / "docs" / "playground.md").read_text("utf-8").partition("<!-- end -->")[2]
    said = re.search(r"playground (\S+) (\S+) (\S+) (\S+) --vehicle crazyflie -o play.html", source)
    flown = re.findall(r"<b>\d</b><span>([\w.-]+)", (site / "play.html").read_text("utf-8"))
    assert said
    assert [one.lower() for one in flown] == list(said.groups())


def test_addresses_are_those_of_the_project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They stand in pyproject.toml alone; without them the manual has none."""
    require_module("mkdocs")
    require_module("math_core")
    from mkdocs.config.defaults import MkDocsConfig  # noqa: PLC0415

    from docs.pages import hooks  # noqa: PLC0415 - it needs what the extra `docs` installs

    monkeypatch.setattr(hooks, "ROOT", tmp_path)
    project = tmp_path / "pyproject.toml"
    project.write_text("[project.urls]\n", "utf-8")
    config = hooks.on_config(MkDocsConfig())
    assert [config.get(key) for key in ("site_url", "repo_url", "repo_name")] == [None, None, None]
    urls = 'Documentation = "https://a.invalid/manual"\nRepository = "https://b.invalid/c/d"\n'
    project.write_text(f"[project.urls]\n{urls}", "utf-8")
    config = hooks.on_config(MkDocsConfig())
    assert (config.site_url, config.repo_name) == ("https://a.invalid/manual/", "c/d")


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
def test_the_search_weighs_pages_and_knows_the_words_of_readers(site: Path) -> None:
    """A how-to weighs more than evidence; a page has its tags, and words are cut at hyphens."""
    index = json.loads((site / "search" / "search_index.json").read_text("utf-8"))
    pages = {one["location"]: one for one in index["docs"] if "#" not in one["location"]}
    assert (pages["how-to/footprint.html"]["boost"], pages["evidence/px4.html"]["boost"]) == (2, 0.5)
    assert "drone oscillates" in pages["how-to/troubleshooting.html"]["tags"]
    assert re.split(index["config"]["separator"], "docker/px4.ros-2") == ["docker", "px4", "ros", "2"]


READ = (
    *(
        "index",
        "playground",
        "tutorials/first-flight",
        "how-to/px4",
        "how-to/footprint",
        "reference/settings",
    ),
    *("reference/command-line", "reference/python-api", "explanation/kernel", "evidence/margins"),
)
"""Pages with everything that a page may have: tables, code, formulas, pictures, folded parts, signatures."""


STILL = "<style>* { transition: none !important; }</style>"
"""Colours change at once."""


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Return a tab of one browser for all pages."""
    with browser(tmp_path_factory.mktemp("browser")) as opened:
        yield opened


@pytest.mark.long
@pytest.mark.parametrize("scheme", ["default", "slate"])
@pytest.mark.parametrize("page", READ)
def test_axe_finds_no_violation(site: Path, tab: Browser, page: str, scheme: str) -> None:
    """On a phone, where code and tables scroll, folded parts open; in dark only colours differ."""
    require_module("axe_core_python")
    tab.open(site / f"{page}.html", PHONE_PX)
    tab.find(f"document.head.insertAdjacentHTML('beforeend', {STILL!r})")
    tab.find(f"document.body.setAttribute('data-md-color-scheme', {scheme!r})")
    tab.find(resources.files("axe_core_python").joinpath("axe.min.js").read_text("utf-8") + "; null")
    tab.find("document.querySelectorAll('details').forEach((part) => { part.open = true; })")
    rules = ", runOnly: {type: 'rule', values: ['color-contrast']}" if scheme == "slate" else ""
    options = f"{{iframes: false{rules}}}"
    found = tab.find(f"axe.run(document, {options}).then((all) => JSON.stringify(all.violations))")
    assert [(one["id"], [node["html"] for node in one["nodes"]][:3]) for one in json.loads(found)] == []


@pytest.mark.parametrize("page", ["settings", "vehicle-toml", "command-line", "python-api"])
def test_what_the_code_writes_stands_in_the_page_and_is_fresh(page: str) -> None:
    """So that a source host shows it too; `make generated` writes it."""
    from docs.pages.written import with_part  # noqa: PLC0415 - loads the whole command line

    text = (ROOT / "docs" / "reference" / f"{page}.md").read_text("utf-8")
    assert with_part(f"reference/{page}.md", text) == text
    assert len(text) > 5000


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


PAGES = ["README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md"]
PAGES += [str(page.relative_to(ROOT)) for page in sorted((ROOT / "docs").rglob("*.md"))]
FENCE = re.compile(r"^(?P<fence>```+).*?^(?P=fence)$", re.DOTALL | re.MULTILINE)
REFUSED = re.compile(
    r"<(?:title|textarea|style|xmp|iframe|noembed|noframes|script|plaintext)\b", re.IGNORECASE
)
"""What the tag filter of GitHub Flavored Markdown shows as text, section 6.11 of its specification."""


def prose(page: str) -> str:
    """Return a page without its blocks of code."""
    return FENCE.sub("", (ROOT / page).read_text("utf-8"))


def slugs(page: str) -> set[str]:
    """Return the anchors of the headings of a page, as a source host names them."""
    titles = re.findall(r"^#+ (.*)$", prose(page), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere_without_mkdocs(page: str) -> None:
    """To files that are there, and headings that they have."""
    for link in re.findall(r"\]\(([^)\s]+)\)", prose(page)):
        path, _, anchor = link.partition("#")
        if "://" in link:
            continue
        target = (ROOT / page).parent / path if path else ROOT / page
        assert target.exists(), f"{page}: {link}"
        if anchor:
            assert anchor in slugs(str(target.resolve().relative_to(ROOT))), f"{page}: {link}"


@pytest.mark.parametrize("page", PAGES)
def test_a_page_has_only_what_a_source_host_shows(page: str) -> None:
    """No tag that it refuses, no front matter, and nothing that only MkDocs knows."""
    text = prose(page)
    assert not REFUSED.search(text)
    assert not text.startswith("---")
    assert not re.search(r"^(?:!!!|\?\?\?|:::) ", text, re.MULTILINE)
