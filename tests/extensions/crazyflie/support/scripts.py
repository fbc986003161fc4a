"""The scripts of the Crazyflie's app: imported and run, with a drone of plain values or one on the desk."""

import builtins
import dataclasses
import importlib
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import numpy as np
import pytest

from mambo_codegen.settings import presets
from mambo_extensions.crazyflie.desk.desk_flight import Desk
from tests.extensions.crazyflie.support.radio import ARMED, CAN_FLY, FLYING, Clock, Drone, install

SETTINGS = presets.preset("crazyflie")
PLACE = (1.0, -0.5, 0.1)
"""Where the drone stands: x, y, height of the floor."""
PACKAGE = "crazyflie_flight"
_PARTS = (
    *("values", "ends", "calls", "figures", "heading", "radio", "checks", "flying", "possible"),
    *("log_file", "simulated_drone"),
)
MODULES = {
    PACKAGE: PACKAGE,
    **{name: f"{PACKAGE}.{name}" for name in _PARTS},
    **{name: name for name in ("fly", "offboard")},
}
"""Modules of the scripts by their short names, each behind those that it imports."""


def modules_of(folder: Path, patch: pytest.MonkeyPatch) -> dict[str, ModuleType]:
    """Import the modules of a folder."""
    patch.syspath_prepend(str(folder))
    patch.setattr(sys, "dont_write_bytecode", True)
    for name in MODULES.values():
        patch.delitem(sys.modules, name, raising=False)
    found = {short: importlib.import_module(name) for short, name in MODULES.items()}
    for short, name in MODULES.items():
        patch.delitem(sys.modules, name)
        patch.setitem(sys.modules, name, found[short])
    return found


def change_values(scripts: dict[str, ModuleType], **values: float) -> None:
    """Let the scripts have other values of their settings."""
    possible = vars(scripts["possible"])
    possible["VALUES"] = dataclasses.replace(possible["VALUES"], **values)


def figure_of(scripts: dict[str, ModuleType], *arguments: str) -> Any:
    """Return the figure that a command line names."""
    reader = scripts["fly"].parser()
    return scripts["fly"].figure_of(reader.parse_args(arguments), reader)


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
    radio = scripts["radio"]
    logged: dict[str, float] = {name: 0.0 for block in radio.LOGGED for name in block}
    logged |= dict.fromkeys((*radio.PLACE, *radio.CHECKS, *radio.APP_CHECKS), 0.0)
    logged |= {f"stateEstimate.{name}": value for name, value in zip("xyz", PLACE, strict=True)}
    logged |= dict.fromkeys(("kalman.varPX", "kalman.varPY", "kalman.varPZ", "kalman.varX"), 1e-4)
    logged |= {"stateEstimate.yaw": 30.0, "supervisor.info": ARMED | CAN_FLY, "pm.vbat": 4.0, "pm.state": 0}
    parameters = {
        "nmpc.settings": int(scripts["radio"].DIGEST[:8], 16),
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


TICK_MS: Final = 10
PIECE_BYTES: Final = 132


@dataclass
class DeskDrone(Drone):
    """What scripts reach: calls go to the desk, logs come from it."""

    desk: Desk | None = None
    off_m: list[float] = field(default_factory=list)
    """Horizontal distance to the target while there is one, every 10 ms."""
    hopped: int = 0
    """How many of these were noted before the first landing."""

    def tick(self) -> None:
        """Fly on, and read all logs but those of battery, supervisor and the velocity's variances."""
        assert self.desk is not None
        self.desk.run(TICK_MS)
        for name in self.logged:
            if not name.startswith(("pm.", "supervisor.", "kalman.varP")):
                self.logged[name] = self.desk.log(name)
        if int(self.logged["supervisor.info"]) & FLYING and self.desk.log("ctrltarget.z") > 0.0:
            target = [self.desk.log("ctrltarget.x"), self.desk.log("ctrltarget.y")]
            self.off_m.append(math.dist(self.desk.state.position_m[:2], target))

    def write(self, address: int, data: bytes) -> None:
        """Take a part of a write, and pass the pieces that it touches on."""
        super().write(address, data)
        assert self.desk is not None
        for number in {address // PIECE_BYTES, (address + len(data) - 1) // PIECE_BYTES}:
            piece = self.memory[number * PIECE_BYTES : (number + 1) * PIECE_BYTES]
            self.desk.write_pieces(np.frombuffer(piece, np.float32).astype(np.float64)[np.newaxis], number)

    def note(self, name: str, *arguments: Any) -> None:
        """Note a call, and pass it on."""
        super().note(name, *arguments)
        assert self.desk is not None
        yaw_rad = math.radians(self.logged["stateEstimate.yaw"])
        if name == "takeoff":
            self.desk.take_off(arguments[0], arguments[1], yaw_rad)
        elif name == "land":
            self.hopped = self.hopped or len(self.off_m)
            self.desk.land(arguments[1], arguments[0], yaw_rad)
        elif name == "go_to":
            self.desk.go_to(arguments[:3], arguments[4], arguments[3])
        elif name == "full_state":
            self.desk.full_state(np.array(arguments[:3]), yaw_rad)
        elif name == "notify":
            self.desk.yield_()
        elif name == "start_trajectory":
            self.desk.start_trajectory(self.of("define_trajectory")[-1][1][2])
        elif name == "stop" and int(self.logged["supervisor.info"]) & FLYING:
            self.desk.stop()


@dataclass
class DeskClock(Clock):
    """A clock with whose time the drone on the desk flies."""

    drone: DeskDrone | None = None

    def sleep(self, duration_s: float) -> None:
        """Let time pass in ticks, whose logs arrive."""
        assert self.drone is not None
        for _ in range(max(1, round(1000.0 * duration_s) // TICK_MS)):
            self.drone.tick()
            super().sleep(0.001 * TICK_MS)


def ready_on_desk(scripts: dict[str, ModuleType], patch: pytest.MonkeyPatch, desk: Desk) -> DeskDrone:
    """Return a drone on the desk that is ready to fly, and put it and its clock under the scripts."""
    found = ready(scripts, patch)
    clock = DeskClock()
    drone = DeskDrone(clock, found.logged, found.parameters, desk=desk)
    clock.drone = drone
    install(drone, patch)
    for name in ("fly", "radio"):
        patch.setattr(scripts[name], "time", clock)
    return drone


def largest_m(drone: DeskDrone) -> float:
    """Return the largest distance to the target."""
    return float(np.max(drone.off_m))


def uploaded(drone: Drone) -> Any:
    """Return the pieces in the drone's memory (n, 33)."""
    count = drone.of("define_trajectory")[0][1][2]
    return np.frombuffer(drone.memory[: PIECE_BYTES * count], "<f4").astype(float).reshape(-1, 33)


def evaluate(pieces: Any, time_s: float, order: int = 0) -> Any:
    """Return x, y, z and yaw, or a derivative of them, at a time."""
    for piece in pieces:
        if time_s <= piece[32]:
            break
        time_s -= piece[32]
    polynomials = [np.polynomial.Polynomial(piece[8 * k : 8 * k + 8]) for k in range(4)]
    return np.array([each.deriv(order)(time_s) if order else each(time_s) for each in polynomials])
