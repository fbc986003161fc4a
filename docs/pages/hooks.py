"""The hooks of MkDocs: pages that the code writes, tables that `make evidence` writes, and drawings."""

import re
from pathlib import Path
from typing import Final

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

_TABLE: Final = re.compile(r"^\[Table: [^\]]+\]\(([^)]+\.md)\)$", re.MULTILINE)
"""A line that is a link to a table: where Markdown is read without MkDocs, as on GitHub, the link serves."""

_DRAWING: Final = re.compile(r"^!\[[^\]]+\]\(([^)]*drawings/[^)]+\.svg)\)$", re.MULTILINE)
"""A line that is a drawing; as part of the page it has the colour of its text, light or dark."""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages to the files of the site."""
    for path, write in PAGES.items():
        files.append(File.generated(config, path, content=write()))
    return files


def on_page_markdown(markdown: str, /, *, page: Page, **_: object) -> str:
    """Put each linked table and drawing in place of its link; raises OSError for one that is not there."""
    if page.file.abs_src_path is None:
        return markdown
    folder = Path(page.file.abs_src_path).parent
    markdown = _TABLE.sub(lambda link: (folder / link[1]).read_text("utf-8"), markdown)
    return _DRAWING.sub(lambda link: f"<div>\n{(folder / link[1]).read_text('utf-8')}</div>", markdown)
