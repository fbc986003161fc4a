"""The section of the report on flights with faults: one row per fault, both courses side by side."""

import math
from pathlib import Path

from mambo_sil.experiment.faults.fault_flights import End, FaultsSummary, Verdict
from mambo_sil.results.section import Section

_SHORTEST_BAR_M = 0.01


def faults_section(_folder: Path, summary: FaultsSummary) -> Section:
    """Return the section of flights with faults."""
    courses = list(dict.fromkeys(flight.course for flight in summary.flights))
    errors_m = [flight.largest_error_m for flight in summary.flights]
    largest_m = max((error_m for error_m in errors_m if math.isfinite(error_m)), default=0.0)
    rows: dict[str, list[tuple[Verdict, float]]] = {}
    for flight in summary.flights:
        percent = _bar_percent(flight.largest_error_m, largest_m)
        rows.setdefault(flight.fault, []).append((flight, percent))
    ends = [flight.end for flight in summary.flights]
    counts = ", ".join(f"{ends.count(end)} {end}" for end in dict.fromkeys(ends))
    finding = f"{len(ends)} flights with {len(rows)} faults: {counts}"
    content = {"summary": summary, "courses": courses, "rows": list(rows.items())}
    return Section("faults", _title(summary), End.CRASHED not in ends, finding, content)


def _title(summary: FaultsSummary) -> str:
    return f"Faults in flight, {summary.source}, vehicle {summary.vehicle.name}"


def _bar_percent(error_m: float, largest_m: float) -> float:
    """Return the length of a bar in % on a logarithmic scale from 0.01 m to the largest error."""
    if not error_m > _SHORTEST_BAR_M or largest_m <= _SHORTEST_BAR_M:
        return 0.0
    return round(100.0 * math.log(error_m / _SHORTEST_BAR_M) / math.log(largest_m / _SHORTEST_BAR_M), 1)
