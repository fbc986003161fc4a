"""Compile C as a shared library with the host's compiler, cache it, and load it."""

import hashlib
import platform
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from mambo_codegen.errors import BuildError, CacheError
from mambo_codegen.toolchain import Toolchain
from mambo_sil.results.build_folders import build_cached, write_sources

if TYPE_CHECKING:
    import _cffi_backend
    import cffi

LIBRARY_FLAGS: Final = (
    *("-fPIC", "-shared"),
    *(("-mno-fma", "-mno-avx512f") if platform.machine() in ("x86_64", "AMD64", "i686") else ()),
)
"""Flags that make a library of what would be a program, without fused operations.

gcc 12 fuses some in spite of -ffp-contract=off if CC has -mfma, -mavx512vl or -march=native.
"""

_LOADED: Final[dict[str, Any]] = {}


@dataclass(frozen=True)
class LibrarySource:
    """C from which a shared library is built.

    name:      first part of the library's file name, which its purpose determines.
    key:       whatever determines the files; its `repr` distinguishes it from every other key.
    files:     returns the text of all files by path; every *.c and *.cpp is compiled. Called only to build.
    flags:     flags of the compiler besides `LIBRARY_FLAGS`.
    libraries: flags that name libraries to link with.
    interface: declares the functions that Python calls.
    """

    name: str
    key: object
    files: Callable[[], Mapping[str, str]]
    flags: tuple[str, ...]
    interface: "_cffi_backend.FFI | cffi.FFI"
    libraries: tuple[str, ...] = ()


def load_shared_library(source: LibrarySource, toolchain: Toolchain) -> Any:
    """Return the library of `source`, built with `toolchain` unless it is cached.

    Raises what `built_library` raises, and CacheError if the library cannot be loaded.
    """
    name = _file_name(source, toolchain)
    if name not in _LOADED:
        _LOADED[name] = load_library(built_library(source, toolchain), source.interface)
    return _LOADED[name]


def built_library(source: LibrarySource, toolchain: Toolchain) -> Path:
    """Return the path of the library of `source`, built with `toolchain` unless it is cached.

    Raises BuildError, UnwritableError if the compiler had no space for its files, and CacheError if the cache
    cannot be used.
    """

    def build(folder: Path) -> Path:
        files = source.files()
        write_sources(files, folder)
        units = sorted(path for path in files if path.endswith((".c", ".cpp")))
        library = folder / f"{source.name}.so"
        toolchain.run([*_flags(source, toolchain), *units, "-o", library.name, *source.libraries], folder)
        if not library.is_file():
            raise BuildError(f"{shlex.join(toolchain.command)} wrote no output; set CC to a C compiler")
        return library

    return build_cached(_file_name(source, toolchain), build)


def _flags(source: LibrarySource, toolchain: Toolchain) -> tuple[str, ...]:
    return (*source.flags, *((toolchain.optimisation,) if toolchain.optimisation else ()), *LIBRARY_FLAGS)


def _file_name(source: LibrarySource, toolchain: Toolchain) -> str:
    flags = _flags(source, toolchain)
    contents = (source.key, flags, source.libraries, toolchain.command, toolchain.identity())
    return f"{source.name}_{hashlib.sha256(repr(contents).encode()).hexdigest()[:32]}.so"


def load_library(path: Path, interface: "_cffi_backend.FFI | cffi.FFI") -> Any:
    """Load the shared library at `path`; raises CacheError if that fails."""
    try:
        return interface.dlopen(str(path))
    except OSError as error:
        reason = str(error).removeprefix(f"cannot load library '{path}': ").removeprefix(f"{path}: ")
        raise CacheError(
            f"cannot load {path}: {reason}; if its folder is mounted noexec, set XDG_CACHE_HOME elsewhere"
        ) from error
