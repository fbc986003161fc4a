"""The moving picture at the head of the README: a lap of four drones on a curve in space, true to scale."""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from benchmarks.evidence.item import Figures
from mambo_sil.results.style import (
    BLUE,
    BROAD,
    BROWN,
    DOT,
    INK,
    ORANGE,
    PAGE_INCHES,
    QUIET,
    TARGET,
    VERMILION,
    style,
)

FLOWN: Final = {
    "pd": ("the paper's PD", ORANGE),
    "preset": ("MPC, height by the drone's own loop", VERMILION),
    "pid": ("PID with feed-forward, tuned", BROWN),
    "third-axis": ("MPC, three axes", BLUE),
}
"""Title and colour of each flight, by the name of its folder."""

_SOURCES: Final = {
    "pd": "--controller pd",
    "preset": "crazyflie",
    "pid": "--controller pid-feedforward --altitude-loop pid",
    "third-axis": "benchmarks/evidence/height.toml",
}
_COURSE: Final = (
    "--vehicle crazyflie --sensors mocap",
    "--trajectory swinging-eight --size-m 1 --rate-rad-s 1 --duration-s 20",
)
_LAP_S: Final = 2.0 * np.pi
FRAME_S: Final = 0.1
_TRAIL_S: Final = 1.0
_SHADES: Final = 8
"""Of each colour, from itself to white: its edges are smooth."""
_DPI: Final = 140
_TURN_RAD, _RISE_RAD = np.radians(20.0), np.radians(35.0)
"""Where one looks from."""

Points = NDArray[np.float64]


def space_commands(results: str) -> tuple[str, ...]:
    """Return the commands that fly the four drones into folders of `results`."""
    return tuple(
        " ".join(("mambo-nmpc fly", source, *_COURSE, f"--no-pictures -o {results}/{name}"))
        for name, source in _SOURCES.items()
    )


def read_space(results: Path) -> Figures:
    """Return the mean distance to the target in space over the last lap, in cm, of each flight."""
    return {
        name: round(100.0 * float(np.linalg.norm(drone - target, axis=1).mean()), 2)
        for name, (_, drone, target) in _laps(results).items()
    }


def space_table(figures: Figures) -> str:
    """Return the mean distances as a table."""
    rows = [f"| {title} | {figures[name]:.3g} |" for name, (title, _) in FLOWN.items()]
    return "\n".join(["| controller | mean distance in space, cm |", "| --- | --- |", *rows])


def draw_moving_picture(results: Path) -> None:
    """Draw the last lap, a frame every `FRAME_S`, with the distances of now; write space.gif."""
    laps = _laps(results)
    frames = range(0, len(laps["pd"][0]), round(FRAME_S / _period_s(laps)))
    with style():
        images = [_frame(laps, frame) for frame in frames]
    palette = _palette()
    first, *others = (image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
    first.save(
        results / "space.gif",
        save_all=True,
        append_images=others,
        duration=round(1000.0 * FRAME_S),
        loop=0,
        optimize=True,
    )


def _palette() -> Image.Image:
    """Return an image that has the colours of the picture and their shades."""
    flown = (colour for _, colour in FLOWN.values())
    pure = np.array([to_rgb(colour) for colour in (INK, QUIET, TARGET, *flown)])
    shades = np.linspace(0.0, 1.0, _SHADES)[:, np.newaxis, np.newaxis]
    colours = (pure + (shades * (1.0 - pure))).reshape(-1, 3)
    image = Image.new("P", (1, 1))
    image.putpalette([round(255.0 * value) for value in colours.ravel().tolist()])
    return image


def _laps(results: Path) -> Mapping[str, tuple[Points, Points, Points]]:
    """Return times (k,), positions (k, 3) and targets (k, 3) of the last lap of each flight, up positive."""
    laps = {}
    for name in FLOWN:
        trace = np.load(results / name / "trace.npz")
        times_s = trace["time_s"]
        lap = times_s > times_s[-1] - _LAP_S
        position, target = trace["position_m"][lap, 0], trace["target"][lap, 0]
        drone = np.column_stack([position[:, :2], -position[:, 2]])
        laps[name] = times_s[lap], drone, np.column_stack([target[:, :2], target[:, 4]])
    return laps


def _period_s(laps: Mapping[str, tuple[Points, Points, Points]]) -> float:
    times_s = laps["pd"][0]
    return float(times_s[1] - times_s[0])


def _seen(points: Points) -> Points:
    """Return points (k, 2) of the picture for points (k, 3) of the world: a parallel projection to scale."""
    x, y, z = points[:, 0], -points[:, 1], points[:, 2]
    across = (x * np.cos(_TURN_RAD)) - (y * np.sin(_TURN_RAD))
    away = (x * np.sin(_TURN_RAD)) + (y * np.cos(_TURN_RAD))
    return np.column_stack([across, (z * np.cos(_RISE_RAD)) + (away * np.sin(_RISE_RAD))])


def _frame(laps: Mapping[str, tuple[Points, Points, Points]], now: int) -> Image.Image:
    figure = Figure(figsize=(PAGE_INCHES, 2.9), layout="constrained", dpi=_DPI)
    scene, bars = figure.subplots(1, 2, width_ratios=(2, 1.2))
    _draw_scene(scene, laps, now)
    _draw_bars(bars, {name: np.linalg.norm(lap[1][now] - lap[2][now]) for name, lap in laps.items()})
    drawn = io.BytesIO()
    figure.savefig(drawn, format="png")
    return Image.open(drawn).convert("RGB")


def _draw_scene(axes: Any, laps: Mapping[str, tuple[Points, Points, Points]], now: int) -> None:
    """Draw the curve with its shadow on the floor, the target, and each drone with its trail."""
    target = laps["pd"][2]
    floor = np.column_stack([target[:, :2], np.zeros(len(target))])
    axes.plot(*_seen(floor).T, color=TARGET, linestyle=":")
    axes.plot(*_seen(target).T, color=TARGET, linewidth=BROAD)
    trail = round(_TRAIL_S / _period_s(laps))
    for name, (_, drone, _) in laps.items():
        colour = FLOWN[name][1]
        path = _seen(drone[np.arange(now - trail, now + 1)])  # before the lap that of its end
        axes.plot(*path.T, color=colour)
        axes.plot(*path[-1], color=colour, marker="o", markersize=1.5 * DOT)
    axes.plot(*_seen(target[now : now + 1]).T, color=QUIET, marker="x", markersize=1.5 * DOT)
    whole = np.concatenate([_seen(each) for lap in laps.values() for each in lap[1:]] + [_seen(floor)])
    low, high = whole.min(axis=0) - 0.1, whole.max(axis=0) + 0.1
    left, bottom = low.tolist()
    axes.plot([left, left + 1.0], [bottom, bottom], color=QUIET)
    axes.annotate("1 m", (left + 0.5, bottom + 0.04), ha="center", color=QUIET)
    axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]), xticks=(), yticks=())
    axes.set_title("A Crazyflie follows a target (x) through space, true to scale")
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _draw_bars(axes: Any, distances_m: Mapping[str, Any]) -> None:
    """Draw the distance of now of each drone as a bar with its number."""
    for place, name in enumerate(reversed(FLOWN)):
        title, colour = FLOWN[name]
        distance_cm = 100.0 * float(distances_m[name])
        axes.barh(place - 0.15, distance_cm, color=colour, height=0.3)
        axes.annotate(title, (0.0, place + 0.08), va="bottom")
        axes.annotate(
            f"{distance_cm:.1f} cm" if distance_cm < 10.0 else f"{distance_cm:.0f} cm",
            (distance_cm, place - 0.15),
            xytext=(3, 0),
            textcoords="offset points",
            va="center",
        )
    axes.grid(visible=False)
    axes.spines["bottom"].set_visible(False)
    axes.set(xticks=(), yticks=(), xlim=(0, 125), ylim=(-0.5, len(FLOWN) - 0.4))
    axes.set_title("Distance to the target now")
