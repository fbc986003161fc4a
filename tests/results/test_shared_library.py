"""Shared libraries of C: built once for each source and compiler, loaded, or refused with the reason."""

import itertools
from pathlib import Path

import cffi
import pytest

from mambo_codegen.errors import BuildError, CacheError
from mambo_codegen.toolchain import Toolchain
from mambo_sil.results.shared_library import LibrarySource, load_shared_library
from tests.support.tools import require, toolchain

pytestmark = pytest.mark.usefixtures("empty_cache")

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
