"""Verdicts on flights with faults as a record, as Markdown table, as CSV and as a section of the report."""

import csv
import math
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Final

from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.faults.fault_flights import COURSES, ORDER, End, Verdict, all_statuses
from mambo_sil.results.summary import ReportedSummary, Section

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


def table(verdicts: Sequence[Verdict]) -> str:
    """Return the verdicts as a Markdown table with one row per fault and both courses side by side."""
    head = ["fault", "status", "command, rad", "tilt, rad", "at limit, %"]
    head += [f"{course}: {what}" for course in COURSES for what in ("error, m", "back after, s")]
    rows = [[*head, "end"], ["---"] * (len(head) + 1)]
    for fault in dict.fromkeys(verdict.fault for verdict in verdicts):
        pair = [verdict for verdict in verdicts if verdict.fault == fault]
        row = [fault, ", ".join(all_statuses(pair))]
        row += [f"{max(getattr(verdict, key) for verdict in pair):.2f}" for key in _LARGEST]
        row.append(f"{100 * max(verdict.saturated_share for verdict in pair):.1f}")
        for verdict in pair:
            never = math.isnan(verdict.recovery_s)
            row += [f"{verdict.largest_error_m:.2f}", "-" if never else f"{verdict.recovery_s:.1f}"]
        rows.append([*row, max((verdict.end for verdict in pair), key=ORDER.index)])
    bands = ", ".join(
        f"{course} {next(v.band_m for v in verdicts if v.course == course and not v.turning):.3f} m"
        for course in COURSES
    )
    return "\n".join("| " + " | ".join(row) + " |" for row in rows) + f"\n\nBack means within: {bands}."


def write_csv(verdicts: Sequence[Verdict], path: Path) -> None:
    """Write the verdicts as CSV, one line per course and fault."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Verdict)], lineterminator="\n")
        writer.writeheader()
        for verdict in verdicts:
            writer.writerow(asdict(verdict) | {"statuses": " ".join(verdict.statuses)})
