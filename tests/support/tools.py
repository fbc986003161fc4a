"""Tools that may be missing: a skip that names them, and a failure where they are demanded."""

import os
import shutil

import pytest

from codegen.toolchain import Toolchain


def require(tool: str, package: str) -> str:
    """Return the path of `tool`; without it skip the test, or fail it where CI is true."""
    path = shutil.which(tool)
    if path is None:
        message = f"{tool} is missing; Debian's package {package} brings it"
        if os.environ.get("CI") == "true":
            pytest.fail(message)
        pytest.skip(message)
    return path


def toolchain(compiler: str, optimisation: str | None = None) -> Toolchain:
    """Return `compiler`, gcc or clang, at `optimisation`, if it is here."""
    require(compiler, compiler)
    return Toolchain((compiler,), optimisation)
