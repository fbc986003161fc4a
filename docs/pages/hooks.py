"""The hooks of MkDocs: pages that the code writes, tables that `make evidence` writes, drawings, formulas."""

import re
from html import unescape
from pathlib import Path
from typing import Final

from math_core import LatexToMathML
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from docs.pages.command_page import command_page
from docs.pages.python_page import python_page
from docs.pages.settings_page import controller_page, vehicle_page

PAGES: Final = {
    "reference/settings.md": controller_page,
    "reference/vehicle-toml.md": vehicle_page,
    "reference/command-line.md": command_page,
    "reference/python-api.md": python_page,
}

_TABLE: Final = re.compile(r"^\[(Table: [^\]]+)\]\(([^)]+\.md)\)$", re.MULTILINE)
"""A line that is a link to a table: where Markdown is read without MkDocs, as on GitHub, the link serves."""

_NOT_SEARCHED: Final = "explanation/decisions/"
"""The folder for developers."""

_WIDE: Final = "evidence/"
"""The folder whose tables need the width of the table of contents."""
_WIDEST: Final = ("evidence/margins.md", "evidence/simulators.md")
"""Pages whose tables need the whole width."""

_LONG_TABLE: Final = 15
"""A table of more rows than that is folded."""

_DRAWING: Final = re.compile(r"^!\[[^\]]+\]\(([^)]*drawings/[^)]+\.svg)\)$", re.MULTILINE)
"""A line that is a drawing; as part of the page it has the colour of its text, light or dark."""

_FORMULA: Final = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
"""A formula in LaTeX as `pymdownx.arithmatex` leaves it: `span` in a line, `div` on lines of its own."""

_LATEX: Final = LatexToMathML(fancy_error=False)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages to the files of the site."""
    for path, write in PAGES.items():
        files.append(File.generated(config, path, content=write()))
    return files


def on_page_markdown(markdown: str, /, *, page: Page, **_: object) -> str:
    """Put each linked table and drawing in place of its link; raises OSError for one that is not there."""
    if page.file.src_uri.startswith(_NOT_SEARCHED):
        page.meta["search"] = {"exclude": True}
    if page.file.src_uri.startswith(_WIDE):
        page.meta["hide"] = ["toc", "navigation"] if page.file.src_uri in _WIDEST else ["toc"]
    if page.file.abs_src_path is None:
        return markdown
    folder = Path(page.file.abs_src_path).parent
    markdown = _TABLE.sub(lambda link: _table(link[1], (folder / link[2]).read_text("utf-8")), markdown)
    return _DRAWING.sub(lambda link: f"<div>\n{(folder / link[1]).read_text('utf-8')}</div>", markdown)


def _table(title: str, text: str) -> str:
    """Return a table as part of a page, folded if it is long."""
    head, rule, *rows = text.splitlines()
    if len(rows) <= _LONG_TABLE:
        return text
    return "\n    ".join([f'??? note "{title} ({len(rows)} rows)"\n', head, rule, *rows])


def on_page_content(html: str, /, **_: object) -> str:
    """Typeset the formulas as MathML, which browsers draw; raises LatexError for one that is wrong."""
    return _FORMULA.sub(_typeset, html)


def _typeset(formula: re.Match[str]) -> str:
    """Return a formula as MathML; one on lines of its own scrolls where it is too wide."""
    tag, latex = formula.groups()
    mathml = _LATEX.convert_with_local_state(unescape(latex).strip(), displaystyle=tag == "div")
    return f'<div class="formula">{mathml}</div>' if tag == "div" else mathml
