"""The frequency responses of a controller's loops as a CSV file, for the report and for other programs."""

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import Final, cast

import numpy as np

from mambo_codegen.errors import echo
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import ResultsError
from mambo_sil.experiment.margins.axis_margins import AXES, TILT_AXES, AxisName, PlaceName, frequencies
from mambo_sil.experiment.margins.hover_loop import (
    AT_COMMAND,
    AT_MOTORS,
    SENT,
    TURNING,
    ComplexArray,
    Loops,
    choose,
)
from mambo_sil.experiment.margins.loop_margins import sensitivity

_FIRST_RAD_S: Final = 0.1
_COUNT: Final = 600
_COLUMNS: Final = ("axis", "broken_at", "rad_s", "sensitivity_real", "sensitivity_imag")


@dataclass(frozen=True, eq=False)
class Curve:
    """The sensitivity (f,) of a loop at frequencies (f,)."""

    axis: AxisName
    place: PlaceName
    rad_s: FloatArray
    sensitivity: ComplexArray


def responses(loops: Loops, update_period_s: float, *, motors: bool) -> list[Curve]:
    """Return the curves of all axes, broken at the command, and of roll and pitch at the motors, if any."""
    found = []
    for name, loop in zip(AXES, loops, strict=False):
        updates, ticks = (one[one > _FIRST_RAD_S] for one in frequencies(loop, update_period_s, _COUNT))
        at_command, at_motors = choose(loop, [AT_COMMAND], [SENT]), choose(loop, [AT_MOTORS], [TURNING])
        found.append(Curve(name, "command", updates, sensitivity(at_command, updates)))
        if motors and name in TILT_AXES:
            found.append(Curve(name, "motors", ticks, sensitivity(at_motors, ticks)))
    return found


def write_responses(curves: list[Curve], path: Path) -> None:
    """Write the curves to a CSV file with six digits."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(_COLUMNS)
        for curve in curves:
            for rad_s, s in zip(curve.rad_s.tolist(), curve.sensitivity.tolist(), strict=True):
                numbers = (f"{value:.6g}" for value in (rad_s, s.real, s.imag))
                writer.writerow([curve.axis, curve.place, *numbers])


def read_responses(path: Path) -> list[Curve]:
    """Read the file of `write_responses`; raises ResultsError."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = [tuple(row.get(name) or "" for name in _COLUMNS) for row in csv.DictReader(file)]
        by_loop: dict[tuple[str, str], list[tuple[float, complex]]] = {}
        for axis, place, rad_s, real, imag in rows:
            by_loop.setdefault((axis, place), []).append((float(rad_s), complex(float(real), float(imag))))
    except (OSError, ValueError, csv.Error) as error:
        raise ResultsError(f"{echo(str(path))}: cannot be read: {error}; run margins again") from error
    return [
        Curve(axis, cast("PlaceName", place), *map(np.array, zip(*points, strict=True)))
        for (axis, place), points in by_loop.items()
        if axis in AXES
    ]
