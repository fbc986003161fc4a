"""The scripts of the Crazyflie's app: written, imported and run."""

import builtins
import importlib
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from mambo_codegen.bundle.render import render_target
from mambo_codegen.bundle.targets import TARGETS
from mambo_codegen.settings import presets
from mambo_codegen.settings.model import Settings
from tests.support.bundles import place

SETTINGS = presets.preset("crazyflie")
MODULES = ("heading", "radio", "figures", "checks", "fly", "simulated_drone", "offboard")


def write(settings: Settings, folder: Path) -> Path:
    """Write the target for `settings` into `folder`."""
    return place(render_target(settings, TARGETS["crazyflie"], with_digest=False), folder)


def modules_of(folder: Path, patch: pytest.MonkeyPatch) -> dict[str, ModuleType]:
    """Import the modules of a folder."""
    patch.syspath_prepend(str(folder))
    patch.setattr(sys, "dont_write_bytecode", True)
    for name in MODULES:
        patch.delitem(sys.modules, name, raising=False)
    found = {name: importlib.import_module(name) for name in MODULES}
    for name in MODULES:
        patch.delitem(sys.modules, name)
        patch.setitem(sys.modules, name, found[name])
    return found


def run(scripts: dict[str, ModuleType], *arguments: str) -> int:
    """Run fly.py with arguments; return its exit code."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["fly.py", *arguments])
        return int(scripts["fly"].main())


def without(patch: pytest.MonkeyPatch, package: str) -> None:
    """Make a package one that is not installed."""
    original = builtins.__import__

    def guarded(name: str, *arguments: Any, **options: Any) -> Any:
        if name.partition(".")[0] == package:
            raise ModuleNotFoundError(f"No module named {name!r}")
        return original(name, *arguments, **options)

    patch.setattr(builtins, "__import__", guarded)
