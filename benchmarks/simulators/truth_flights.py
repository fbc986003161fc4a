"""The flights in crazyflow by the true state: its Mellinger controller, as shipped and tuned, and ours."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from benchmarks.simulators.crazyflow_flights import SEEDS, WORLDS, Mellinger, fly, tuned
from benchmarks.simulators.crazyflow_worlds import SimulatedCrazyflie
from benchmarks.simulators.missions import MISSIONS, TUNED_ON, Score
from benchmarks.simulators.pilots import Challenger, Designed
from mambo_sil.drone.vehicles import vehicle_toml


def measure_all(folder: Path) -> Iterator[tuple[str, dict[str, Any], Mapping[str, Any]]]:
    """Yield title, scores and paths (none) of each drone with each model; one flight each, without noise."""
    for drone, model, vehicle in WORLDS:
        world = SimulatedCrazyflie(drone, model, vehicle)
        best, factors = tuned(world, TUNED_ON, noisy=False)
        (folder / f"{drone}-{model}-found.txt").write_text(f"{factors}\n", "utf-8")
        challengers: dict[str, Challenger] = {
            "Mellinger": Mellinger(drone),
            "Mellinger, tuned": best,
            "ours, by the page": Designed(vehicle_toml.preset(vehicle)),
        }
        figures: dict[str, dict[str, list[Score]]] = {title: {} for title in challengers}
        for name, mission in MISSIONS.items():
            flown, _ = fly(world, list(challengers.values()), mission, SEEDS[:1], noisy=False)
            for title, score in zip(challengers, mission.scores(flown), strict=True):
                figures[title][name] = [score]
        yield world.title, figures, {}
