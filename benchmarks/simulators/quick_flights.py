"""Quick curves in crazyflow and RotorPy: their controllers, and what `design` derives."""

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.simulators import rotorpy_flights
from benchmarks.simulators.crazyflow_flights import Mellinger, scored, tuned
from benchmarks.simulators.crazyflow_worlds import FITTED, SimulatedCrazyflie
from benchmarks.simulators.missions import Mission, Score, rms_mm
from benchmarks.simulators.pilots import Challenger, Designed
from benchmarks.simulators.rotorpy_flights import HUMMINGBIRD, RotorpyDrone
from benchmarks.simulators.single import measure, search
from mambo_nmpc.curves import Circle, Gerono
from mambo_sil.drone.vehicles import vehicle_toml

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
OURS: Final = "ours, by the page"
TUNED_ON: Final = {name: QUICK[name] for name in ("eight 1.0", "circle 2.0")}


def measure_all(folder: Path) -> Iterator[tuple[str, dict[str, Any], Mapping[str, Any]]]:
    """Yield title, scores and paths (none) of each drone with each model."""
    for drone, model, vehicle in WORLDS:
        world = SimulatedCrazyflie(drone, model, vehicle)
        best, factors = tuned(world, TUNED_ON)
        (folder / f"{drone}-{model}-found.txt").write_text(f"{factors}\n", "utf-8")
        challengers: dict[str, Challenger] = {"Mellinger": Mellinger(drone), "Mellinger, tuned": best}
        challengers[OURS] = Designed(vehicle_toml.preset(vehicle))
        figures: dict[str, dict[str, list[Score]]] = {title: {} for title in challengers}
        for name, mission in QUICK.items():
            found, _ = scored(world, challengers, name, mission)
            for title, scores in found.items():
                figures[title][name] = scores
        yield world.title, figures, {}
    yield from _hummingbird(folder)


def _hummingbird(folder: Path) -> Iterator[tuple[str, dict[str, Any], Mapping[str, Any]]]:
    noise = rotorpy_flights.noise()
    _, factors = search(RotorpyDrone, 6, noise, TUNED_ON)
    (folder / "hummingbird-found.txt").write_text(f"{factors}\n", "utf-8")
    challengers = {"SE3Control": np.ones(6), "SE3Control, tuned": np.array(factors)} | {
        OURS: Designed(HUMMINGBIRD)
    }
    contestants = {who: partial(RotorpyDrone, each) for who, each in challengers.items()}
    yield from measure(rotorpy_flights.TITLE, contestants, noise, missions=QUICK)
