"""What `make generated` writes beside the bundles; tests/codegen/test_kept.py has the kept results."""

from pathlib import Path

import pytest

from benchmarks.generated import interfaces


@pytest.mark.parametrize(("path", "text"), [pytest.param(*one, id=one[0].stem) for one in interfaces()])
def test_interfaces_are_those_of_the_declarations(path: Path, text: str) -> None:
    """Of another layout of its records the engine would read and write wrong memory."""
    assert path.read_text("utf-8") == text, "run `make generated`, and commit what changes"
