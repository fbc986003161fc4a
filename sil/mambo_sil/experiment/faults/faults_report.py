"""Verdicts on flights with faults: record, result, Markdown table and CSV."""

import csv
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Final

from mambo_codegen.errors import echo
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.faults.fault_flights import COURSES, ORDER, End, Verdict, all_statuses
from mambo_sil.results.blocks import CommandResult, Note, ResultTable, Sentence
from mambo_sil.results.summary import ReportedSummary

_LARGEST: Final = ("largest_command_rad", "largest_tilt_rad")
_ABOUT: Final = (
    "The error is the largest distance to the true target since the onset of the fault. Recovered after: "
    "from the end of the fault until the error stays within 1.5 times that of the fault-free flight. At "
    "limit: the share of the time since the onset with a command at the tilt limit."
)


class FaultsSummary(ReportedSummary):
    """Flights with faults."""

    command = "faults"

    source: str
    settings: str
    vehicle: VehicleFile = NOMINAL
    flights: list[Verdict]

    @property
    def crashed(self) -> bool:
        """Whether the drone crashed in a flight."""
        return any(flight.end is End.CRASHED for flight in self.flights)

    def result(self, _folder: Path, /) -> CommandResult:
        """Return the result: how many faults ended how, then a row per fault, both courses side by side."""
        recovered = all(flight.end is End.RECOVERED for flight in self.flights)
        return CommandResult(
            f"Faults in flight, {self.source}, vehicle {self.vehicle.name}",
            False if self.crashed else recovered or None,
            [_counts(self.flights)],
            [Note(_ABOUT), _table(self.flights), Sentence(_bands(self.flights))],
            self.subject,
        )

    @property
    def subject(self) -> str:
        """What flew on which drone."""
        return f"{echo(self.source)} on {echo(self.vehicle.name)}"


def _counts(verdicts: Sequence[Verdict]) -> str:
    """Return how many faults ended how; the worse of the two courses counts."""
    ends = [_worst_end(pair) for pair in _pairs(verdicts).values()]
    return f"{len(ends)} faults, " + ", ".join(f"{ends.count(end)} {end}" for end in ORDER if end in ends)


def _pairs(verdicts: Sequence[Verdict]) -> dict[str, list[Verdict]]:
    """Return the flights of each fault, one for each course."""
    return {one.fault: [other for other in verdicts if other.fault == one.fault] for one in verdicts}


def faults_markdown(verdicts: Sequence[Verdict]) -> str:
    """Return the verdicts as a Markdown table with one row per fault and both courses side by side."""
    return f"{_table(verdicts).markdown()}\n\n{_bands(verdicts)}"


def _table(verdicts: Sequence[Verdict]) -> ResultTable:
    """Return a row per fault; the console has the largest errors and when the drone recovered."""
    errors = [f"{course}: {what}" for course in COURSES for what in ("error, m", "recovered after, s")]
    heads = ("fault", "end", "status", *errors, "command, rad", "tilt, rad", "at limit, %")
    rows = []
    for fault, pair in _pairs(verdicts).items():
        row = [fault, _worst_end(pair), ", ".join(all_statuses(pair))]
        row += [cell for flight in pair for cell in _cells(flight)]
        row += [f"{max(getattr(verdict, key) for verdict in pair):.2f}" for key in _LARGEST]
        rows.append((*row, f"{100 * max(verdict.saturated_share for verdict in pair):.1f}"))
    return ResultTable(heads, rows, (0, 1, 2), (1, 2, 7, 8, 9))


def _cells(flight: Verdict) -> tuple[str, str]:
    """Return the largest error of a flight, and when it recovered."""
    after = {End.CRASHED: "CRASHED", End.NOT_RECOVERED: "never"}
    return f"{flight.largest_error_m:.2f}", after.get(flight.end, f"{flight.recovery_s:.1f}")


def _worst_end(pair: Sequence[Verdict]) -> End:
    """Return how the flights with a fault ended."""
    return max((flight.end for flight in pair), key=ORDER.index)


def _mm(length_m: float) -> str:
    """Return a length in mm, with two digits."""
    return f"{float(f'{1e3 * length_m:.2g}'):g}"


def _bands(verdicts: Sequence[Verdict]) -> str:
    bands = ", ".join(
        f"{course} {_mm(next(v.band_m for v in verdicts if v.course == course and not v.turning))} mm"
        for course in COURSES
    )
    return f"Recovered means an error within: {bands}."


def write_csv(verdicts: Sequence[Verdict], path: Path) -> None:
    """Write the verdicts as CSV, one line per course and fault."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Verdict)], lineterminator="\n")
        writer.writeheader()
        for verdict in verdicts:
            writer.writerow(asdict(verdict) | {"statuses": " ".join(verdict.statuses)})
