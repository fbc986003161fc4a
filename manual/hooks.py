"""The hook of MkDocs that adds the pages that the code writes."""

from typing import Final

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

from manual.command_page import command_page
from manual.python_page import python_page
from manual.settings_page import controller_page, vehicle_page

PAGES: Final = {
    "reference/settings.md": controller_page,
    "reference/vehicle-toml.md": vehicle_page,
    "reference/command-line.md": command_page,
    "reference/python-api.md": python_page,
}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages to the files of the site."""
    for path, write in PAGES.items():
        files.append(File.generated(config, path, content=write()))
    return files
