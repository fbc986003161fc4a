"""Fly in a simulator of others; write figures and paths to a folder. Takes 5 to 20 minutes.

    python -m benchmarks.simulators crazyflow|rotorpy|pybullet|pyflyt|motors|quick|truth FOLDER

wants that simulator; quick wants crazyflow and rotorpy, truth crazyflow, motors drake and mujoco.
"""

import importlib
import json
import os
import sys
import warnings
from pathlib import Path
from typing import Any, Final

import numpy as np

from mambo_sil.results.folders import finite

FIGURES: Final = "figures.json"


def main(simulator: str, folder: Path) -> None:
    """Fly every simulated drone of one simulator."""
    warnings.filterwarnings("ignore", "Attaching a spec", UserWarning)  # of MuJoCo, which crazyflow uses
    os.environ.setdefault("SCIPY_ARRAY_API", "1")  # crazyflow wants it before SciPy is imported
    folder.mkdir(parents=True, exist_ok=True)
    found: dict[str, Any] = {}
    flights = importlib.import_module(f"benchmarks.simulators.{simulator}_flights")
    for title, figures, paths in flights.measure_all(folder):
        found[title] = finite(figures)
        (folder / FIGURES).write_text(json.dumps(found, indent=1) + "\n", "utf-8")
        with (folder / f"{title}.npz").open("wb") as archive:
            np.savez_compressed(archive, **paths)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
