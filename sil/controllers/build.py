"""Build a bundle as a shared library with the host's compiler, cache it, and load it.

The glue passes arrays and instances of unknown layout only, so nothing here can disagree with the bundle's
headers; its assertions check that the structs are the arrays that Python fills.
"""

import hashlib
import re
import shlex
from functools import lru_cache
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, Final

import cffi

from mambo_nmpc.codegen.errors import BuildError
from mambo_nmpc.codegen.flags import COMPILE_FLAGS
from mambo_nmpc.codegen.render import render
from mambo_nmpc.codegen.settings.controller_toml import with_option
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.codegen.toolchain import Toolchain
from mambo_nmpc.sil.errors import CacheError
from mambo_nmpc.sil.files.cache import build_cached

DECLARATIONS: Final = """
    void nmpc_batch_init(void *controllers, int n);
    void nmpc_batch_step(void *controllers, int n, const void *state, const void *target, const void *thrust,
                         const void *outcome);
    unsigned long nmpc_batch_instance_bytes(void);
    void nmpc_host_reset(void *controllers, int n, const void *command, int *status);
    void nmpc_host_set_weights(void *controllers, int n, const void *weights, int *status);
    int64_t nmpc_host_step(void *controller, const double *state, const double *target,
                           double thrust_acceleration_m_s2, double *command_rad);
    unsigned long nmpc_self_test_episode(void *scratch, int episode, unsigned long digest);
"""
"""The functions that Python calls in a library: those of the glue, and one step of the self-test."""

ffi: Final = cffi.FFI()
ffi.cdef(DECLARATIONS)

_LINK_FLAGS: Final = ("-fPIC", "-shared", "-Iinclude", "-Isrc")
_LOADED: Final[dict[str, Any]] = {}


def with_default_prefix(settings: Settings) -> Settings:
    """Return `settings` with the prefix nmpc, which the Python side expects; no computed value changes."""
    return with_option(settings, "code.prefix", "nmpc")


def batch_source() -> str:
    """Return the C that loops over n controllers, to compile with a bundle."""
    return _text("batch.c")


def glue() -> dict[str, str]:
    """Return the C that is compiled with a bundle for this machine, by file name."""
    return {name: _text(name) for name in ("batch.c", "host.c")}


def build_library(settings: Settings, toolchain: Toolchain) -> Any:
    """Return the library of the C of `settings`; generates and builds it unless it is cached.

    Raises BuildError, CacheError.
    """
    settings = with_default_prefix(settings)
    key = ("settings", _generator_digest(), settings.model_dump_json())
    return _load(key, lambda: render(settings, with_digest=False), toolchain)


def load_library(files: dict[str, str], toolchain: Toolchain) -> Any:
    """Return the library of a bundle with prefix nmpc, given as text by path; builds it unless it is cached.

    Raises BuildError, CacheError.
    """
    return _load(("files", files), lambda: files, toolchain)


def _load(key: object, generate: Any, toolchain: Toolchain) -> Any:
    beside = glue()
    contents = (key, beside, COMPILE_FLAGS, _LINK_FLAGS, toolchain, toolchain.identity())
    name = f"nmpc_{hashlib.sha256(repr(contents).encode()).hexdigest()[:32]}.so"
    if name not in _LOADED:

        def build(folder: Path) -> Path:
            files = generate() | beside
            for path, text in files.items():
                (folder / path).parent.mkdir(parents=True, exist_ok=True)
                (folder / path).write_text(text, "utf-8")
            sources = sorted(path for path in files if re.fullmatch(r"src/.*\.c", path))
            flags = [*COMPILE_FLAGS, *([toolchain.optimisation] if toolchain.optimisation else [])]
            toolchain.run([*flags, *_LINK_FLAGS, *sources, *beside, "-o", "nmpc.so"], folder)
            if not (folder / "nmpc.so").is_file():
                raise BuildError(f"{shlex.join(toolchain.command)} wrote no output; set CC to a C compiler")
            return folder / "nmpc.so"

        _LOADED[name] = open_library(build_cached(name, build), ffi)
    return _LOADED[name]


def open_library(path: Path, declarations: cffi.FFI) -> Any:
    """Load the shared library at `path`; raises CacheError if that fails."""
    try:
        return declarations.dlopen(str(path))
    except OSError as error:
        reason = str(error).removeprefix(f"cannot load library '{path}': ").removeprefix(f"{path}: ")
        raise CacheError(
            f"cannot load {path}: {reason}; if its folder is mounted noexec, set XDG_CACHE_HOME elsewhere"
        ) from error


@lru_cache
def _text(name: str) -> str:
    return resources.files("mambo_nmpc.sil.controllers").joinpath(name).read_text("utf-8")


@lru_cache
def _generator_digest() -> str:
    """Return a hash of everything that turns settings into C."""
    hasher = hashlib.sha256()

    def update(folder: Traversable) -> None:
        for entry in sorted(folder.iterdir(), key=lambda entry: entry.name):
            if entry.is_dir():
                if entry.name != "__pycache__":
                    update(entry)
            else:
                hasher.update(entry.name.encode() + b"\0" + entry.read_bytes() + b"\0")

    for package in ("codegen", "templates"):
        update(resources.files(f"mambo_nmpc.{package}"))
    return hasher.hexdigest()
