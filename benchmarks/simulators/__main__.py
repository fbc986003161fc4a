"""Fly in crazyflow or in RotorPy; print tables, write figures and paths to a folder. Takes half an hour.

    python -m benchmarks.simulators crazyflow|rotorpy FOLDER [DRONE,MODEL ...]

wants extra `crazyflow`, or `rotorpy`.
"""

import importlib
import json
import sys
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.evidence.simulator_tables import through_noise, with_truth
from mambo_sil.results.folders import finite

FIGURES: Final = "figures.json"


def main(simulator: str, folder: Path, chosen: list[str]) -> None:
    """Fly in one simulator; crazyflow flies in the chosen worlds, or in all of them."""
    warnings.filterwarnings("ignore", "Attaching a spec", UserWarning)  # of MuJoCo, which crazyflow uses
    folder.mkdir(parents=True, exist_ok=True)
    if simulator == "rotorpy":
        flights = importlib.import_module("benchmarks.simulators.rotorpy_flights")
        write(folder, "RotorPy", *flights.measure(folder))
        return
    flights = importlib.import_module("benchmarks.simulators.crazyflow_flights")
    for world in (
        flights.SimulatedCrazyflie(drone, model) for drone in flights.VEHICLES for model in flights.MODELS
    ):
        if not chosen or f"{world.drone},{world.model}" in chosen:
            write(folder, world.title, *flights.measure(world, folder))


def write(folder: Path, title: str, figures: dict[str, Any], paths: Mapping[str, Any]) -> None:
    """Add the figures of one simulated drone to figures.json; write its paths."""
    file = folder / FIGURES
    known = json.loads(file.read_text("utf-8")) if file.is_file() else {}
    known[title] = finite(figures)
    file.write_text(json.dumps(known, indent=1) + "\n", "utf-8")
    print(f"\nThrough noise\n\n{through_noise(known)}\n\nWith true states\n\n{with_truth(known)}", flush=True)
    with (folder / f"{title}.npz").open("wb") as archive:
        np.savez_compressed(archive, **paths)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), sys.argv[3:])
