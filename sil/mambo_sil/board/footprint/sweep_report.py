"""A sweep as a record, as text, as CSV and as a section of the report."""

import csv
import math
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path

from mambo_sil.board.footprint.sweep import Axis, Point
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.results.number_format import digits
from mambo_sil.results.summary import Number, ReportedSummary, Section
from mambo_sil.results.terminal import sentence, table


class SweepSummary(ReportedSummary):
    """The points of a grid over one or two keys; `budget` is what `budgets` returns."""

    command = "sweep"

    source: str
    settings: str
    board: str
    vehicle: VehicleFile = NOMINAL
    budget: dict[str, Number]
    axes: list[Axis]
    points: list[Point]
    closest_fit: Point | None

    def section(self, _folder: Path) -> Section:
        """Return the section of the report on this sweep."""
        from mambo_sil.board.footprint.footprint_plots import sweep_panels  # noqa: PLC0415 - loaded when drawing

        best = self.closest_fit
        finding = "nothing fits" if best is None else f"closest tracking that fits: {values_text(best)}"
        pictures = sweep_panels(self.points, self.axes, self.budget) if self.points else []
        title = f"Sweep of {self.source} on {self.board}, vehicle {self.vehicle.name}"
        return Section("sweep", title, best is not None, finding, {"summary": self, "pictures": pictures})


def closest_fit(points: Sequence[Point]) -> Point | None:
    """Return the fitting point that is not lost with the least IAE, of equal ones with the least flash."""
    fitting = [point for point in points if point.fits and not math.isnan(point.iae_m_s)]
    return min(fitting, key=lambda point: (point.iae_m_s, point.flash_bytes), default=None)


def write_points(points: Sequence[Point], path: Path) -> None:
    """Write a CSV file with one line for each point: the varied keys, then what was measured."""
    measured = [field.name for field in fields(Point) if field.name != "values"]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [*points[0].values, *measured], lineterminator="\n")
        writer.writeheader()
        for point in points:
            row = asdict(point)
            writer.writerow(row.pop("values") | row)


def values_text(point: Point) -> str:
    """Spell the varied keys of a point."""
    return ", ".join(f"{key} {value:g}" for key, value in point.values.items())


def points_text(points: Sequence[Point]) -> str:
    """Return the answer and a table of the points, then why others were refused."""
    flown = [point for point in points if point.refusal is None]
    refused = [point for point in points if point.refusal is not None]
    lines = [f"{sum(point.fits for point in flown)} of {len(points)} controllers fit"]
    best = closest_fit(flown)
    if best is not None:
        lines.append(sentence(f"closest: {values_text(best)}, IAE {digits(best.iae_m_s)} m s"))
    if flown:
        heads = ("settings", "flash B", "RAM B", "stack B", "instructions", "IAE, m s", "")
        lines += ["", *table(heads, [_row(point) for point in flown], (0, -1))]
    return "\n".join(lines + [sentence(f"{values_text(one)} is refused: {one.refusal}") for one in refused])


def _row(point: Point) -> tuple[str, ...]:
    return (
        values_text(point),
        *(f"{value:g}" for value in (point.flash_bytes, point.ram_bytes, point.stack_bytes)),
        f"{point.instructions:g}",
        digits(point.iae_m_s),
        "fits" if point.fits else "not shown to fit",
    )
