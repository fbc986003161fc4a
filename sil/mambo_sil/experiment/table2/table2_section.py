"""The sections of the report on Table II: printed and measured indices, claims, and flights with sensors."""

from pathlib import Path

from mambo_sil.experiment.table2.sensed import SensedSummary
from mambo_sil.experiment.table2.table2 import (
    INDICES,
    PRINTED_IMPROVEMENT,
    PRINTED_NMPC,
    PRINTED_PD,
    Table2Summary,
)
from mambo_sil.flight.flight_section import pictures, traces
from mambo_sil.flight.names import PD, PD_TITLES
from mambo_sil.results.section import Section

_PRINTED = [(PD, PRINTED_PD, None), ("NMPC", PRINTED_NMPC, PRINTED_IMPROVEMENT)]


def table2_section(folder: Path, summary: Table2Summary) -> Section:
    """Return the section of Table II, with the flights of the PDs and of `mambo`; raises TraceError."""
    controllers = list(dict.fromkeys(row.controller for row in summary.rows))
    pds = PD_TITLES.values()
    nmpc = [name for name in controllers if name not in pds]
    shown = next((name for name in ("mambo", *nmpc) if name in nmpc), None)
    wanted = {name: name for name in pds if name in controllers}
    if shown is not None:
        wanted[f"NMPC, {shown}"] = shown
    flights, missing = traces(folder, {title: f"{name.lower()}.npz" for title, name in wanted.items()})
    cases = list(dict.fromkeys(row.case for row in summary.rows))
    tables = [
        (case, _PRINTED if case == cases[0] else [], [row for row in summary.rows if row.case == case])
        for case in cases
    ]
    held = sum(claim.holds for claim in summary.claims)
    finding = f"{held} of {len(summary.claims)} claims of the paper hold as flown here"
    content = {"indices": INDICES, "tables": tables, "claims": summary.claims, **pictures(flights)}
    return Section("table2", "Table II of the paper", None, finding, content, missing, moves=bool(flights))


def sensed_section(_folder: Path, summary: SensedSummary) -> Section:
    """Return the section of Table II with sensors."""
    lost, flown = (sum(getattr(row, key) for row in summary.rows) for key in ("lost", "flights"))
    content = {"rows": summary.rows, "indices": INDICES}
    return Section("sensed", "Table II with sensors", lost == 0, f"{flown} flights, {lost} lost", content)
