"""Packages that only an adapter needs."""

import importlib
from typing import Any

from mambo_sil.errors import PackageError


def load(module: str, install: str) -> Any:
    """Return a module; raises PackageError, which names the command that installs it, if it is missing."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise PackageError(f"{package} cannot be imported ({error}); install it: {install}") from error
