"""Pictures of the flights in crazyflow and RotorPy: the circle, through noise."""

from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.figure import Figure

from benchmarks.simulators.missions import MISSIONS
from mambo_sil.results.pictures import PlainLogFormatter, save
from mambo_sil.results.style import BLUE, BROAD, PAGE_INCHES, PURPLE, TARGET, VERMILION, style

DRAWN: Final = {"crazyflow": "cf2x_L250, first principles", "rotorpy": "RotorPy"}
"""The drone of each picture, by simulator."""
SHOWN: Final = {
    "Mellinger with it, planned starts and steps": ("Mellinger, planned start", VERMILION, "dashed"),
    "SE3Control": ("SE3Control", VERMILION, "dashed"),
    "ours, preset `crazyflie`": ("ours, preset crazyflie", PURPLE, "dashdot"),
    "ours, `identify`, then `design`": ("ours, identified", BLUE, "solid"),
}
"""Label, colour and dashes of each controller that a picture shows."""


def draw_simulators(results: Path) -> None:
    """Draw path and distance on the circle, with the first seed: their controller, two of ours."""
    mission = MISSIONS["circle"]
    times_s, target = mission.times_s, mission.targets()
    for simulator, drone in DRAWN.items():
        paths = np.load(results / simulator / f"{drone}.npz")
        with style():
            figure = Figure(figsize=(PAGE_INCHES, 2.5), layout="constrained")
            plan, distance = figure.subplots(1, 2, width_ratios=(1, 1.8))
            plan.plot(*target[:, :2].T, color=TARGET, linewidth=BROAD, label="target")
            for title in (one for one in SHOWN if one in paths):
                label, colour, dashes = SHOWN[title]
                path = paths[title]
                plan.plot(*path[:, :2].T, color=colour, linestyle=dashes)
                error_cm = 100.0 * np.linalg.norm(path[:, :2] - target[:, :2], axis=1)
                distance.plot(times_s, error_cm, color=colour, linestyle=dashes, label=label)
            plan.set(aspect="equal", xlabel="x, m", ylabel="y, m", title=f"{drone}: the target (grey)")
            distance.set(
                xlabel="time, s", ylabel="distance to the target, cm", yscale="log", ylim=(0.05, 300.0)
            )
            distance.yaxis.set_major_formatter(PlainLogFormatter())
            distance.legend(loc="upper right")
            save(figure, results / f"simulators-{simulator}")
