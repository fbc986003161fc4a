"""A tab of a browser, and the default page of the playground, for the tests of a module."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support import command
from tests.support.browser import Browser, Page, browser
from tests.support.tools import require


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    """Return the default page and its summary."""
    require("clang", "clang")
    require("wasm-ld", "lld")
    page = tmp_path_factory.mktemp("playground") / "play.html"
    return page, json.loads(command.run("playground", "-o", str(page), "--json")[0])


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Return a tab of a browser for all tests of this file."""
    with browser(tmp_path_factory.mktemp("profile")) as one:
        yield one


@pytest.fixture
def page(made: tuple[Path, Any], tab: Browser) -> Page:
    """Return the page at a desk, at its start."""
    return Page(tab, made[0])
