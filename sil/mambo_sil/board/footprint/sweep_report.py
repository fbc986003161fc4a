"""A sweep: record, result and CSV."""

import csv
import math
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Final

from markupsafe import Markup

from mambo_sil.board.footprint.sweep import Axis, Point
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.margins.margin_reserve import HEADS as MARGIN_HEADS
from mambo_sil.experiment.margins.margin_reserve import WORSE, MarginReference
from mambo_sil.results.blocks import CommandResult, Picture, ResultTable, Sentence
from mambo_sil.results.number_format import digits
from mambo_sil.results.summary import Number, ReportedSummary

CAPTION: Final = (
    "Resources of the board and tracking error of each controller. Dots fit the budget; the dashed line is "
    "the budget, if in range; crosses are refused settings."
)
_HEADS: Final = (
    *("settings", "flash B", "RAM B", "stack B", "instructions", "time, ms", "IAE, m s"),
    *(*MARGIN_HEADS, ""),
)
_WIDE: Final = (3, 4, 5)


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
    reference: MarginReference | None = None

    def result(self, _folder: Path, /) -> CommandResult:
        """Return the result: a table of the points, then why others were refused."""

        def panels() -> list[Markup]:
            from mambo_sil.board.footprint.footprint_plots import sweep_panels  # noqa: PLC0415 - loaded when drawing

            return sweep_panels(self.points, self.axes, self.budget)

        flown = [point for point in self.points if point.refusal is None]
        return CommandResult(
            f"Sweep of {self.source} on {self.board}, vehicle {self.vehicle.name}",
            self.closest_fit is not None,
            self._answer(),
            [
                *([Picture(panels, CAPTION)] if self.points else []),
                ResultTable(_HEADS, list(map(_row, flown)), (0, -1), _WIDE),
                *(
                    Sentence(f"{_values(point)} is refused: {point.refusal}")
                    for point in self.points
                    if point.refusal is not None
                ),
            ],
        )

    @property
    def headline(self) -> tuple[str, str]:
        """What the sweep found, and what was flown, for a picture."""
        about = (
            f"{self.source} on board {self.board}, drone {self.vehicle.name}, {len(self.points)} controllers "
            "with one flight of Table II's figure of eight without wind each"
        )
        return "; ".join(self._answer()[:2]), about

    def _answer(self) -> list[str]:
        """Return how many controllers fit, and which is the closest."""
        fitting = sum(point.fits for point in self.points)
        if self.closest_fit is None and not fitting:
            return [f"nothing fits {self.board}"]
        return [f"{fitting} of {len(self.points)} controllers fit", *self._closest()]

    def _closest(self) -> list[str]:
        """Return in words which point is closest, and which would be without regard to margins."""
        best, closest, reference = self.closest_fit, _closest(self.points), self.reference
        said = [] if best is None else [f"closest: {_values(best)}, IAE {digits(best.iae_m_s)} m s"]
        if reference is None or closest is None:
            return said
        if reference.missing is not None:
            return [*said, f"margins are not known: {reference.missing}"]
        if closest.reserve.enough:
            return said
        begin = f"closer, but with {WORSE} than with {reference.whose}"
        if best is None:
            said = [f"none keeps the margins of {reference.whose}: each has {WORSE}"]
            begin = "the closest of these"
        gain, delay_ms = closest.reserve.cells
        figures = (
            f"IAE {digits(closest.iae_m_s)} m s, tolerates {gain} times the gain or {delay_ms} ms more delay"
        )
        return [*said, f"{begin}: {_values(closest)}, {figures}"]


def closest_fit(points: Sequence[Point]) -> Point | None:
    """Return the closest fitting point of those that keep the margins of the reference."""
    return _closest([point for point in points if point.reserve.enough])


def _closest(points: Sequence[Point]) -> Point | None:
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


def _values(point: Point) -> str:
    """Spell the varied keys of a point."""
    return ", ".join(f"{key} {value:g}" for key, value in point.values.items())


def _row(point: Point) -> tuple[str, ...]:
    sizes = (point.flash_bytes, point.ram_bytes, point.stack_bytes, point.instructions)
    verdict = "fits" if point.fits else "not shown to fit"
    verdict += "" if point.reserve.enough else ", small margins"
    return (
        _values(point),
        *(f"{one:g}" for one in sizes),
        digits(point.time_ms),
        digits(point.iae_m_s),
        *point.reserve.cells,
        verdict,
    )
