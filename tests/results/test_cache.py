"""The compile cache: private, one file a build, nothing left by failures; and the shared libraries in it."""

import itertools
import os
import time
from collections.abc import Callable
from pathlib import Path

import cffi
import pytest

from mambo_codegen.errors import BuildError, CacheError
from mambo_codegen.toolchain import Toolchain
from mambo_codegen.user_cache import cache_folder
from mambo_sil.results.build_folders import build_cached
from mambo_sil.results.shared_library import LibrarySource, load_shared_library
from tests.support.tools import require, toolchain

pytestmark = pytest.mark.usefixtures("empty_cache")


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


FFI = cffi.FFI()
FFI.cdef("int answer(void); double rest(double x);")
FILES = {
    "include/answer.h": "#define ANSWER OFFSET\n",
    "src/answer.c": '#include "answer.h"\nint answer(void) { return ANSWER; }\n',
    "rest.c": "#include <math.h>\ndouble rest(double x) { return fmod(x, 4.0); }\n",
}
KEYS = itertools.count()


def source(*flags: str) -> LibrarySource:
    """Return a source that no other test has."""
    return LibrarySource("test", next(KEYS), lambda: FILES, ("-std=c99", "-Iinclude", *flags), FFI, ("-lm",))


def test_every_c_file_is_compiled_with_the_headers_and_libraries() -> None:
    """Two files in two folders, a header, a flag, and a function of libm."""
    library = load_shared_library(source("-DOFFSET=41", "-Wl,--no-undefined"), toolchain("gcc"))
    assert (library.answer(), library.rest(7.0)) == (41, 3.0)


@pytest.mark.long
def test_a_library_is_built_once(empty_cache: Path) -> None:
    """For each key, flag, optimisation and compiler; the files are asked for only to build."""
    asked = []

    def files() -> dict[str, str]:
        asked.append(1)
        return FILES

    def load(key: str, flag: str, compiler: Toolchain) -> object:
        return load_shared_library(LibrarySource("test", key, files, ("-Iinclude", flag), FFI), compiler)

    gcc = toolchain("gcc")
    first = load("one", "-DOFFSET=1", gcc)
    assert load("one", "-DOFFSET=1", gcc) is first
    assert len(asked) == 1
    others = [
        load("two", "-DOFFSET=1", gcc),
        load("one", "-DOFFSET=2", gcc),
        load("one", "-DOFFSET=1", toolchain("gcc", "-O0")),
        load("one", "-DOFFSET=1", Toolchain(("gcc", "-g"))),
    ]
    assert len({first, *others}) == len(asked) == 5
    assert len(list(empty_cache.glob("*-test_*.so"))) == 5


def test_what_cannot_be_loaded_is_refused(empty_cache: Path) -> None:
    """The message names the folder, and what to set if it may hold no programs."""
    require("sh", "dash")
    script = 'case "$*" in *test.so*) echo no library > test.so;; esac'
    with pytest.raises(
        CacheError, match=rf"^cannot load {empty_cache}/.*noexec, set XDG_CACHE_HOME elsewhere"
    ):
        load_shared_library(source(), Toolchain(("sh", "-c", script, "cc")))


def test_a_compiler_that_writes_nothing_is_named(empty_cache: Path) -> None:
    """As a shell would read its command; nothing is cached."""
    require("sh", "dash")
    with pytest.raises(BuildError, match=r"^sh -c 'exit 0' wrote no output; set CC to a C compiler"):
        load_shared_library(source(), Toolchain(("sh", "-c", "exit 0")))
    assert list(empty_cache.iterdir()) == []


def test_a_refusing_compiler_is_quoted(empty_cache: Path) -> None:
    """A flag that the compiler does not know: its own words, and nothing cached."""
    with pytest.raises(BuildError, match=r"(?s)failed:.*--no-such-flag"):
        load_shared_library(source("--no-such-flag"), toolchain("gcc"))
    assert list(empty_cache.iterdir()) == []
