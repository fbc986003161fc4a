"""The scripts of the Crazyflie's app: imported and run."""

import builtins
import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from mambo_codegen.settings import presets
from tests.support.radio import ARMED, CAN_FLY, Clock, Drone, install

SETTINGS = presets.preset("crazyflie")
PLACE = (1.0, -0.5, 0.1)
"""Where the drone stands: x, y, height of the floor."""
MODULES = ("heading", "radio", "figures", "checks", "fly", "simulated_drone", "offboard")


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


def ready(scripts: dict[str, ModuleType], patch: pytest.MonkeyPatch) -> Drone:
    """Return a drone that is ready to fly, and put it and its clock under the scripts."""
    clock = Clock()
    logged: dict[str, float] = {name: 0.0 for block in scripts["radio"].LOGGED for name in block}
    logged |= dict.fromkeys(scripts["radio"].PLACE, 0.0)
    logged |= {f"stateEstimate.{name}": value for name, value in zip("xyz", PLACE, strict=True)}
    logged |= dict.fromkeys(("kalman.varPX", "kalman.varPY", "kalman.varPZ", "kalman.varX"), 1e-4)
    logged |= {"stateEstimate.yaw": 30.0, "supervisor.info": ARMED | CAN_FLY, "pm.vbat": 4.0, "pm.state": 0}
    parameters = {
        "nmpc.settings": int(SETTINGS.short_digest[:8], 16),
        "nmpc.selfTest": 0,
        "nmpc.on": 0,
        "stabilizer.estimator": 2,
        "stabilizer.controller": 1,
        "kalman.resetEstimation": 0,
        "kalman.initialYaw": 0.5,
    }
    found = Drone(clock, logged, parameters)
    install(found, patch)
    for name in ("fly", "radio"):
        patch.setattr(scripts[name], "time", clock)
    return found


def interrupt() -> None:
    """Press Ctrl-C."""
    raise KeyboardInterrupt


def at_call(drone: Drone, name: str, after_s: float, *events: Callable[[], None]) -> None:
    """Let events happen some time after the first call with a name, half a second apart."""

    def watch() -> None:
        if drone.of(name):
            drone.clock.sleeping.remove(watch)
            begun = drone.of(name)[0][0]
            drone.clock.events.extend((begun + after_s + 0.5 * k, event) for k, event in enumerate(events))

    drone.clock.sleeping.append(watch)
