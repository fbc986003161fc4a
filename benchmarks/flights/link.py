"""Flights over MAVLink with an autopilot of our own behind a UDP socket: curves, a bad wire, jumps, a pause.

    python -m benchmarks.flights.link FOLDER

writes figures.json. Each flight is flown by both autopilots at several headings; a figure is the worst of
them. The drone is `link-drone.toml`, whose state the autopilot knows without noise; its settings are those
that `design` derives.
"""

import json
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.flights.wire import Faults, WiredLink
from mambo_codegen.settings import controller_toml
from mambo_extensions.mavlink.pilot import Pilot
from mambo_extensions.mavlink.simulated import Condition
from mambo_sil.api.api_controller import Controller
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.errors import PilotError
from mambo_sil.flight.states import TargetState
from mambo_sil.flight.trajectories import Circle, Gerono, Trajectory
from mambo_sil.life.records import STACKS, EstimatedState
from mambo_sil.life.steady_frame import SteadyFrame
from mambo_sil.life.steering import Update
from mambo_sil.model.derive.derived_flight import chosen_text

DRONE: Final = Path(__file__).parents[1] / "evidence" / "link-drone.toml"
HEADINGS_RAD: Final = (0.0, 1.3, 2.9, -1.9)
CURVES: Final[dict[str, Trajectory]] = {
    "eight 2 m, 0.5 rad/s": Gerono(2.0, 0.5),
    "circle 1 m, 1.5 rad/s": Circle(1.0, 1.5),
    "eight 2 m, 1 rad/s": Gerono(2.0, 1.0),
}
WIRES: Final = {
    "clean": Faults(),
    "10 % lost": Faults(lost=0.1),
    "20 % lost": Faults(lost=0.2),
    "40 % lost": Faults(lost=0.4),
    "20 % late by 30 ms": Faults(late=0.2),
    "20 % doubled": Faults(doubled=0.2),
    "20 % followed by garbage": Faults(garbage=0.2),
    "all 10 ms later": Faults(delay_s=0.01),
    "all 20 ms later": Faults(delay_s=0.02),
    "all 40 ms later": Faults(delay_s=0.04),
}
"""Faults of both directions."""
JUMPS_M: Final = (0.1, 0.2, 0.4)
SETTLES_S: Final = 5.0
FLOWN_S, HOVERED_S = 20.0, 6.0
HEIGHT_M: Final = 1.5


class JumpingFrame(SteadyFrame):
    """The frame of the estimator as it is."""

    def follow(self, estimate: EstimatedState) -> None:
        """Take no change for a jump."""


@dataclass
class WiredFlight:
    """A flight: its steps, the end of it, and what has happened to the drone since it hovers."""

    updates: list[Update] = field(default_factory=list)
    end: str = ""

    def rms_cm(self) -> float:
        """Return the rms of the distance in the plane, as estimated."""
        return 100.0 * float(np.sqrt(np.mean(self._errors_m() ** 2)))

    def largest_cm(self) -> float:
        """Return the largest distance in the plane, as estimated."""
        return 100.0 * float(self._errors_m().max())

    def bump_deg(self, before: float) -> float:
        """Return by how much the command moves after a time."""
        time_s = np.array([one.estimate.time_s for one in self.updates])
        command_rad = np.array([one.command_rad for one in self.updates])
        there = command_rad[time_s < before][-1]
        return math.degrees(float(np.abs(command_rad[time_s >= before] - there).max()))

    def _errors_m(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        time_s = np.array([one.estimate.time_s for one in self.updates])
        error_m = np.array([one.estimate.position_m - one.target.position_m for one in self.updates])
        return np.asarray(np.linalg.norm(error_m[time_s > time_s[0] + SETTLES_S, :2], axis=1))


def fly(
    stack: str,
    drone: VehicleFile,
    heading_rad: float,
    course: Callable[[Pilot], None],
    *,
    faults: Faults | None = None,
    happens: Callable[[WiredLink, float], None] = lambda link, time_s: None,  # noqa: ARG005 - nothing does
    frame: SteadyFrame | None = None,
) -> WiredFlight:
    """Fly a course from the ground to the ground; `happens` is called with the time since the take-over."""
    text = chosen_text(vehicle_toml.read(DRONE), DRONE.name)
    settings = controller_toml.parse(text, DRONE.name)
    flown, begun_s = WiredFlight(), math.inf
    link = WiredLink(stack, drone, Condition(yaw_rad=heading_rad))

    def watch(_: Pilot) -> None:
        happens(link, link.now_s() - begun_s)

    pilot = Pilot(Controller(settings), lambda: link, flown.updates.append, watch)
    if frame is not None:
        pilot.steering.frame = frame
    with pilot:
        pilot.take_off(HEIGHT_M)
        link.wire.to_pilot = link.wire.to_autopilot = faults or Faults()
        begun_s = link.now_s()
        try:
            course(pilot)
            flown.end = pilot.land()
        except PilotError as error:
            flown.end = str(error)
    return flown


def along(curve: Trajectory) -> Callable[[Pilot], None]:
    """Return the course of a curve."""
    return lambda pilot: pilot.fly(curve, FLOWN_S)


def hover(pilot: Pilot) -> None:
    """Hover above the place of take-off."""
    place = TargetState([0.0, 0.0, -HEIGHT_M], np.zeros(3), np.zeros(3))
    pilot.follow(lambda time_s: place, HOVERED_S)  # noqa: ARG005 - it stays


def worst(stack: str, drone: VehicleFile, curve: Trajectory, faults: Faults | None = None) -> dict[str, Any]:
    """Return the worst figures of a curve over the headings."""
    flights = [fly(stack, drone, heading, along(curve), faults=faults) for heading in HEADINGS_RAD]
    return {
        "rms_cm": max(one.rms_cm() for one in flights),
        "largest_cm": max(one.largest_cm() for one in flights),
        "landed": sum(one.end == "landed: as planned" for one in flights),
        "flights": len(flights),
    }


def jump(stack: str, drone: VehicleFile, size_m: float, frame: type[SteadyFrame]) -> dict[str, float]:
    """Return by how much a jump of the estimator moves the command, the worst of the headings."""
    found = []
    for heading_rad in HEADINGS_RAD:
        jumped_s: list[float] = []

        def happens(link: WiredLink, time_s: float) -> None:
            if time_s > 1.0 and not jumped_s:  # noqa: B023 - flown before the next heading
                jumped_s.append(link.now_s())  # noqa: B023 - the same
                link.autopilot.reset_estimator(np.array([0.8 * size_m, -0.6 * size_m, 0.0]), 0.1)

        flown = fly(stack, drone, heading_rad, hover, happens=happens, frame=frame())
        found.append(flown.bump_deg(jumped_s[0] - 1e-9))
    return {"bump_deg": max(found)}


def pause(stack: str, drone: VehicleFile) -> dict[str, float]:
    """Return how far a drone is from its place while no message passes for a second, and how it ends."""
    found = []
    for heading_rad in HEADINGS_RAD:

        def happens(link: WiredLink, time_s: float) -> None:
            lost = Faults(lost=1.0 if 10.0 < time_s < 10.95 else 0.0)
            link.wire.to_pilot = link.wire.to_autopilot = lost

        flown = fly(stack, drone, heading_rad, along(CURVES["eight 2 m, 0.5 rad/s"]), happens=happens)
        found.append((flown.largest_cm(), flown.end == "landed: as planned"))
    return {"largest_cm": max(cm for cm, _ in found), "landed": sum(landed for _, landed in found)}


def main(folder: Path) -> None:
    """Fly all cases."""
    drone = vehicle_toml.read(DRONE)
    attitude = drone.attitude.model_copy(update={"rate_hz": 250})
    quick = drone.model_copy(update={"attitude": attitude})
    eight = CURVES["eight 2 m, 0.5 rad/s"]
    figures = {
        "curves": {
            name: {stack: worst(stack, drone, curve) for stack in STACKS} for name, curve in CURVES.items()
        },
        "wires": {
            name: {stack: worst(stack, drone, eight, faults) for stack in STACKS}
            for name, faults in WIRES.items()
        }
        | {"intervals of 8 and 12 ms": {stack: worst(stack, quick, eight) for stack in STACKS}},
        "jumps": {
            f"{size_m:g}": {
                stack: {
                    "held": jump(stack, drone, size_m, SteadyFrame),
                    "as it is": jump(stack, drone, size_m, JumpingFrame),
                }
                for stack in STACKS
            }
            for size_m in JUMPS_M
        },
        "pause": {stack: pause(stack, drone) for stack in STACKS},
    }
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "figures.json").write_text(json.dumps(figures, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
