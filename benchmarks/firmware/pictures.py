"""Pictures of the laboratory's flights."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from benchmarks.firmware.contenders import DESIGN
from benchmarks.firmware.events import SWING
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.trajectories import vertical_of
from mambo_sil.results.pictures import save
from mambo_sil.results.style import (
    BLUE,
    BROAD,
    GREEN,
    INK,
    ORANGE,
    PAGE_INCHES,
    TARGET,
    THIN,
    VERMILION,
    style,
)

TITLES: Final = {DESIGN: "app", "mellinger": "Mellinger", "lee": "Lee", "pid": "PID"}
LOOKS: Final[dict[str, dict[str, Any]]] = {
    DESIGN: {"color": BLUE, "linestyle": "-"},
    "mellinger": {"color": VERMILION, "linestyle": "--"},
    "lee": {"color": GREEN, "linestyle": "-."},
    "pid": {"color": ORANGE, "linestyle": ":"},
}

Paths = Mapping[tuple[str, str], FloatArray]


def draw(paths: Paths, folder: Path) -> None:
    """Draw all pictures into a folder."""
    _draw_paths(paths, folder / "firmware-paths")
    _draw_events(paths, folder / "firmware-events")


def _draw_paths(paths: Paths, stem: Path) -> None:
    """Draw the curves from above, one round of each, and the errors over it."""
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 4.2), layout="constrained")
        panels = figure.subplots(2, 2)
        for column, (title, round_s) in enumerate(
            (("fast eight", 2 * np.pi / 0.8), ("circle", 2 * np.pi / 1.5))
        ):
            plan, errors = panels[:, column]
            for number, (name, look) in enumerate(LOOKS.items()):
                path = paths[title, name]
                late = path[(path[:, 0] > 20.0) & (path[:, 0] <= 20.0 + round_s)]
                if number == 0:
                    plan.plot(late[:, 4], late[:, 5], color=TARGET, linewidth=BROAD, label="target")
                plan.plot(late[:, 1], late[:, 2], label=TITLES[name], **look)
                errors.plot(
                    late[:, 0] - 20.0,
                    100.0 * np.hypot(*(late[:, 1:3] - late[:, 4:6]).T),
                    label=TITLES[name],
                    **look,
                )
            plan.set(aspect="equal", xlabel="x, m", ylabel="y, m", title=title)
            errors.set(yscale="log", xlabel="time, s", ylabel="distance, cm")
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
        save(figure, stem)


def _draw_events(paths: Paths, stem: Path) -> None:
    """Draw a step, a height that swings, and a lost camera."""
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 4.2), layout="constrained")
        (step, swing), (away, height) = figure.subplots(2, 2)
        for name, look in LOOKS.items():
            path = paths["step", name]
            step.plot(path[:, 0] - 1.0, path[:, 1], label=TITLES[name], **look)
            path = paths["heights", name]
            path = path[path[:, 0] > path[-1, 0] - 10.0]
            swing.plot(path[:, 0] - path[0, 0], path[:, 3], **look)
            path = paths["camera", name]
            path = path[path[:, 0] >= 6.0]
            away.plot(path[:, 0] - 6.0, np.hypot(*(path[:, 1:3] - path[0, 1:3]).T), **look)
            height.plot(path[:, 0] - 6.0, path[:, 3], **look)
        time_s = np.linspace(0.0, 10.0, 200)
        swing.plot(time_s, vertical_of(SWING, time_s + 5.0)[:, 0], color=TARGET, linewidth=BROAD, zorder=1)
        step.axhline(1.0, color=INK, linewidth=THIN)
        step.set(xlim=(-0.5, 5.0), xlabel="time after the step, s", ylabel="x, m", title="a step of 1 m")
        swing.set(xlabel="time, s", ylabel="height, m", title="a height that swings, drone of 36 g")
        away.set(
            xlabel="time after the camera's end, s", ylabel="distance, m", title="lost camera: from there"
        )
        height.set(xlabel="time after the camera's end, s", ylabel="height, m", title="lost camera: height")
        handles, labels = step.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
        save(figure, stem)
