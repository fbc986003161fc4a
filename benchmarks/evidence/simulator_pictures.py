"""Pictures of flights in simulators of others: the eight through noise, and one flight by each adapter."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from benchmarks.evidence.item import Figures
from benchmarks.evidence.simulator_tables import PAGE
from benchmarks.simulators.missions import MISSIONS
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.results.pictures import PlainLogFormatter, save
from mambo_sil.results.style import BLUE, BROAD, GREEN, PAGE_INCHES, PURPLE, TARGET, VERMILION, style

DRAKE: Final = "Drake's QuadrotorPlant"
DRAWN: Final = {"crazyflow": "hb_x500, fitted", "pybullet": "gym-pybullet-drones, cf2x"}
"""The drone of each picture, by simulator."""
OTHERS: Final = ("LQR, tuned", "Lee, tuned")
STYLES: Final = ((VERMILION, "dotted"), (PURPLE, "dashed"))
"""Colour and dashes of their controller as shipped, and tuned."""
FLOWN: Final = {"crazyflow": "crazyflow", "rotorpy": "RotorPy", "gymnasium": "Gymnasium"}
"""Name of each simulator, by its file."""


def draw_simulators(results: Path) -> None:
    """Draw path and distance in space on the eight, with the first seed: their controller twice, and ours."""
    for simulator, drone in DRAWN.items():
        paths = np.load(results / simulator / f"{drone}.npz")
        _draw_eight(paths, drone, list(paths)[:2], results / f"simulators-{simulator}", 0.2)


def draw_motors(results: Path) -> None:
    """Draw the same in Drake: the two laws of others, tuned, and ours."""
    paths = np.load(results / "motors" / f"{DRAKE}.npz")
    _draw_eight(paths, DRAKE, OTHERS, results / "simulators-drake", 0.02)


def _draw_eight(paths: Any, drone: str, others: Sequence[str], place: Path, least_mm: float) -> None:
    """Draw paths by controller (k, 3) of the eight: those of two others, and ours, from a distance on."""
    mission = MISSIONS["eight"]
    times_s, target = mission.times_s(), mission.targets()
    shown = [*zip(others, STYLES, strict=True), (PAGE, (BLUE, "solid"))]
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 2.5), layout="constrained")
        plan, distance = figure.subplots(1, 2, width_ratios=(1, 1.5))
        plan.plot(*target[:, :2].T, color=TARGET, linewidth=BROAD, label="target")
        for title, (colour, dashes) in shown:
            path = paths[title]
            plan.plot(*path[:, :2].T, color=colour, linestyle=dashes)
            error_mm = 1000.0 * np.linalg.norm(path - target[:, :3], axis=1)
            distance.plot(times_s, error_mm, color=colour, linestyle=dashes, label=title)
        plan.set(aspect="equal", xlabel="x, m", ylabel="y, m", title=f"{drone}: the target (grey)")
        distance.set(
            xlabel="time, s", ylabel="distance to the target, mm", yscale="log", ylim=(least_mm, 1000.0)
        )
        distance.yaxis.set_major_formatter(PlainLogFormatter())
        distance.legend(loc="upper right", ncols=2)
        save(figure, place)


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
