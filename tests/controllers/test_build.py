"""Building and caching the C: private, once, and with messages that say what is missing."""

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from mambo_nmpc.codegen.errors import BuildError
from mambo_nmpc.codegen.settings import presets
from mambo_nmpc.codegen.toolchain import Toolchain, host_toolchain
from mambo_nmpc.sil.controllers.build import build_library
from mambo_nmpc.sil.controllers.compiled import CompiledController
from mambo_nmpc.sil.errors import CacheError
from mambo_nmpc.sil.files.cache import build_cached, cache_folder
from tests.support.tools import require

MAMBO = presets.load("mambo")


def make(folder: Path) -> Path:
    """Build the file that the tests of the cache ask for."""
    (folder / "made").write_text("made")
    return folder / "made"


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give the test a cache folder of its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "mambo-nmpc"


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


def test_what_cannot_be_loaded_is_refused(empty_cache: Path) -> None:
    """The message names the folder, and what to set if it may hold no programs."""
    script = 'case "$*" in *nmpc.so) echo no library > nmpc.so;; esac'
    with pytest.raises(
        CacheError, match=rf"cannot load {empty_cache}/.*noexec, set XDG_CACHE_HOME elsewhere"
    ):
        build_library(MAMBO, Toolchain(("sh", "-c", script, "cc")))


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


def test_two_processes_may_build_the_same_code_at_once(empty_cache: Path) -> None:
    """Both fly, and one file remains."""
    require("cc", "gcc")
    script = (
        "from mambo_nmpc.codegen.settings import presets;"
        "from mambo_nmpc.sil.controllers.compiled import CompiledController as C;"
        "print(C(presets.load('table1')).step([[0]*7], [[1,0,0,0]], [9.81]).command_rad.tolist())"
    )
    command = [sys.executable, "-c", script]
    both = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    printed = [process.communicate()[0] for process in both]
    assert [process.returncode for process in both] == [0, 0]
    assert printed[0] == printed[1] != ""
    assert len(list(empty_cache.iterdir())) == 1


def test_without_a_compiler_the_message_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """No cc, gcc or clang on the path, and no CC."""
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BuildError, match=r"no C compiler found.*install one"):
        host_toolchain()


@pytest.mark.usefixtures("empty_cache")
@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("no-such-compiler", "cannot run the C compiler no-such-compiler"),
        ("true", "true wrote no output; set CC to a C compiler"),
        ("false", r"(?s)^false .*failed:\nexit code 1, no output"),
        ("gcc '", "CC = gcc ' must be a command: no closing quotation"),
    ],
)
def test_a_command_that_compiles_nothing_is_named(
    line: str, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """CC may name anything."""
    monkeypatch.setenv("CC", line)
    with pytest.raises(BuildError, match=message):
        CompiledController(MAMBO)


@pytest.mark.usefixtures("empty_cache")
def test_a_relative_compiler_is_found_from_the_build_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A build runs in a folder of its own; CC, here with an argument, is relative to the current folder."""
    (tmp_path / "cc").symlink_to(require("gcc", "gcc"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CC", "./cc -O1")
    assert host_toolchain().command == (str(tmp_path / "cc"), "-O1")
    assert CompiledController(MAMBO).settings == MAMBO


@pytest.mark.usefixtures("empty_cache")
def test_a_refusing_compiler_is_quoted() -> None:
    """A flag that the compiler does not know: its own words, and nothing cached."""
    require("gcc", "gcc")
    with pytest.raises(BuildError, match=r"(?s)failed:.*--no-such-flag"):
        build_library(MAMBO, Toolchain(("gcc", "--no-such-flag")))
