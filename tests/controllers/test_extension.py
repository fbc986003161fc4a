"""Building and caching the C: private, once, and with messages that say what is missing."""

import os
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest

from mambo_nmpc.codegen.errors import BuildError
from mambo_nmpc.codegen.settings import presets
from mambo_nmpc.codegen.toolchain import Toolchain, host_toolchain
from mambo_nmpc.sil.controllers.compiled import CompiledController, compiled
from mambo_nmpc.sil.errors import CacheError
from mambo_nmpc.sil.files.cache import cache_folder, cached
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


AS_ROOT = pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
STRANGER = 1234


@pytest.mark.parametrize("mode", [0o770, 0o777])
def test_a_cache_below_what_others_may_write_is_refused(empty_cache: Path, mode: int) -> None:
    """They could put their own in its place; nothing is made there. A sticky /tmp is no danger."""
    empty_cache.parent.chmod(mode)
    with pytest.raises(CacheError, match=f"others may write to {empty_cache.parent}, "):
        cache_folder()
    assert not empty_cache.exists()
    empty_cache.parent.chmod(mode | stat.S_ISVTX)
    assert cache_folder() == empty_cache


@AS_ROOT
def test_root_leaves_the_cache_of_somebody_else_alone(empty_cache: Path) -> None:
    """Neither loads from it, nor makes a folder in it that its owner could then not use."""
    os.chown(empty_cache.parent, STRANGER, STRANGER)
    with pytest.raises(CacheError, match="belongs to somebody else"):
        cache_folder()
    assert not empty_cache.exists()


def test_folders_made_for_the_cache_are_private_whatever_the_umask(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where a group shares what its members make, the cache is still one's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "new" / "cache"))
    before = os.umask(0o002)
    try:
        made = cached("name", make)
    finally:
        os.umask(before)
    assert made.stat().st_mode & 0o777 == 0o600
    assert {place.stat().st_mode & 0o777 for place in list(made.parents)[:3]} == {0o700}


def test_the_cache_is_used_where_its_path_leads(empty_cache: Path, tmp_path: Path) -> None:
    """A link in its path, which somebody may turn round later, is followed once."""
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    empty_cache.symlink_to(tmp_path / "elsewhere")
    assert cached("name", make).parent == tmp_path / "elsewhere"


@pytest.mark.parametrize("plant", ["writable by others", "link", pytest.param("foreign", marks=AS_ROOT)])
def test_a_planted_build_is_not_trusted(empty_cache: Path, tmp_path: Path, plant: str) -> None:
    """Put there while others could write to the folder, under the name that its content asks for."""
    planted = cached("name", make)
    before = planted.stat().st_ino
    match plant:
        case "writable by others":
            planted.chmod(0o666)
        case "link":
            planted.rename(tmp_path / "theirs")
            planted.symlink_to(tmp_path / "theirs")
        case _:
            os.chown(planted, STRANGER, STRANGER)
    found = cached("name", make)
    assert found.lstat().st_ino != before
    assert (found.is_symlink(), found.stat().st_uid, found.stat().st_mode & 0o777) == (
        False,
        os.getuid(),
        0o600,
    )
    assert list(empty_cache.iterdir()) == [found]


def test_a_cache_named_by_a_relative_path_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """It would be another in every folder, such as one that came with somebody's sources."""
    monkeypatch.setenv("XDG_CACHE_HOME", "cache")
    with pytest.raises(CacheError, match="cache/mambo-nmpc must be an absolute path; set XDG_CACHE_HOME"):
        cache_folder()


def test_a_build_that_ends_meanwhile_disturbs_no_other(empty_cache: Path) -> None:
    """The work folder of another process may go between being listed and being looked at."""
    (cache_folder() / "build-gone").symlink_to("gone")
    assert cached("name", make).parent == empty_cache


def test_a_build_happens_once_and_leaves_nothing_else(empty_cache: Path) -> None:
    """The second request finds the first one's file; the work folder is gone."""
    built = []

    def build(folder: Path) -> Path:
        built.append(folder)
        (folder / "made").write_text("made")
        return folder / "made"

    first = cached("name", build)
    assert cached("name", build) == first
    assert len(built) == 1
    assert list(empty_cache.iterdir()) == [first]
    assert first.name.endswith("-name")


def test_a_damaged_build_is_built_anew(empty_cache: Path) -> None:
    """Cut short by a full disk or a crash, it would kill the process that loads it."""
    for damage in ("", "ma"):
        cached("name", make).write_text(damage)
        assert cached("name", make).read_text() == "made"
    assert len(list(empty_cache.iterdir())) == 1


def test_what_cannot_be_loaded_is_refused(empty_cache: Path) -> None:
    """The message names the folder, and what to set if it may hold no programs."""
    script = 'case "$*" in *extension.so) echo no library > extension.so;; esac'
    with pytest.raises(CacheError, match=rf"cannot load {empty_cache}/.*noexec, set XDG_CACHE_HOME"):
        compiled(MAMBO, Toolchain(("sh", "-c", script, "cc")))


def test_what_killed_builds_left_is_cleared(empty_cache: Path) -> None:
    """An old work folder goes with the next build; a young one may be at work."""
    for name, age_s in (("build-old", 4000.0), ("build-young", 0.0)):
        (cache_folder() / name).mkdir()
        then = time.time() - age_s
        os.utime(empty_cache / name, (then, then))

    made = cached("name", make)
    assert set(empty_cache.iterdir()) == {made, empty_cache / "build-young"}


def test_a_failed_build_leaves_nothing(empty_cache: Path) -> None:
    """An error in the middle: no file, no work folder, and the next request builds again."""

    def fail(folder: Path) -> Path:
        (folder / "half").write_text("half")
        raise BuildError("no")

    with pytest.raises(BuildError):
        cached("name", fail)
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


def test_the_named_compiler_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """CC may hold arguments too; one that does not exist is named in the message."""
    monkeypatch.setenv("CC", "gcc -O1")
    assert host_toolchain().command == ("gcc", "-O1")
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(BuildError, match="cannot run the C compiler no-such-compiler"):
        CompiledController(MAMBO)


@pytest.mark.usefixtures("empty_cache")
@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("true", "true made nothing; is it a C compiler"),
        ("false", r"(?s)^false .*failed:\nexit code 1, without a word"),
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
    """A build runs in a folder of its own; CC is relative to where the user stands."""
    gcc = require("gcc", "gcc")
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "cc").symlink_to(gcc)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CC", "bin/cc")
    assert CompiledController(MAMBO).settings == MAMBO


@pytest.mark.usefixtures("empty_cache")
def test_a_refusing_compiler_is_quoted() -> None:
    """A flag that the compiler does not know: its own words, and nothing cached."""
    require("gcc", "gcc")
    with pytest.raises(BuildError, match=r"(?s)failed:.*--no-such-flag"):
        compiled(MAMBO, Toolchain(("gcc", "--no-such-flag")))


def test_wrong_shapes_are_refused() -> None:
    """A batch of another size would read beyond the arrays: it is an error instead."""
    controller = CompiledController(MAMBO, 2)
    with pytest.raises(ValueError, match=r"expected an array of shape \(2, 7\), got \(1, 7\)"):
        controller.step([[0.0] * 7], [[0.0] * 4] * 2, [9.81] * 2)
