"""A Crazyflie behind cflib's interface that is a flight of the app on the desk."""

import math
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any, Final

import numpy as np
import pytest

from mambo_sil.board.desk.desk_flight import Desk
from tests.support.radio import FLYING, Clock, Drone, install
from tests.support.scripts import ready

TICK_MS: Final = 10


@dataclass
class DeskDrone(Drone):
    """What scripts reach: calls go to the desk, logs come from it; figures that are uploaded do not fly."""

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
