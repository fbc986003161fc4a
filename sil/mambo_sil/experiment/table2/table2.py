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
from mambo_sil.flight.engine.simulate import fly, part_of
from mambo_sil.flight.flight_report import flight_pictures
from mambo_sil.flight.loop import Flight, PositionController
from mambo_sil.flight.metrics import measure
from mambo_sil.flight.names import PD, PD_NAMES, PD_TITLES
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import Bernoulli, Gerono, Trajectories, Trajectory
from mambo_sil.results.blocks import CommandResult, ResultTable, Sentence
from mambo_sil.results.number_format import digits, distance, three_digits
from mambo_sil.results.summary import Number, ReportedSummary

INDICES: Final = ("IAE", "ISE", "ITSE", "ITAE")
UNITS: Final = ("m s", "m^2 s", "m^2 s^2", "m s^2")
PRINTED_PD: Final = (63.02, 47.86, 2460.0, 3200.0)
PRINTED_NMPC: Final = (19.11, 5.27, 204.23, 862.77)
PRINTED_IMPROVEMENT: Final = (3.3, 9.1, 12.0, 3.7)
CAPTION: Final = "Fig. 3 of the paper, reproduced: path, horizontal error, commanded and actual angles."

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

    def result(self, folder: Path, /) -> CommandResult:
        """Return the result: a table for each case, printed above flown, and the claims.

        A page has the flights of the PDs and of `mambo`; drawing raises TraceError.
        """
        controllers = list(dict.fromkeys(row.controller for row in self.rows))
        pds = PD_TITLES.values()
        nmpc = [name for name in controllers if name not in pds]
        shown = "mambo" if "mambo" in nmpc else next(iter(nmpc), None)
        drawn = {name: f"{name.lower()}.npz" for name in pds if name in controllers}
        drawn |= {} if shown is None else {f"NMPC, {shown}": f"{shown.lower()}.npz"}
        claims = [
            ("holds" if claim.holds else "does not hold", f"{claim.text}: {claim.evidence}")
            for claim in self.claims
        ]
        return CommandResult(
            "Table II of the paper",
            None,
            [
                f"{row.controller} on {vehicle_toml.DEFAULT}: "
                f"{distance(row.measured[0] / DURATION_S)} in the mean on {row.case}"
                for row in self.rows
                if row.case == self.cases[0]
            ],
            [
                *(_case_table(case, self.rows) for case in self.cases),
                Sentence("printed: in the paper; flown: here, 100 s along a figure of eight of 4 m"),
                Sentence("improvement: IAE of the flown PD, or the printed one, divided by the row's"),
                Sentence("variation: the mean change of the command from one update to the next"),
                ResultTable(("verdict", "the paper's claims, as flown here"), claims, (0, 1)),
                *flight_pictures(folder, drawn, CAPTION),
            ],
        )


def _case_table(case: str, rows: Sequence[Table2Row]) -> ResultTable:
    """Return what is printed for a case, if anything, above what was flown."""
    printed = [("printed PD", PRINTED_PD, None, ""), ("printed NMPC", PRINTED_NMPC, PRINTED_IMPROVEMENT, "")]
    lines: list[tuple[str, Four, Four | None, str]] = printed if case == next(iter(CASES)) else []
    lines += [
        (f"flown {row.controller}", row.measured, row.improvement, f"{row.command_variation_rad:.4f}")
        for row in rows
        if row.case == case
    ]
    units = [f"{index}, {unit}" for index, unit in zip(INDICES, UNITS, strict=True)]
    heads = (case, *units, "improvement", *(f"of {index}" for index in INDICES[1:]), "variation, rad")
    cells = [
        (name, *map(digits, values), *map(digits, ratios or ()), *[""] * (0 if ratios else 4), variation)
        for name, values, ratios, variation in lines
    ]
    return ResultTable(heads, cells, (0,), (6, 7, 8))


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
        name: fly(flight, controller, part_of(progress, index, len(controllers)))
        for index, (name, controller) in enumerate(controllers.items())
    }


def judge_table2(traces: Mapping[str, Trace], scalar: str | None) -> Table2Summary:
    """Compare the traces of `fly_table2` with the printed table, and judge the claims of section III."""
    rows = _rows(traces)
    claims = [_pd_claim(rows, case) for case in CASES]
    presets = [row for row in rows if row.controller not in PD_TITLES.values()]
    claims += [_improvement_claim(row) for row in presets if row.case == next(iter(CASES))]
    return Table2Summary(scalar=scalar, cases=list(CASES), rows=rows, claims=claims)


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
