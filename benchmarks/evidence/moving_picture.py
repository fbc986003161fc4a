"""The moving picture at the head of the README: a lap of three drones on a curve in space, true to scale."""

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from benchmarks.evidence.item import Figures
from mambo_sil.results.style import ARM, BLUE, BROAD, BROWN, DOT, INK, ORANGE, QUIET, TARGET, style

FLOWN: Final = {
    "pd": "the paper's PD",
    "preset": "preset `crazyflie`, height by the drone's own loop",
    "pid": "PID with feed-forward, tuned",
    "third-axis": "`design crazyflie`, three axes",
}
"""Title of each flight in the table, by the name of its folder."""
_DRAWN: Final = {
    "pd": ("the paper's PD", ORANGE),
    "pid": ("a tuned PID", BROWN),
    "third-axis": ("this MPC", BLUE),
}
"""Title and colour of each flight in the picture."""

_COURSE: Final = (
    "--vehicle crazyflie --sensors mocap",
    "--trajectory swinging-eight --size-m 1 --rate-rad-s 1 --duration-s 20",
)
_LAP_S: Final = 2.0 * np.pi
FRAME_S: Final = 0.1
_TRAIL_S: Final = 1.0
_SHADES: Final = 8
"""Of each colour, from itself to white: its edges are smooth."""
_SIZE_INCHES: Final = (5.4, 2.6)
_FONT: Final[dict[Any, Any]] = dict.fromkeys(("font.size", "axes.titlesize"), 10.0)
"""In a picture so narrow these points are 9 pixels where a phone shows it 358 pixels wide."""
_DPI: Final = 160
_TURN_RAD, _RISE_RAD = np.radians(20.0), np.radians(35.0)
"""Where one looks from."""
_ARM_M, _ROTOR_M, _BODY_M = 0.13, 0.085, 0.06
"""A drone as it is drawn, three times as large as a Crazyflie."""
_AROUND: Final = np.linspace(0.0, 2.0 * np.pi, 25)

Points = NDArray[np.float64]


@dataclass(frozen=True)
class Lap:
    """The last lap of a flight: times (k,) in s, places (k, 3) in m, up positive, angles (k, 3) in rad."""

    times_s: Points
    drone: Points
    angles_rad: Points
    target: Points


def space_commands(results: str) -> tuple[str, ...]:
    """Return the commands that derive settings and fly the four drones into folders of `results`."""
    derived = f"{results}/controller.toml"
    sources = {
        "pd": "--controller pd",
        "preset": "crazyflie",
        "pid": "--controller pid-feedforward --altitude-loop pid",
        "third-axis": derived,
    }
    return (
        f"mambo-nmpc design crazyflie -o {derived}",
        *(
            " ".join(("mambo-nmpc fly", source, *_COURSE, f"--no-pictures -o {results}/{name}"))
            for name, source in sources.items()
        ),
    )


def read_space(results: Path) -> Figures:
    """Return the mean distance to the target in space over the last lap, in cm, of each flight."""
    laps = {name: _lap(results / name) for name in FLOWN}
    return {
        name: round(100.0 * float(np.linalg.norm(lap.drone - lap.target, axis=1).mean()), 2)
        for name, lap in laps.items()
    }


def space_table(figures: Figures) -> str:
    """Return the mean distances as a table."""
    rows = [f"| {title} | {figures[name]:.3g} |" for name, title in FLOWN.items()]
    return "\n".join(["| controller | mean distance in space, cm |", "| --- | --- |", *rows])


def draw_moving_picture(results: Path) -> None:
    """Draw the last lap, a frame every `FRAME_S`, with the distances of now; write space.gif."""
    laps = {name: _lap(results / name) for name in _DRAWN}
    frames = range(0, len(laps["pd"].times_s), round(FRAME_S / _period_s(laps)))
    with style(), mpl.rc_context(_FONT):
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
    flown = (colour for _, colour in _DRAWN.values())
    pure = np.array([to_rgb(colour) for colour in (INK, QUIET, TARGET, *flown)])
    shades = np.linspace(0.0, 1.0, _SHADES)[:, np.newaxis, np.newaxis]
    colours = (pure + (shades * (1.0 - pure))).reshape(-1, 3)
    image = Image.new("P", (1, 1))
    image.putpalette([round(255.0 * value) for value in colours.ravel().tolist()])
    return image


def _lap(folder: Path) -> Lap:
    """Return the last lap of the flight in a folder."""
    trace = np.load(folder / "trace.npz")
    times_s = trace["time_s"]
    lap = times_s > times_s[-1] - _LAP_S
    position, target = trace["position_m"][lap, 0], trace["target"][lap, 0]
    drone = np.column_stack([position[:, :2], -position[:, 2]])
    target = np.column_stack([target[:, :2], target[:, 4]])
    return Lap(times_s[lap], drone, trace["euler_rad"][lap, 0], target)


def _period_s(laps: Mapping[str, Lap]) -> float:
    times_s = laps["pd"].times_s
    return float(times_s[1] - times_s[0])


def _seen(points: Points) -> Points:
    """Return points (k, 2) of the picture for points (k, 3) of the world: a parallel projection to scale."""
    x, y, z = points[:, 0], -points[:, 1], points[:, 2]
    across = (x * np.cos(_TURN_RAD)) - (y * np.sin(_TURN_RAD))
    away = (x * np.sin(_TURN_RAD)) + (y * np.cos(_TURN_RAD))
    return np.column_stack([across, (z * np.cos(_RISE_RAD)) + (away * np.sin(_RISE_RAD))])


def _frame(laps: Mapping[str, Lap], now: int) -> Image.Image:
    figure = Figure(figsize=_SIZE_INCHES, layout="constrained")
    scene, bars = figure.subplots(1, 2, width_ratios=(2, 1))
    _draw_scene(scene, laps, now)
    _draw_bars(bars, {name: np.linalg.norm(lap.drone[now] - lap.target[now]) for name, lap in laps.items()})
    drawn = io.BytesIO()
    figure.savefig(drawn, format="png", dpi=_DPI)
    return Image.open(drawn).convert("RGB")


def _draw_scene(axes: Any, laps: Mapping[str, Lap], now: int) -> None:
    """Draw the curve with its shadow on the floor, the target, and each drone with its trail."""
    target = laps["pd"].target
    floor = np.column_stack([target[:, :2], np.zeros(len(target))])
    axes.plot(*_seen(floor).T, color=TARGET, linestyle=":")
    axes.plot(*_seen(target).T, color=TARGET, linewidth=BROAD)
    trail = round(_TRAIL_S / _period_s(laps))
    for name, lap in laps.items():
        colour = _DRAWN[name][1]
        path = lap.drone[np.arange(now - trail, now + 1)]  # before the lap that of its end
        axes.plot(*_seen(path).T, color=colour)
        _draw_quadrotor(axes, lap.drone[now], lap.angles_rad[now], colour)
    axes.plot(*_seen(target[now : now + 1]).T, color=INK, marker="x", markersize=2.0 * DOT)
    whole = np.concatenate([_seen(each) for lap in laps.values() for each in (lap.drone, lap.target)])
    whole = np.concatenate([whole, _seen(floor)])
    low, high = whole.min(axis=0) - 0.15, whole.max(axis=0) + 0.15
    left, bottom = low.tolist()
    axes.plot([left, left + 1.0], [bottom, bottom], color=QUIET)
    axes.annotate("1 m", (left + 0.5, bottom + 0.04), ha="center", color=QUIET)
    axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]), xticks=(), yticks=())
    axes.set_title("Crazyflies follow a target (x)")
    axes.grid(visible=False)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _draw_quadrotor(axes: Any, place: Points, angles_rad: Points, colour: str) -> None:
    """Draw arms, rotors and body, tilted as they are; the rotors in front are dark."""
    turn = _attitude(*angles_rad.tolist())

    def at(forward: Points, right: Points) -> Points:
        """Return points of the picture for points (k,) of the plane of the rotors."""
        flat = np.column_stack([forward, right, np.zeros(len(forward))])
        return _seen(place + ((flat @ turn.T) * (1.0, 1.0, -1.0)))

    corners = [_ARM_M * np.array(corner) for corner in ((-1, -1), (-1, 1), (1, -1), (1, 1))]
    for forward, right in corners:
        axes.plot(*at(np.array([0.0, forward]), np.array([0.0, right])).T, color=colour, linewidth=ARM)
    for forward, right in corners:
        ring = at(forward + (_ROTOR_M * np.cos(_AROUND)), right + (_ROTOR_M * np.sin(_AROUND)))
        inside = (*to_rgb(colour), 0.45) if forward > 0 else "white"
        axes.fill(*ring.T, facecolor="white", zorder=2)
        axes.fill(*ring.T, facecolor=inside, edgecolor=colour, linewidth=ARM, zorder=2)
    axes.fill(*at(_BODY_M * np.cos(_AROUND), _BODY_M * np.sin(_AROUND)).T, facecolor=colour, zorder=2)


def _attitude(roll: float, pitch: float, yaw: float) -> Points:
    """Return the matrix (3, 3) that turns body axes, forward, right, down, into those of the world."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    return np.array(
        [
            [cy * cp, (cy * sp * sr) - (sy * cr), (cy * sp * cr) + (sy * sr)],
            [sy * cp, (sy * sp * sr) + (cy * cr), (sy * sp * cr) - (cy * sr)],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _draw_bars(axes: Any, distances_m: Mapping[str, Any]) -> None:
    """Draw the distance of now of each drone as a bar, its title above it and its number beside it."""
    for place, name in enumerate(reversed(_DRAWN)):
        title, colour = _DRAWN[name]
        distance_cm = 100.0 * float(distances_m[name])
        axes.barh(place - 0.15, distance_cm, color=colour, height=0.3)
        beside = {"xytext": (4, 0), "textcoords": "offset points"}
        axes.annotate(title, (0.0, place + 0.06), va="bottom", **beside)
        number = f"{distance_cm:.1f} cm" if distance_cm < 10.0 else f"{distance_cm:.0f} cm"
        axes.annotate(number, (distance_cm, place - 0.15), va="center", **beside)
    axes.grid(visible=False)
    axes.spines["bottom"].set_visible(False)
    axes.set(xticks=(), yticks=(), xlim=(0, 150), ylim=(-0.5, len(_DRAWN) - 0.4))
    axes.set_title("Distance now")
