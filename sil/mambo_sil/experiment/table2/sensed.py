"""The Table II case with sensors: PDs and NMPC with the true state, and with both estimators."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.elementary import hypotenuse
from mambo_sil.drone.sensors.instruments import Sensors
from mambo_sil.experiment.table2.table2 import (
    CASES,
    DURATION_S,
    INDICES,
    PRINTED_NMPC,
    PRINTED_PD,
    Four,
    four,
)
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.pd import pd_controller
from mambo_sil.flight.engine.simulate import fly, part_of
from mambo_sil.flight.loop import Flight, PositionController
from mambo_sil.flight.metrics import measure
from mambo_sil.flight.names import PD_NAMES, PD_TITLES
from mambo_sil.flight.traces import SensedTrace, Trace
from mambo_sil.results.blocks import CommandResult, Note, ResultTable
from mambo_sil.results.number_format import digits, distance
from mambo_sil.results.summary import Number, ReportedSummary

PRESETS: Final = ("mambo", "table1")
"""Presets that are compared with the PDs."""
FLIGHTS: Final = 20
"""Flights of a row with noise; their seeds count from 0."""

VIEWS: Final[dict[str, Sensors | None]] = {
    "the truth": None,
    "mambo, noise-free": Sensors(noise_scale=0.0),
    "mambo": Sensors(),
    "mambo-derotated, noise-free": Sensors(noise_scale=0.0, derotated=True),
    "mambo-derotated": Sensors(derotated=True),
}


@dataclass(frozen=True)
class SensedRow:
    """One controller with one source of its state: medians over its flights.

    tracked: indices of the true error. seen: indices of the estimated error.
    worst_iae_m_s: largest true IAE. drift_m: horizontal error of the position estimate at the end.
    """

    controller: str
    view: str
    flights: int
    lost: int
    tracked: Four
    seen: Four
    worst_iae_m_s: Number
    drift_m: Number


class SensedSummary(ReportedSummary):
    """The Table II case with sensors and estimators."""

    command = "table2 --sensors"

    scalar: str | None
    """Scalar type in place of the presets', if any."""
    rows: list[SensedRow]

    def result(self, _folder: Path, /) -> CommandResult:
        """Return the result: the rows below those printed in the paper."""
        answer = [
            f"{row.controller}, sensors {row.view}: {distance(row.tracked[0] / DURATION_S)} in the mean"
            for row in self.rows
            if row.flights > 1
        ]
        good = False if any(row.lost for row in self.rows) else None
        return CommandResult("Table II with sensors", good, answer, [_table(self.rows), Note(_ABOUT)])


def fly_sensed(
    settings: Mapping[str, Settings],
    progress: Callable[[float], None],
    *,
    duration_s: float = DURATION_S,
    flights: int = FLIGHTS,
) -> list[SensedRow]:
    """Fly the case with each law without a model and the C of `settings` by name, each with all `VIEWS`.

    Calls `progress` with the share done; rows without noise have one flight.
    """
    pds = {PD_TITLES[name]: name for name in PD_NAMES}
    jobs = [(name, view) for name in (*pds, *settings) for view in VIEWS]
    case = next(iter(CASES.values()))
    rows = []
    for index, (name, view) in enumerate(jobs):
        sensors = VIEWS[view]
        n = flights if sensors is not None and sensors.noise_scale else 1
        flight = Flight(case, duration_s=duration_s, flights=n, seeds=tuple(range(n)), sensors=sensors)
        controller: PositionController = (
            pd_controller(pds[name], flight) if name in pds else CompiledController(settings[name], n)
        )
        trace = fly(flight, controller, part_of(progress, index, len(jobs)))
        rows.append(_judge(name, view, trace))
    return rows


def _judge(name: str, view: str, trace: Trace) -> SensedRow:
    tracked = measure(trace)
    seen, drift_m = tracked, np.zeros(trace.flights)
    if isinstance(trace, SensedTrace):
        seen = measure(trace.as_seen())
        drift_m = hypotenuse(*(trace.seen_position_m - trace.position_m)[-1, :, :2].T)
    return SensedRow(
        controller=name,
        view=view,
        flights=trace.flights,
        lost=int(trace.diverged.sum()),
        tracked=four(np.median(tracked.table2, axis=1)),
        seen=four(np.median(seen.table2, axis=1)),
        worst_iae_m_s=float(tracked.iae_m_s.max()),
        drift_m=float(np.median(drift_m)),
    )


_HEADS: Final = ("controller", "sensors", "flights", *INDICES, "worst IAE", "IAE as estimated", "drift, m")
_ABOUT: Final = (
    "The Table II case, medians over the flights of a row. Indices are of the true error, those as estimated "
    "of the error of the estimated position; drift is the error of the position estimate at the end. IAE in "
    "m s, ISE in m^2 s, ITSE in m^2 s^2, ITAE in m s^2."
)


def sensed_markdown(rows: Sequence[SensedRow]) -> str:
    """Return the rows as a Markdown table."""
    return _table(rows).markdown()


def _table(rows: Sequence[SensedRow]) -> ResultTable:
    return ResultTable(_HEADS, list(_cells(rows)), (0, 1, 2), (4, 5, 6))


def _cells(rows: Sequence[SensedRow]) -> Iterator[tuple[str, ...]]:
    for name, printed in (("PD, printed", PRINTED_PD), ("NMPC, printed", PRINTED_NMPC)):
        yield (name, "", "", *map(digits, printed), "", "", "")
    for row in rows:
        flights = f"{row.flights}" + (f", {row.lost} lost" if row.lost else "")
        ends = (row.worst_iae_m_s, row.seen[0], row.drift_m)
        yield (row.controller, row.view, flights, *map(digits, row.tracked), *map(digits, ends))
