"""Pictures of flights in simulators of others: the eight, through noise."""

from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.figure import Figure

from benchmarks.simulators.missions import MISSIONS
from mambo_sil.results.pictures import PlainLogFormatter, save
from mambo_sil.results.style import BLUE, BROAD, PAGE_INCHES, PURPLE, TARGET, VERMILION, style

DRAWN: Final = {"crazyflow": "hb_x500, fitted", "pybullet": "gym-pybullet-drones, cf2x"}
"""The drone of each picture, by simulator."""
STYLES: Final = ((VERMILION, "dotted"), (PURPLE, "dashed"))
"""Colour and dashes of their controller as shipped, and tuned."""
OURS: Final = "ours, by the page"


def draw_simulators(results: Path) -> None:
    """Draw path and distance in space on the eight, with the first seed: their controller twice, and ours."""
    mission = MISSIONS["eight"]
    times_s, target = mission.times_s(), mission.targets()
    for simulator, drone in DRAWN.items():
        paths = np.load(results / simulator / f"{drone}.npz")
        shown = [*zip(list(paths)[:2], STYLES, strict=True), (OURS, (BLUE, "solid"))]
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
                xlabel="time, s", ylabel="distance to the target, mm", yscale="log", ylim=(0.2, 1000.0)
            )
            distance.yaxis.set_major_formatter(PlainLogFormatter())
            distance.legend(loc="upper right", ncols=2)
            save(figure, results / f"simulators-{simulator}")
