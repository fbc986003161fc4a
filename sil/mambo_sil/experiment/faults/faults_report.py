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

    def section(self, _folder: Path) -> Section:
        """Return the section of the report: one row per fault, both courses side by side."""
        courses = list(dict.fromkeys(flight.course for flight in self.flights))
        errors_m = [flight.largest_error_m for flight in self.flights]
        largest_m = max((error_m for error_m in errors_m if math.isfinite(error_m)), default=0.0)
        rows: dict[str, list[tuple[Verdict, float]]] = {}
        for flight in self.flights:
            percent = _bar_percent(flight.largest_error_m, largest_m)
            rows.setdefault(flight.fault, []).append((flight, percent))
        ends = [flight.end for flight in self.flights]
        counts = ", ".join(f"{ends.count(end)} {end}" for end in dict.fromkeys(ends))
        finding = f"{len(ends)} flights with {len(rows)} faults: {counts}"
        content = {"summary": self, "courses": courses, "rows": list(rows.items())}
        title = f"Faults in flight, {self.source}, vehicle {self.vehicle.name}"
        return Section("faults", title, End.CRASHED not in ends, finding, content)


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
    faults = {
        flight.fault: [one for one in summary.flights if one.fault == flight.fault]
        for flight in summary.flights
    }
    ends = [_worst_end(pair) for pair in faults.values()]
    counts = ", ".join(f"{ends.count(end)} {end}" for end in ORDER if end in ends)
    answer = f"{echo(summary.source)} on {echo(summary.vehicle.name)}: {len(faults)} faults, {counts}"
    heads = [
        "fault",
        *(f"{course}: {what}" for course in COURSES for what in ("error, m", "recovered after, s")),
    ]
    rows = [[fault, *(cell for flight in pair for cell in _cells(flight))] for fault, pair in faults.items()]
    lines = [sentence(answer), "", *table(heads, rows)]
    return "\n".join([*lines, "", sentence(_bands(summary.flights))])


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
    for fault in dict.fromkeys(verdict.fault for verdict in verdicts):
        pair = [verdict for verdict in verdicts if verdict.fault == fault]
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
