"""The section of the report on a flight with the controller on a board."""

from pathlib import Path

from mambo_sil.board.pil.pil_report import (
    BoardFlightSummary,
    difference,
    emulated_text,
    link_text,
    real_time_text,
)
from mambo_sil.flight.flight_section import flown_section
from mambo_sil.results.section import Section


def board_section(folder: Path, summary: BoardFlightSummary) -> Section:
    """Return the section of a flight with a board; raises TraceError."""
    found, cycles, trip = difference(summary), summary.cycles, summary.round_trip_s
    facts = {
        "flown on": f"{summary.board_says}, {summary.port}"
        + (", bit for bit as on this machine" if found is None else ""),
        "cycles of a step": f"{cycles.least:.0f} / {cycles.median:.0f} / {cycles.most:.0f} "
        f"(least, median, most) at {summary.clock_hz / 1e6:g} MHz",
        "stack of a step": f"{summary.stack_bytes} B",
        "link": link_text(summary)
        + ("" if trip is None else f"; request to reply {1e3 * trip.median:.3g} ms (median)"),
    }
    if summary.emulated is not None:
        facts["emulated"] = emulated_text(summary)
    if summary.real_time is not None:
        facts["real time"] = "; ".join(real_time_text(summary.real_time, summary.steps))
    return flown_section(folder, summary, facts, [] if found is None else [found])
