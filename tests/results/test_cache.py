"""The compile cache: private, one file a build, and nothing left by builds that failed."""

import os
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from mambo_codegen.errors import BuildError, CacheError
from mambo_codegen.user_cache import cache_folder
from mambo_sil.results.cache import build_cached


def make(folder: Path) -> Path:
    """Build the file that the tests of the cache ask for."""
    (folder / "made").write_text("made")
    return folder / "made"


def test_the_cache_is_private(empty_cache: Path) -> None:
    """Made for its owner alone; one that others may write to is refused, for code is loaded from there."""
    assert cache_folder() == empty_cache
    assert empty_cache.stat().st_mode & 0o777 == 0o700
    empty_cache.chmod(0o770)
    with pytest.raises(CacheError, match="others may write"):
        cache_folder()
    if os.geteuid() == 0:  # only root can give files away
        empty_cache.chmod(0o700)
        os.chown(empty_cache, 1234, 1234)
        with pytest.raises(CacheError, match="others may write"):
            cache_folder()


@pytest.mark.parametrize("make_it", [Path.touch, lambda path: path.symlink_to(path)], ids=["file", "link"])
def test_what_is_no_folder_is_no_cache(empty_cache: Path, make_it: Callable[[Path], None]) -> None:
    """The message names it."""
    make_it(empty_cache)
    with pytest.raises(CacheError, match=f"use the cache folder {empty_cache}: .*; set XDG_CACHE_HOME"):
        cache_folder()


def test_a_cache_named_by_a_relative_path_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """It would be another in every folder, such as one that came with somebody's sources."""
    monkeypatch.setenv("XDG_CACHE_HOME", "cache")
    with pytest.raises(CacheError, match="cache/mambo-nmpc must be an absolute path; set XDG_CACHE_HOME"):
        cache_folder()


def test_a_build_happens_once_unless_its_file_is_damaged(empty_cache: Path) -> None:
    """A file cut short by a full disk or a crash would kill the process that loads it."""
    built = []

    def build(folder: Path) -> Path:
        built.append(folder)
        return make(folder)

    first = build_cached("name", build)
    assert build_cached("name", build) == first
    assert len(built) == 1
    assert first.name.endswith("-name")
    for damage in ("", "ma"):
        first.write_text(damage)
        assert build_cached("name", build) == first
        assert first.read_text() == "made"
    assert len(built) == 3
    assert list(empty_cache.iterdir()) == [first]


def test_what_killed_builds_left_is_cleared(empty_cache: Path) -> None:
    """An old work folder goes with the next build; a young one may be at work or go meanwhile."""
    (cache_folder() / "build-gone").symlink_to("gone")
    for name, age_s in (("build-old", 4000.0), ("build-young", 0.0)):
        (cache_folder() / name).mkdir()
        then = time.time() - age_s
        os.utime(empty_cache / name, (then, then))

    made = build_cached("name", make)
    assert {path for path in empty_cache.iterdir() if path.exists()} == {made, empty_cache / "build-young"}


def test_a_failed_build_leaves_nothing(empty_cache: Path) -> None:
    """An error in the middle: no file, no work folder, and the next request builds again."""

    def fail(folder: Path) -> Path:
        (folder / "half").write_text("half")
        raise BuildError("no")

    with pytest.raises(BuildError):
        build_cached("name", fail)
    assert list(empty_cache.iterdir()) == []
