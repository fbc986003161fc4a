"""Every command of these tests runs in an empty folder."""

import pytest


@pytest.fixture(autouse=True)
def _in_the_folder(in_an_empty_folder: None) -> None:
    """Every command runs in an empty folder."""


@pytest.fixture
def _no_tool(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Make a machine without any command."""
    monkeypatch.setenv("PATH", str(tmp_path_factory.mktemp("bin")))
