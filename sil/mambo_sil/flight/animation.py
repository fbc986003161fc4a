"""The animation of a flight on a page: paths seen from above and from the side, and positions over time."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.names import PD, PD_FEEDFORWARD, PID_FEEDFORWARD
from mambo_sil.flight.traces import Trace

LONGEST_S: Final = 200.0
"""Part of a long flight that is shown."""

_HUES: Final = {PD: 1, PD_FEEDFORWARD: 2, PID_FEEDFORWARD: 3}
"""Colour of a law without a model by its title; all others have 0."""

_STEP_S: Final = 0.1
_LEAST_SPAN_CM: Final = 100.0
_STRAY: Final = 0.75
_MARGIN: Final = 0.08
"""Margin over the width of the view; the drone that the script draws extends that far."""


@dataclass(frozen=True)
class View:
    """One view in cm: SVG viewBox, grid lines, and paths of target and drones."""

    box: tuple[int, int, int, int]
    vertical: list[int]
    horizontal: list[int]
    target: str
    drones: list[str]


@dataclass(frozen=True)
class Animation:
    """Flights along one target, in two views.

    hues:    number of each drone's colour; each PD has its own.
    shown_s: end of the part that is shown; `whole` is true if that is the whole flight.
    data:    positions in cm, angles in mrad and times in s, from which the script draws the drones.
    """

    names: list[str]
    hues: list[int]
    above: View
    side: View
    grid_m: float
    shown_s: float
    whole: bool
    data: dict[str, Any]


def animate(flights: Mapping[str, Trace]) -> Animation:
    """Return the animation of the first flight of each trace, along the target of the first trace.

    The view contains the target and at most 0.75 of its larger extent beyond it on each side, so a drone
    further away is out of view.
    """
    first = next(iter(flights.values()))
    begin_s = float(first.time_s[0])
    shown_s = min(float(first.time_s[-1]), begin_s + LONGEST_S)
    times_s = np.arange(begin_s, shown_s + _STEP_S / 2.0, _STEP_S)
    target_cm = _sample(times_s, first, 100.0 * first.target[:, 0, :2])
    drones_cm = [_sample(times_s, trace, 100.0 * trace.position_m[:, 0]) for trace in flights.values()]
    angles_mrad = [_sample(times_s, trace, 1000.0 * trace.euler_rad[:, 0]) for trace in flights.values()]

    stray_cm = _STRAY * max(float(np.ptp(target_cm, axis=0).max()), _LEAST_SPAN_CM)
    x, y, z = (
        _range(values, [drone[:, axis] for drone in drones_cm], stray_cm)
        for axis, values in enumerate((*target_cm.T, np.zeros(1)))
    )
    z = (z[0], 0.0)  # the ground
    margin = _MARGIN * max(x[1] - x[0], _LEAST_SPAN_CM)
    x, y, z = ((low - margin, high + margin) for low, high in (x, y, z))
    grid_cm = _grid(max(x[1] - x[0], y[1] - y[0]))
    return Animation(
        names=list(flights),
        hues=[_HUES.get(name, 0) for name in flights],
        above=_view(x, y, grid_cm, _path(target_cm), [_path(drone[:, :2]) for drone in drones_cm]),
        side=_view(x, z, grid_cm, "", [_path(drone[:, [0, 2]]) for drone in drones_cm]),
        grid_m=grid_cm / 100.0,
        shown_s=shown_s,
        whole=shown_s == float(first.time_s[-1]),
        data={
            "start": round(begin_s, 3),
            "step": _STEP_S,
            "target": _numbers(target_cm),
            "drones": [
                {"name": name, "position": _numbers(position), "angles": _numbers(angles, digits=0)}
                for name, position, angles in zip(flights, drones_cm, angles_mrad, strict=True)
            ],
        },
    )


def _sample(times_s: FloatArray, trace: Trace, values: FloatArray) -> FloatArray:
    """Interpolate values (k, m) of a trace at times (j,); return (j, m)."""
    return np.stack([np.interp(times_s, trace.time_s, column) for column in values.T], axis=-1)


def _range(target: FloatArray, drones: list[FloatArray], stray_cm: float) -> tuple[float, float]:
    """Return the limits of a view along one axis, without margins."""
    low, high = float(np.min(target)), float(np.max(target))
    flown = np.concatenate([drone[np.isfinite(drone)] for drone in drones] or [np.zeros(0)])
    if len(flown):
        low = min(low, max(float(flown.min()), low - stray_cm))
        high = max(high, min(float(flown.max()), high + stray_cm))
    middle, half = (low + high) / 2.0, max(high - low, _LEAST_SPAN_CM) / 2.0
    return middle - half, middle + half


def _grid(span_cm: float) -> int:
    """Return the distance of the grid lines: 1, 2 or 5 times a power of ten, for about five lines."""
    power = 10.0 ** math.floor(math.log10(span_cm / 3.0))
    return max(1, int(power * max(digit for digit in (1, 2, 5) if digit * power <= span_cm / 3.0)))


def _view(
    across: tuple[float, float], down: tuple[float, float], grid_cm: int, target: str, drones: list[str]
) -> View:
    left, top = math.floor(across[0]), math.floor(down[0])
    right, bottom = math.ceil(across[1]), math.ceil(down[1])
    return View(
        box=(left, top, right - left, bottom - top),
        vertical=list(range(-(-left // grid_cm) * grid_cm, right, grid_cm)),
        horizontal=list(range(-(-top // grid_cm) * grid_cm, bottom, grid_cm)),
        target=target,
        drones=drones,
    )


def _path(points_cm: FloatArray) -> str:
    """Return points (k, 2) as an SVG path, which ends where a flight is lost."""
    finite = points_cm[np.isfinite(points_cm).all(axis=-1)]
    return "M" + " ".join(f"{x:.0f},{y:.0f}" for x, y in finite.tolist()) if len(finite) else ""


def _numbers(values: FloatArray, digits: int = 1) -> list[list[float | None]]:
    """Return rounded values (k, m), None where a flight is lost."""
    return [
        [round(value, digits or None) if math.isfinite(value) else None for value in row]
        for row in values.tolist()
    ]
