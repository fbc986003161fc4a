"""Quick curves in crazyflow and RotorPy: their controllers, `design`, the exact thrust vector."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.simulators import rotorpy_flights
from benchmarks.simulators.crazyflow_flights import SEEDS, Mellinger, fly, tuned
from benchmarks.simulators.crazyflow_worlds import FITTED, SimulatedCrazyflie
from benchmarks.simulators.missions import Mission, Score, rms_mm
from benchmarks.simulators.pilots import Challenger, Designed, OurPilot, SimulatorPilot
from benchmarks.simulators.rotorpy_flights import HUMMINGBIRD, RotorpyDrone
from benchmarks.simulators.single import measure, search
from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.controller_toml import with_option
from mambo_nmpc.curves import Circle, Gerono
from mambo_sil.api.api_controller import Controller
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.model.derive.derived_settings import controller_text

WORLDS: Final = (
    ("cf2x_L250", "first_principles", "crazyflie-l250"),
    ("cf2x_L250", FITTED, "crazyflie-l250"),
    ("cf21B_500", FITTED, "crazyflie-brushless"),
    ("hb_x500", FITTED, "x500"),
)
QUICK: Final = {
    "eight 1.0": Mission("eight 1.0 rad/s, mm", Gerono(2.0, 1.0), 18.0, rms_mm),
    "circle 2.0": Mission("circle 2.0 rad/s, mm", Circle(1.0, 2.0), 12.0, rms_mm),
    "eight 1.2": Mission("eight 1.2 rad/s, mm", Gerono(2.0, 1.2), 18.0, rms_mm),
    "circle 2.4": Mission("circle 2.4 rad/s, mm", Circle(1.0, 2.4), 12.0, rms_mm),
}
TUNED_ON: Final = {name: QUICK[name] for name in ("eight 1.0", "circle 2.0")}
POSSIBLE: Final = 0.7
"""Tilt limit over the tilt at which the largest thrust still carries the weight."""


@dataclass(frozen=True)
class Exact:
    """What `design` derives, with the exact thrust vector, more tilt, and the acceleration as it is given."""

    drone: VehicleFile

    def pilot(self, drones: int, mass_kg: float, *, noisy: bool) -> SimulatorPilot:  # noqa: ARG002 - always noisy
        """Return the C for new drones."""
        tilt_rad = POSSIBLE * math.acos(self.drone.weight_n / self.drone.largest_thrust_n)
        settings = controller_toml.parse(controller_text(self.drone, self.drone.name), self.drone.name)
        for key, value in (
            ("model.tilt", "exact"),
            ("target.acceleration", "given"),
            ("target.tracker_gain", 1.0),
            ("guard.tilt_rad", 3.0 * tilt_rad),
            ("guard.tilt_rad_s", 12.0 * tilt_rad),
            ("limits.tilt_rad", tilt_rad),
        ):
            settings = with_option(settings, key, value)
        return OurPilot(Controller(settings, drones), mass_kg)


def measure_all(folder: Path) -> Iterator[tuple[str, dict[str, Any], Mapping[str, Any]]]:
    """Yield title, scores and paths (none) of each drone with each model."""
    for drone, model, vehicle in WORLDS:
        world = SimulatedCrazyflie(drone, model, vehicle)
        best, factors = tuned(world, TUNED_ON)
        (folder / f"{drone}-{model}-found.txt").write_text(f"{factors}\n", "utf-8")
        challengers = {"Mellinger": Mellinger(drone), "Mellinger, tuned": best}
        challengers |= _ours(vehicle_toml.preset(vehicle))
        figures: dict[str, dict[str, list[Score]]] = {title: {} for title in challengers}
        for name, mission in QUICK.items():
            flown, _ = fly(world, list(challengers.values()), mission, SEEDS)
            scores = mission.scores(flown)
            for number, title in enumerate(challengers):
                figures[title][name] = scores[len(SEEDS) * number : len(SEEDS) * (number + 1)]
            print(f"{world.title}: {name}", flush=True)
        yield world.title, figures, {}
    yield from _hummingbird(folder)


def _hummingbird(folder: Path) -> Iterator[tuple[str, dict[str, Any], Mapping[str, Any]]]:
    noise = rotorpy_flights.noise()
    _, factors = search(RotorpyDrone, 6, noise, TUNED_ON)
    (folder / "hummingbird-found.txt").write_text(f"{factors}\n", "utf-8")
    challengers = {"SE3Control": np.ones(6), "SE3Control, tuned": np.array(factors)} | _ours(HUMMINGBIRD)
    contestants = {who: partial(RotorpyDrone, each) for who, each in challengers.items()}
    yield from measure(rotorpy_flights.TITLE, contestants, noise, missions=QUICK)


def _ours(drone: VehicleFile) -> dict[str, Challenger]:
    return {"ours, by the page": Designed(drone), "ours, exact tilt, acceleration given": Exact(drone)}
