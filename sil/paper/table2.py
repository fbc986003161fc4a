"""Table II of the paper, flown again: PD and every preset, measured beside printed, claim by claim."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.controllers.compiled import CompiledController
from mambo_nmpc.sil.controllers.pd import PdController
from mambo_nmpc.sil.flight.loop import Flight, PositionController, fly
from mambo_nmpc.sil.flight.metrics import measure
from mambo_nmpc.sil.flight.traces import Trace
from mambo_nmpc.sil.flight.trajectories import Bernoulli, Gerono, Trajectories, Trajectory

INDICES: Final = ("IAE", "ISE", "ITSE", "ITAE")
PRINTED_PD: Final = (63.02, 47.86, 2460.0, 3200.0)
PRINTED_NMPC: Final = (19.11, 5.27, 204.23, 862.77)
PRINTED_IMPROVEMENT: Final = (3.3, 9.1, 12.0, 3.7)

CASES: Final[dict[str, Trajectory]] = {
    "Bernoulli 0.5 rad/s": Bernoulli(2.0, 0.5),
    "Bernoulli 0.25 rad/s": Bernoulli(2.0, 0.25),
    "Gerono 0.25 rad/s": Gerono(2.0, 0.25),
}
"""The Table II case, which reproduces the printed PD row, and the two readings of the printed text."""

DURATION_S: Final = 100.0
PD: Final = "PD"
_CLOSE: Final = 0.10

Four = tuple[float, float, float, float]
"""IAE (m s), ISE (m^2 s), ITSE (m^2 s^2), ITAE (m s^2)."""


@dataclass(frozen=True)
class Row:
    """One controller in one case."""

    case: str
    controller: str
    measured: Four
    improvement: Four | None
    """PD over this controller, index by index; None for the PD itself."""


@dataclass(frozen=True)
class Claim:
    """What the paper says, what was measured, and whether it holds."""

    text: str
    holds: bool
    evidence: str


@dataclass(frozen=True)
class Table2:
    """All rows, the verdicts, and the traces by controller (one flight for each case, in order)."""

    rows: tuple[Row, ...]
    claims: tuple[Claim, ...]
    traces: dict[str, Trace]

    def row(self, case: str, controller: str) -> Row:
        """Return the row of a controller in a case."""
        return next(row for row in self.rows if (row.case, row.controller) == (case, controller))


def fly_table2(settings: Mapping[str, Settings], progress: Callable[[float], None] | None = None) -> Table2:
    """Fly every case with the PD and with the compiled C of `settings` by name, 100 s each."""
    flight = Flight(Trajectories(tuple(CASES.values())), duration_s=DURATION_S, flights=len(CASES))
    controllers: dict[str, PositionController] = {PD: PdController()}
    controllers |= {name: CompiledController(one, len(CASES)) for name, one in settings.items()}
    traces = {}
    for index, (name, controller) in enumerate(controllers.items()):

        def report(share: float, flown: int = index) -> None:
            if progress is not None:
                progress((flown + share) / len(controllers))

        traces[name] = fly(flight, controller, report)
    rows = tuple(_rows(traces))
    return Table2(rows, tuple(_claims(rows)), traces)


def _rows(traces: dict[str, Trace]) -> list[Row]:
    indices = {
        name: np.array([metrics.iae_m_s, metrics.ise_m2_s, metrics.itse_m2_s2, metrics.itae_m_s2])
        for name, metrics in ((name, measure(trace)) for name, trace in traces.items())
    }
    return [
        Row(
            case=case,
            controller=name,
            measured=_four(values[:, column]),
            improvement=None if name == PD else _four(indices[PD][:, column] / values[:, column]),
        )
        for column, case in enumerate(CASES)
        for name, values in indices.items()
    ]


def _four(values: np.ndarray) -> Four:
    iae, ise, itse, itae = (float(value) for value in values)
    return iae, ise, itse, itae


def _claims(rows: tuple[Row, ...]) -> list[Claim]:
    """Judge what section III of the paper claims."""
    case, *printed_readings = CASES
    return [
        _pd_claim(rows, case),
        *(_pd_claim(rows, reading) for reading in printed_readings),
        *(_improvement_claim(row) for row in rows if row.case == case and row.improvement is not None),
    ]


def _pd_claim(rows: tuple[Row, ...], case: str) -> Claim:
    measured = next(row.measured for row in rows if (row.case, row.controller) == (case, PD))
    deviation = max(abs(ours / theirs - 1) for ours, theirs in zip(measured, PRINTED_PD, strict=True))
    return Claim(
        text=f"the PD of Table II flies {case}",
        holds=deviation <= _CLOSE,
        evidence=f"largest deviation from the printed row {100 * deviation:.0f} %",
    )


def _improvement_claim(row: Row) -> Claim:
    improvement = row.improvement or (np.nan,) * 4
    holds = all(ours >= theirs for ours, theirs in zip(improvement, PRINTED_IMPROVEMENT, strict=True))
    return Claim(
        text=f"{row.controller} improves on the PD by at least " + spelled(PRINTED_IMPROVEMENT),
        holds=holds,
        evidence="measured " + spelled(improvement),
    )


def spelled(values: tuple[float, ...]) -> str:
    """Spell four indices or ratios with three digits."""
    return " / ".join(
        f"{value:#.3g}".rstrip(".") if abs(value) < 1000 else f"{value:.0f}" for value in values
    )


def digits(value: float) -> str:
    """Spell a value with four digits, and a large one in full."""
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.4g}"
