"""Pictures of one flight by each adapter: its path from above, and how far the drone is from the target."""

from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from benchmarks.evidence.item import Figures
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.results.pictures import PlainLogFormatter, save
from mambo_sil.results.style import BLUE, BROAD, GREEN, PAGE_INCHES, TARGET, style

FLOWN: Final = {"crazyflow": "crazyflow", "rotorpy": "RotorPy", "gymnasium": "Gymnasium"}
"""Name of each simulator, by its file."""


def read_adapters(results: Path) -> Figures:
    """Return the mean distance from the target in the last two seconds of each flight, in mm."""
    flights = {name: np.load(results / "flights" / f"{name}.npz") for name in FLOWN}
    return {name: float(1e3 * _distance_m(flight)[-200:].mean()) for name, flight in flights.items()}


def draw_adapters(results: Path) -> None:
    """Draw each flight; write adapters-NAME.png and .svg."""
    for name, title in FLOWN.items():
        flight = np.load(results / "flights" / f"{name}.npz")
        times_s = flight["time_s"]
        with style():
            figure = Figure(figsize=(PAGE_INCHES, 2.0), layout="constrained")
            plan, distance = figure.subplots(1, 2, width_ratios=(1, 1.6))
            plan.plot(*flight["target_m"][:, :2].T, color=TARGET, linewidth=BROAD)
            plan.plot(*flight["position_m"][:, :2].T, color=BLUE)
            plan.set(aspect="equal", xlabel="x, m", ylabel="y, m", title=f"{title}: target (grey) and drone")
            distance.plot(times_s, 100.0 * _distance_m(flight), color=BLUE, label="along the ground")
            height_m = np.abs(flight["position_m"][:, 2] - flight["target_m"][:, 2])
            distance.plot(times_s, 100.0 * height_m, color=GREEN, linestyle="dashed", label="in height")
            distance.set(xlabel="time, s", ylabel="distance, cm", yscale="log", ylim=(0.01, 300.0))
            distance.yaxis.set_major_formatter(PlainLogFormatter())
            distance.legend(loc="upper right", ncols=2)
            save(figure, results / f"adapters-{name}")


def _distance_m(flight: Any) -> FloatArray:
    offset_m = flight["position_m"][:, :2] - flight["target_m"][:, :2]
    return np.asarray(np.linalg.norm(offset_m, axis=1), np.float64)
