"""Table II of the paper, reproduced: every law without a model and every preset, printed and measured."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.pd import pd_controller
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight, PositionController
from mambo_sil.flight.metrics import measure
from mambo_sil.flight.names import PD, PD_NAMES, PD_TITLES
from mambo_sil.flight.traces import Trace, read_existing
from mambo_sil.flight.trajectories import Bernoulli, Gerono, Trajectories, Trajectory
from mambo_sil.results.number_format import digits, distance, three_digits
from mambo_sil.results.summary import Number, ReportedSummary, Section
from mambo_sil.results.terminal import sentence, table

INDICES: Final = ("IAE", "ISE", "ITSE", "ITAE")
UNITS: Final = ("m s", "m^2 s", "m^2 s^2", "m s^2")
PRINTED_PD: Final = (63.02, 47.86, 2460.0, 3200.0)
PRINTED_NMPC: Final = (19.11, 5.27, 204.23, 862.77)
PRINTED_IMPROVEMENT: Final = (3.3, 9.1, 12.0, 3.7)
_PRINTED: Final = [(PD, PRINTED_PD, None), ("NMPC", PRINTED_NMPC, PRINTED_IMPROVEMENT)]

CASES: Final[dict[str, Trajectory]] = {
    "Bernoulli 0.5 rad/s": Bernoulli(2.0, 0.5),
    "Bernoulli 0.25 rad/s": Bernoulli(2.0, 0.25),
    "Gerono 0.25 rad/s": Gerono(2.0, 0.25),
}
"""The trajectory that reproduces the printed PD row, and the two that the paper's text may mean."""

PRESETS: Final = ("mambo", "mambo-1norm", "table1", "table1-printed")
"""The presets for the Mambo."""
DURATION_S: Final = 100.0
_CLOSE: Final = 0.10

Four = tuple[Number, Number, Number, Number]
"""IAE (m s), ISE (m^2 s), ITSE (m^2 s^2), ITAE (m s^2)."""


@dataclass(frozen=True)
class Table2Row:
    """One controller in one case."""

    case: str
    controller: str
    measured: Four
    improvement: Four | None
    """Ratio of the paper's PD's index to this controller's, for each index; None for that PD itself."""
    command_variation_rad: Number
    """Command variation: the mean 1-norm of the change of the command from update to update."""


@dataclass(frozen=True)
class Claim:
    """A claim of the paper, the measurement, and whether the claim holds."""

    text: str
    holds: bool
    evidence: str


class Table2Summary(ReportedSummary):
    """Results of the command `table2`."""

    command = "table2"

    scalar: str | None
    """Scalar type in place of the presets', if any."""
    cases: list[str]
    rows: list[Table2Row]
    claims: list[Claim]

    def section(self, folder: Path) -> Section:
        """Return the section of the report, with the flights of the PDs and of `mambo`; raises TraceError."""
        from mambo_sil.flight.flight_plots import page_pictures  # noqa: PLC0415 - loaded when drawing

        controllers = list(dict.fromkeys(row.controller for row in self.rows))
        pds = PD_TITLES.values()
        nmpc = [name for name in controllers if name not in pds]
        shown = next((name for name in ("mambo", *nmpc) if name in nmpc), None)
        wanted = {name: name for name in pds if name in controllers}
        if shown is not None:
            wanted[f"NMPC, {shown}"] = shown
        flights, missing = read_existing(
            folder, {title: f"{name.lower()}.npz" for title, name in wanted.items()}
        )
        cases = list(dict.fromkeys(row.case for row in self.rows))
        tables = [
            (case, _PRINTED if case == cases[0] else [], [row for row in self.rows if row.case == case])
            for case in cases
        ]
        held = sum(claim.holds for claim in self.claims)
        finding = f"{held} of {len(self.claims)} claims of the paper hold as flown here"
        content = {"indices": INDICES, "tables": tables, "claims": self.claims, **page_pictures(flights)}
        return Section(
            "table2", "Table II of the paper", None, finding, content, missing, moves=bool(flights)
        )


def report_part(progress: Callable[[float], None], part: int, parts: int) -> Callable[[float], None]:
    """Return a function that turns the share done of one of `parts` parts into the share of the whole."""
    return lambda share: progress((part + share) / parts)


def fly_table2(settings: Mapping[str, Settings], progress: Callable[[float], None]) -> dict[str, Trace]:
    """Fly every case with the laws without a model and with the compiled C of `settings` by name, 100 s each.

    Calls `progress` with the share done. Returns the traces by controller, with one flight for each case.
    """
    flight = Flight(Trajectories(tuple(CASES.values())), duration_s=DURATION_S, flights=len(CASES))
    controllers: dict[str, PositionController] = {
        PD_TITLES[name]: pd_controller(name, flight) for name in PD_NAMES
    }
    controllers |= {name: CompiledController(one, len(CASES)) for name, one in settings.items()}
    return {
        name: fly(flight, controller, report_part(progress, index, len(controllers)))
        for index, (name, controller) in enumerate(controllers.items())
    }


def judge_table2(traces: Mapping[str, Trace], scalar: str | None) -> Table2Summary:
    """Compare the traces of `fly_table2` with the printed table, and judge the claims of section III."""
    rows = _rows(traces)
    claims = [_pd_claim(rows, case) for case in CASES]
    presets = [row for row in rows if row.controller not in PD_TITLES.values()]
    claims += [_improvement_claim(row) for row in presets if row.case == next(iter(CASES))]
    return Table2Summary(scalar=scalar, cases=list(CASES), rows=rows, claims=claims)


def table2_text(summary: Table2Summary) -> str:
    """Return Table II as text: the answer, a table for each case, printed above flown, then the claims."""
    shortest = next(iter(CASES))
    drone = vehicle_toml.DEFAULT
    lines = [
        f"{row.controller} on {drone}: {distance(row.measured[0] / DURATION_S)} in the mean on {shortest}"
        for row in summary.rows
        if row.case == shortest
    ]
    for case in CASES:
        rows = []
        if case == shortest:
            rows += [_line("printed PD", PRINTED_PD, None, "")]
            rows += [_line("printed NMPC", PRINTED_NMPC, PRINTED_IMPROVEMENT, "")]
        rows += [
            _line(
                f"flown {row.controller}", row.measured, row.improvement, f"{row.command_variation_rad:.4f}"
            )
            for row in summary.rows
            if row.case == case
        ]
        units = (f"{index}, {unit}" for index, unit in zip(INDICES, UNITS, strict=True))
        lines += ["", *table((case, *units, "improvement", "variation, rad"), rows)]
    lines += [
        "",
        sentence("printed: in the paper; flown: here, 100 s along a figure of eight of 4 m"),
        sentence("improvement: IAE of the flown PD, or of the printed one, divided by that of the row"),
        sentence("variation: the mean change of the command from one update to the next"),
        "",
    ]
    claims = [
        ("holds" if claim.holds else "does not hold", f"{claim.text}: {claim.evidence}")
        for claim in summary.claims
    ]
    return "\n".join([*lines, *table(("verdict", "the paper's claims, as flown here"), claims, (0, 1))])


def _line(name: str, values: Four, improvement: Four | None, variation: str) -> tuple[str, ...]:
    return (name, *map(digits, values), "" if improvement is None else digits(improvement[0]), variation)


def _rows(traces: Mapping[str, Trace]) -> list[Table2Row]:
    measured = {name: measure(trace) for name, trace in traces.items()}
    indices = {name: found.table2 for name, found in measured.items()}
    return [
        Table2Row(
            case=case,
            controller=name,
            measured=four(values[:, column]),
            improvement=None if name == PD else four(indices[PD][:, column] / values[:, column]),
            command_variation_rad=float(measured[name].command_variation_rad[column]),
        )
        for column, case in enumerate(CASES)
        for name, values in indices.items()
    ]


def four(values: np.ndarray) -> Four:
    """Return four numbers as a tuple."""
    iae, ise, itse, itae = (float(value) for value in values)
    return iae, ise, itse, itae


def _pd_claim(rows: Sequence[Table2Row], case: str) -> Claim:
    measured = next(row.measured for row in rows if (row.case, row.controller) == (case, PD))
    deviation = max(abs(ours / theirs - 1) for ours, theirs in zip(measured, PRINTED_PD, strict=True))
    return Claim(
        text=f"the PD has its printed indices on {case}",
        holds=deviation <= _CLOSE,
        evidence=f"largest deviation {100 * deviation:.0f} %",
    )


def _improvement_claim(row: Table2Row) -> Claim:
    improvement = row.improvement or (np.nan,) * 4
    holds = all(ours >= theirs for ours, theirs in zip(improvement, PRINTED_IMPROVEMENT, strict=True))
    return Claim(
        text=f"{row.controller} improves on the PD by at least " + _spelled(PRINTED_IMPROVEMENT),
        holds=holds,
        evidence="measured " + _spelled(improvement),
    )


def _spelled(values: Four) -> str:
    return " / ".join(map(three_digits, values))
