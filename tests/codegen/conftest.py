"""A folder with a small bundle."""

from pathlib import Path

import pytest

from mambo_codegen.bundle import bundle
from tests.support.bundles import FILES


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Write the bundle FILES into a folder that is alone in its parent."""
    folder = tmp_path / "home" / "controller"
    bundle.write(FILES, folder)
    return folder
