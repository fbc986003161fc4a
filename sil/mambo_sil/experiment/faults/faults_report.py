"""Verdicts on flights with faults: record, text, Markdown table, CSV and section of the report."""

import csv
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Final

from mambo_codegen.errors import echo
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.faults.fault_flights import COURSES, ORDER, End, Verdict, all_statuses
from mambo_sil.results.summary import ReportedSummary, Section
from mambo_sil.results.terminal import sentence, table

_LARGEST: Final = ("largest_command_rad", "largest_tilt_rad")
_SHORTEST_BAR_M: Final = 0.01


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

    def section(self, _folder: Path) -> Section:
        """Return the section of the report: one row per fault, both courses side by side."""
        courses = list(dict.fromkeys(flight.course for flight in self.flights))
        errors_m = [flight.largest_error_m for flight in self.flights]
        largest_m = max((error_m for error_m in errors_m if math.isfinite(error_m)), default=0.0)
        rows: dict[str, list[tuple[Verdict, float]]] = {}
        for flight in self.flights:
            percent = _bar_percent(flight.largest_error_m, largest_m)
            rows.setdefault(flight.fault, []).append((flight, percent))
        content = {"summary": self, "courses": courses, "rows": list(rows.items())}
        title = f"Faults in flight, {self.source}, vehicle {self.vehicle.name}"
        recovered = all(flight.end is End.RECOVERED for flight in self.flights)
        good = False if self.crashed else recovered or None
        return Section("faults", title, good, _counts(self), content)


def _bar_percent(error_m: float, largest_m: float) -> float:
    """Return the length of a bar in % on a logarithmic scale from 0.01 m to the largest error."""
    if not error_m > _SHORTEST_BAR_M or largest_m <= _SHORTEST_BAR_M:
        return 0.0
    return round(100.0 * math.log(error_m / _SHORTEST_BAR_M) / math.log(largest_m / _SHORTEST_BAR_M), 1)


_HEADS: Final = (
    *("fault", "status", "command, rad", "tilt, rad", "at limit, %"),
    *(f"{course}: {what}" for course in COURSES for what in ("error, m", "recovered after, s")),
    "end",
)


def faults_text(summary: FaultsSummary) -> str:
    """Return the verdicts as text: how many faults ended how, then a row per fault."""
    answer = f"{echo(summary.source)} on {echo(summary.vehicle.name)}: {_counts(summary)}"
    heads = [
        "fault",
        *(f"{course}: {what}" for course in COURSES for what in ("error, m", "recovered after, s")),
    ]
    rows = [
        [fault, *(cell for flight in pair for cell in _cells(flight))]
        for fault, pair in _pairs(summary.flights).items()
    ]
    lines = [sentence(answer), "", *table(heads, rows)]
    return "\n".join([*lines, "", sentence(_bands(summary.flights))])


def _counts(summary: FaultsSummary) -> str:
    """Return how many faults ended how; the worse of the two courses counts."""
    ends = [_worst_end(pair) for pair in _pairs(summary.flights).values()]
    return f"{len(ends)} faults, " + ", ".join(f"{ends.count(end)} {end}" for end in ORDER if end in ends)


def _pairs(verdicts: Sequence[Verdict]) -> dict[str, list[Verdict]]:
    """Return the flights of each fault, one for each course."""
    return {one.fault: [other for other in verdicts if other.fault == one.fault] for one in verdicts}


def faults_markdown(verdicts: Sequence[Verdict]) -> str:
    """Return the verdicts as a Markdown table with one row per fault and both courses side by side."""
    lines = [_HEADS, ("---",) * len(_HEADS), *_rows(verdicts)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + f"\n\n{_bands(verdicts)}"


def _cells(flight: Verdict) -> tuple[str, str]:
    """Return the largest error of a flight, and when it recovered."""
    after = {End.CRASHED: "CRASHED", End.NOT_RECOVERED: "never"}
    return f"{flight.largest_error_m:.2f}", after.get(flight.end, f"{flight.recovery_s:.1f}")


def _worst_end(pair: Sequence[Verdict]) -> End:
    """Return how the flights with a fault ended."""
    return max((flight.end for flight in pair), key=ORDER.index)


def _rows(verdicts: Sequence[Verdict]) -> Iterator[tuple[str, ...]]:
    for fault, pair in _pairs(verdicts).items():
        row = [fault, ", ".join(all_statuses(pair))]
        row += [f"{max(getattr(verdict, key) for verdict in pair):.2f}" for key in _LARGEST]
        row.append(f"{100 * max(verdict.saturated_share for verdict in pair):.1f}")
        for verdict in pair:
            never = math.isnan(verdict.recovery_s)
            row += [f"{verdict.largest_error_m:.2f}", "-" if never else f"{verdict.recovery_s:.1f}"]
        yield (*row, _worst_end(pair))


def _bands(verdicts: Sequence[Verdict]) -> str:
    bands = ", ".join(
        f"{course} {next(v.band_m for v in verdicts if v.course == course and not v.turning):.3f} m"
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
