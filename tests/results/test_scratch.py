"""Temporary folders: removed after use, and named when they cannot be written."""

import errno
import os
import tempfile
from pathlib import Path

import pytest

from mambo_sil.errors import ScratchError
from mambo_sil.results.scratch import scratch_folder


def test_the_folder_is_removed() -> None:
    """With everything in it."""
    with scratch_folder() as folder:
        (folder / "a.c").write_text("int a;")
    assert not folder.exists()


def test_a_full_disk_names_the_folder_for_temporary_files() -> None:
    """Not the folder for the results."""
    with pytest.raises(ScratchError) as caught, scratch_folder():
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert str(caught.value) == (
        f"{tempfile.gettempdir()}: temporary files cannot be written: No space left on device; "
        "free some space there, or set TMPDIR to another folder"
    )


def test_a_folder_that_was_removed_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """TMPDIR may vanish during a run."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "gone"))
    with (
        pytest.raises(ScratchError, match="gone: temporary files cannot be written"),
        scratch_folder(),
    ):
        pass
