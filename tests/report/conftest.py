"""A tab of a browser for the tests of a module."""

from collections.abc import Iterator

import pytest

from tests.support.browser import Browser, browser


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Return a tab of a browser for all tests of this file."""
    with browser(tmp_path_factory.mktemp("profile")) as one:
        yield one
