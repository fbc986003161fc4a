"""The picture at the head of the README: a lap of four drones, and how far from the target each is."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from benchmarks.evidence.item import Figures
from mambo_sil.results.pictures import save
from mambo_sil.results.style import BLUE, BROAD, BROWN, ORANGE, PAGE_INCHES, TARGET, VERMILION, style

FLOWN: Final = {
    "pd": ("the paper's PD", ORANGE),
    "table1": ("the paper's NMPC, Table I", VERMILION),
    "pid-feedforward": ("PID with feed-forward, tuned", BROWN),
    "mambo": ("this MPC, quadratic cost", BLUE),
}
"""Title and colour of each flight, by the name of its folder."""

_LAP_S: Final = 4 * np.pi
"""The curve has a rate of 0.5 rad/s."""


def first_commands(results: str) -> tuple[str, ...]:
    """Return the commands that fly the four drones into folders of `results`."""
    sources = {"pd": "--controller pd", "pid-feedforward": "--controller pid-feedforward"}
    return tuple(f"mambo-nmpc fly {sources.get(name, name)} -o {results}/{name}" for name in FLOWN)


def read_distances(results: Path) -> Figures:
    """Return the mean distance to the target in cm of each flight."""
    traces = {name: np.load(results / name / "trace.npz") for name in FLOWN}
    return {name: round(100 * float(_distance_m(trace).mean()), 2) for name, trace in traces.items()}


def first_table(figures: Figures) -> str:
    """Return the mean distances as a table."""
    rows = [f"| {title} | {figures[name]:.3g} |" for name, (title, _) in FLOWN.items()]
    return "\n".join(["| controller | mean distance, cm |", "| --- | --- |", *rows])


def draw_first_picture(results: Path) -> None:
    """Draw the last lap of each flight and its mean distance; write first.png and .svg."""
    flights = {name: np.load(results / name / "trace.npz") for name in FLOWN}
    means = read_distances(results)
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 1.8), layout="constrained")
        lap, bars = figure.subplots(1, 2, width_ratios=(2, 1.25))
        _draw_lap(lap, flights)
        _draw_bars(bars, means)
        save(figure, results / "first")


def _distance_m(trace: Any) -> NDArray[np.float64]:
    """Return the distance to the target at each sample."""
    x_m, y_m = (trace["position_m"][:, 0, :2] - trace["target"][:, 0, :2]).T
    distance_m: NDArray[np.float64] = np.sqrt((x_m * x_m) + (y_m * y_m))
    return distance_m


def _draw_lap(axes: Any, flights: Mapping[str, Any]) -> None:
    """Draw the curve and the path of each drone, true to scale."""
    times_s = flights["mambo"]["time_s"]
    lap = times_s >= times_s[-1] - _LAP_S
    axes.plot(*flights["mambo"]["target"][lap, 0, :2].T, color=TARGET, linewidth=BROAD)
    for name, (_, colour) in FLOWN.items():
        axes.plot(*flights[name]["position_m"][lap, 0, :2].T, color=colour)
    axes.set(
        aspect="equal",
        xlabel="x, m",
        ylabel="y, m",
        title="A lap of the target (grey), 4 m wide, and of each drone",
    )


def _draw_bars(axes: Any, means: Figures) -> None:
    """Draw the mean distance of each flight as a bar with its number."""
    names = list(FLOWN)[::-1]
    titles, colours = zip(*(FLOWN[name] for name in names), strict=True)
    axes.barh(titles, [means[name] for name in names], color=colours, height=0.6)
    for place, name in enumerate(names):
        axes.annotate(
            f"{means[name]:.1f} cm",
            (means[name], place),
            xytext=(3, 0),
            textcoords="offset points",
            va="center",
        )
    axes.grid(visible=False)
    axes.spines["bottom"].set_visible(False)
    axes.set(xticks=(), xlim=(0, 1.25 * max(means.values())), title="Mean distance to the target")
