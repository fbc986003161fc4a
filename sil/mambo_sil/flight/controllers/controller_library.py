"""Load a bundle as a shared library, built with the host's compiler.

The glue passes arrays and instances of unknown layout only, so nothing here can disagree with the bundle's
headers; its assertions check that the structs are the arrays that Python fills.
"""

import hashlib
from collections.abc import Callable, Mapping
from functools import lru_cache
from importlib import resources
from importlib.resources.abc import Traversable
from typing import Any, Final

from mambo_codegen.bundle.flags import COMPILE_FLAGS
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_codegen.toolchain import Toolchain
from mambo_sil.flight.controllers import controller_interface
from mambo_sil.flight.controllers.port_lists import port_lists
from mambo_sil.results.shared_library import LibrarySource, load_shared_library

DECLARATIONS: Final = """
    void nmpc_batch_init(void *controllers, int n);
    void nmpc_batch_step(void *controllers, int n, const void *state, const void *target, const void *thrust,
                         const void *outcome);
    unsigned long nmpc_batch_instance_bytes(void);
    void nmpc_host_reset(void *controllers, int n, const void *command, int *status);
    void nmpc_host_set_weights(void *controllers, int n, const void *weights, int *status);
    void nmpc_host_report_command(void *controllers, int n, const void *command, int *status);
    void nmpc_host_frame_jumped(void *controllers, int n, const void *change, int *status);
    void nmpc_host_report_thrust(void *controllers, int n, const void *thrust, int *status);
    void nmpc_host_last_thrust(const void *controllers, int n, void *thrust);
    void nmpc_host_last_disturbance(const void *controllers, int n, void *disturbance);
    void nmpc_host_set_limits(void *controllers, int n, const void *limits, int *status);
    void nmpc_host_set_position_measured(void *controllers, int n, const void *is_measured, int *status);
    void nmpc_host_slew_heading(int n, const double *previous, const double *wanted, double most_change,
                                double *next);
    int64_t nmpc_host_step(void *controller, const double *state, const double *target,
                           double thrust_acceleration_m_s2, double *command);
    unsigned long nmpc_self_test_episode(void *scratch, int episode, unsigned long digest);
"""
"""The functions that Python calls in a library: the glue, and one step of the self-test.

nmpc_host_set_weights is there with a 1-norm, nmpc_host_report_command and nmpc_host_last_disturbance with a
quadratic cost,
nmpc_host_report_thrust and nmpc_host_last_thrust with a height, nmpc_host_set_limits with limits,
nmpc_host_set_position_measured with a guard. `ffi` is made from them.
"""

ffi: Final[Any] = controller_interface.ffi


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

    def files() -> dict[str, str]:
        from mambo_codegen.bundle.render import render  # noqa: PLC0415 - slow to import, and mostly cached

        return render(settings, with_digest=False)

    key = ("settings", generator_digest(), settings.model_dump_json())
    return _load(key, files, toolchain)


def load_library(files: dict[str, str], toolchain: Toolchain) -> Any:
    """Return the library of a bundle with prefix nmpc, given as text by path; builds it unless it is cached.

    Raises BuildError, CacheError.
    """
    return _load(("files", files), lambda: files, toolchain)


def _load(key: object, generate: Callable[[], Mapping[str, str]], toolchain: Toolchain) -> Any:
    """Return the library of the C that `generate` returns, with the glue; `key` determines that C."""

    def files() -> dict[str, str]:
        return c_files(generate()) | glue()

    return load_shared_library(LibrarySource("nmpc", (key, glue()), files, COMPILE_FLAGS, ffi), toolchain)


def c_files(bundle: Mapping[str, str]) -> dict[str, str]:
    """Return the controller and its self-test of a bundle: the C beside its README."""
    return {path: text for path, text in bundle.items() if path.endswith((".c", ".h")) and "/" not in path}


@lru_cache
def _text(name: str) -> str:
    """Return C that is compiled with a bundle, with the lists of the port's rows behind its headers."""
    text = resources.files("mambo_sil.flight.controllers").joinpath(name).read_text("utf-8")
    before, header, after = text.partition('#include "nmpc.h"\n')
    return before + header + port_lists() + after


@lru_cache
def generator_digest() -> str:
    """Return a hash of everything that turns settings into C."""
    hasher = hashlib.sha256()

    def update(folder: Traversable) -> None:
        for entry in sorted(folder.iterdir(), key=lambda entry: entry.name):
            if entry.is_dir():
                if entry.name != "__pycache__":
                    update(entry)
            else:
                hasher.update(entry.name.encode() + b"\0" + entry.read_bytes() + b"\0")

    for package in ("mambo_codegen", "mambo_templates"):
        update(resources.files(package))
    return hasher.hexdigest()
