"""The hooks of MkDocs: addresses, parts of pages that the code writes, drawings, formulas."""

import re
import shutil
import subprocess
import sys
import tomllib
from html import unescape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from math_core import LatexToMathML
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.pages import Page

sys.path.insert(0, str(Path(__file__).parents[2]))  # where plain `mkdocs` has the folder of this file only

from docs.pages.c_page import c_part
from docs.pages.python_page import python_part
from mambo_codegen.bundle.render import render
from mambo_codegen.settings import presets

ROOT: Final = Path(__file__).parents[2]

PARTS: Final = {
    "reference/c-api.md": c_part,
    "reference/python-api.md": python_part,
}
"""What the manual has in place of the part of a page that serves where Markdown is read without MkDocs."""

_PART: Final = re.compile(r"<!-- outside the manual -->.*?<!-- end -->", re.DOTALL)

_PLAYGROUND: Final = "playground.md"

_NOT_SEARCHED: Final = "explanation/decisions.md"
"""The page for developers."""

_BOOSTS: Final = {"tutorials/": 2, "how-to/": 2, "evidence/": 0.5, "reference/python-api": 0.5}
"""Weight in the search of pages whose names begin so; who searches wants to do something."""

_TAGS: Final = {
    "how-to/troubleshooting.md": ["drone oscillates", "vibrates", "drifts", "compile error"],
    "how-to/footprint.md": ["Raspberry Pi Pico", "STM32", "flash and RAM"],
    "how-to/crazyflie.md": ["flow deck", "Lighthouse"],
}
"""What readers ask for, and a page answers without a title that says it; the search lists these first."""

_WIDE: Final = "evidence/"
"""The folder whose tables need the width of the table of contents."""
_WIDEST: Final = ("evidence/margins.md", "evidence/simulators.md", _PLAYGROUND)
"""Pages that need the whole width."""

_DRAWING: Final = re.compile(r"^!\[[^\]]+\]\(([^)]*drawings/[^)]+\.svg)\)$", re.MULTILINE)
"""A line that is a drawing; as part of the page it has the colour of its text, light or dark."""

_FORMULA: Final = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
"""A formula in LaTeX as `pymdownx.arithmatex` leaves it: `span` in a line, `div` on lines of its own."""

_EMPTY_HEAD: Final = re.compile(r"<th([^>]*)></th>")
_SEARCH: Final = 'data-md-component="search" role="dialog"'

_LATEX: Final = LatexToMathML(fancy_error=False)


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Set the addresses of manual and repository, which stand in pyproject.toml, once there are any."""
    urls = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["urls"]
    if manual := urls.get("Documentation"):
        config.site_url = manual.rstrip("/") + "/"
    if repository := urls.get("Repository"):
        config.repo_url = repository
        config.repo_name = "/".join(repository.rstrip("/").split("/")[-2:])
    return config


def on_page_markdown(markdown: str, /, *, page: Page, **_: object) -> str:
    """Put in what the code writes, and the drawings; raises OSError for one that is not there."""
    name = page.file.src_uri
    if name == _NOT_SEARCHED:
        page.meta["search"] = {"exclude": True}
    page.meta["tags"] = _TAGS.get(name, [])
    for begin, boost in _BOOSTS.items():
        if name.startswith(begin):
            page.meta["search"] = {"boost": boost}
    if name in _WIDEST:
        page.meta["hide"] = ["toc", "navigation"]
    elif name.startswith(_WIDE):
        page.meta["hide"] = ["toc"]
    if name in PARTS:
        part = PARTS[name]()
        markdown = _PART.sub(lambda _: part, markdown)
    if name == _PLAYGROUND and _has_compilers():
        frame = Path(__file__).with_name("playground.html").read_text("utf-8")
        markdown = _PART.sub(lambda _: frame, markdown)
    folder = ROOT / "docs" / Path(name).parent
    return _DRAWING.sub(lambda link: f"<div>\n{(folder / link[1]).read_text('utf-8')}</div>", markdown)


def on_page_content(html: str, /, **_: object) -> str:
    """Typeset the formulas as MathML, which browsers draw; raises LatexError for one that is wrong.

    A head of a table without a word becomes a cell.
    """
    return _EMPTY_HEAD.sub(r"<td\1></td>", _FORMULA.sub(_typeset, html))


def on_post_page(html: str, /, **_: object) -> str:
    """Name the dialog of the search for those who hear the page."""
    return html.replace(_SEARCH, f'{_SEARCH} aria-label="Search"')


def _typeset(formula: re.Match[str]) -> str:
    """Return a formula as MathML; one on lines of its own scrolls where it is too wide."""
    tag, latex = formula.groups()
    mathml = _LATEX.convert_with_local_state(unescape(latex).strip(), displaystyle=tag == "div")
    return f'<div class="formula" tabindex="0">{mathml}</div>' if tag == "div" else mathml


def on_post_build(config: MkDocsConfig) -> None:
    """Write the C of the presets, and the playground that its page shows; raises PluginError."""
    for name in presets.names():
        files = render(presets.preset(name), with_digest=False)
        place = Path(config.site_dir, "c", name)
        place.mkdir(parents=True, exist_ok=True)
        for file in ("nmpc.h", "nmpc.c"):
            (place / file).write_text(files[file], "utf-8")
    if _has_compilers():
        with TemporaryDirectory() as folder:
            for words in _playground_commands(Path(config.docs_dir, _PLAYGROUND)):
                _run(words, folder)
            shutil.copy(Path(folder, "play.html"), config.site_dir)


def _has_compilers() -> bool:
    """Return whether the playground can be made here; if not, its page is as outside the manual."""
    return all(map(shutil.which, ("clang", "wasm-ld")))


def _playground_commands(page: Path) -> list[list[str]]:
    """Return the commands in the page's first console block, which make its playground."""
    block = page.read_text("utf-8").partition("```console\n")[2].partition("```")[0]
    return [line.split() for line in re.findall(r"^\$ mambo-nmpc (.+)$", block, re.MULTILINE)]


def _run(words: list[str], folder: str) -> None:
    """Run a command of the product in a folder; raises PluginError with what it wrote if it fails."""
    command = [sys.executable, "-m", "mambo_nmpc", *words]
    ran = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if ran.returncode:
        raise PluginError(ran.stderr)
