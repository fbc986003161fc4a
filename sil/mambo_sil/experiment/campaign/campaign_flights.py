"""The task of a worker: fly a batch of random flights with every controller and return their results.

Arguments and results are plain values, which can be sent to other processes and machines.
"""

import threading
from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import cache
from typing import Any, Final

from mambo_codegen import __version__
from mambo_codegen.methods import method_of
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.errors import ArgumentError, WorkerError
from mambo_sil.experiment.campaign.campaign_file import scenario
from mambo_sil.experiment.campaign.executors import report_share
from mambo_sil.experiment.campaign.parameters import Draw
from mambo_sil.experiment.inputs import Entrant
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.own_law import Law, LawFile, OwnLaws, period_of
from mambo_sil.flight.controllers.pd import pd_controller
from mambo_sil.flight.engine.evaluate import evaluate
from mambo_sil.flight.engine.simulate import fly, fly_groups, part_of
from mambo_sil.flight.fences import LIMIT_METRICS, fenced, measure_limits
from mambo_sil.flight.loop import Flight, PositionController
from mambo_sil.flight.metrics import HEIGHT_METRICS, Metrics
from mambo_sil.flight.names import PD_NAMES
from mambo_sil.flight.scenario import Scenario, flight_of
from mambo_sil.flight.traces import SensedTrace, Trace
from mambo_sil.flight.trajectories import Trajectory
from mambo_sil.results.metric_names import SEEN

INDICES: Final = tuple(field.name for field in fields(Metrics))
"""Metrics of the true flight."""

SEEN_INDICES: Final = tuple(name for name in INDICES if "rad" not in name)
"""Metrics of the error that are also computed from the estimates."""

CRASHED, REFUSED, DIGEST = "crashed", "refused_updates", "trace_sha256"
FAILURE: Final = "failure"
"""When and why a law of the user's own failed; not a column of a campaign."""
SATURATED: Final = "saturated_share"
"""Share of the commands with roll or pitch at the tilt limit of the settings; not a column of a campaign."""

OF_LIMITS: Final = (*LIMIT_METRICS, *(SEEN + name for name in LIMIT_METRICS))
"""How flights keep within the limits, truly and as the estimates tell; no columns of a campaign."""

MOST_TOGETHER: Final = 20
"""Flights that one simulation flies: more are hardly faster, and take more memory for their targets."""

Report = Callable[[float], None]

Row = dict[str, float | str]
"""Results of one flight by `<controller>_<index>`."""

_BUILDING: Final = threading.Lock()
"""Lets only one thread of a worker compile at a time; the next finds the result in the cache."""


def indices(*, sensed: bool, spatial: bool) -> tuple[str, ...]:
    """Return the metrics of a campaign: as flown and as estimated, in space with the height."""
    found = (*INDICES, *(SEEN + name for name in SEEN_INDICES if sensed))
    return tuple(name for name in found if spatial or name.removeprefix(SEEN) not in HEIGHT_METRICS)


def columns(names: Sequence[str], *, sensed: bool, spatial: bool = False) -> tuple[str, ...]:
    """Return the keys of a row for controllers of these names, in the order of the table."""
    keys = CRASHED, REFUSED, *indices(sensed=sensed, spatial=spatial), DIGEST
    return tuple(f"{name}_{key}" for name in names for key in keys)


def fly_batch(
    version: str, entrants: Sequence[dict[str, Any]], flight: dict[str, Any], drawn: Sequence[Draw]
) -> list[Row]:
    """Fly the flights `drawn` with every controller, `MOST_TOGETHER` at a time; return their rows, in order.

    `flight` is the campaign's, `version` the calling program's. Raises WorkerError if the worker
    has another version, BuildError if it has no compiler.
    """
    if version != __version__:
        raise WorkerError(
            f"a worker has mambo-nmpc {__version__}, the campaign {version}; install the same on both"
        )
    flying = [Entrant.from_document(document) for document in entrants]
    rows: list[Row] = []
    for first in range(0, len(drawn), MOST_TOGETHER):
        scenarios = [scenario(flight, one) for one in drawn[first : first + MOST_TOGETHER]]
        report = part_of(report_share, first, len(drawn), len(scenarios))
        rows += fly_scenarios(flying, scenarios, report)
    report_share(0.0)
    return rows


def fly_scenarios(
    entrants: Sequence[Entrant],
    scenarios: Sequence[Scenario],
    report: Report = report_share,
    *,
    curve: Trajectory | None = None,
) -> list[Row]:
    """Fly flights together with every controller; return one row per flight, in order.

    `curve` takes the place of the curves that the scenarios name.
    Calls `report`, by default the worker's pool's, with the share done. Raises BuildError if there is no
    compiler, FlightError for flights that cannot be simulated together, ArgumentError for what is no law.
    """
    rows: list[Row] = [{} for _ in scenarios]
    compiled = [one for one in entrants if one.law is None]
    flown = 0
    for period_s in dict.fromkeys(entrant.update_period_s for entrant in compiled):
        flight = flight_of(scenarios, period_s, curve)
        these = [one for one in compiled if one.update_period_s == period_s]
        share = part_of(report, flown, len(entrants), len(these))
        for group in fly_groups(flight, [_controller(one, scenarios, flight) for one in these], share):
            entrant, last = these[group.controller], group.first + group.trace.flights
            results = _evaluate(group.trace, method_of(entrant.settings).tilt_limit_rad, scenarios[0].vehicle)
            results |= _evaluate_limits(group.trace, entrant, scenarios[group.first : last])
            for key, values in results.items():
                for row, value in zip(rows[group.first : last], values, strict=True):
                    row[f"{entrant.name}_{key}"] = value
        flown += len(these)
    for entrant in entrants:
        if entrant.law is not None:
            law = _load(entrant.law) if isinstance(entrant.law, LawFile) else entrant.law
            flight = flight_of(scenarios, period_of(law), curve)
            found = _fly_law(entrant.name, law, flight, part_of(report, flown, len(entrants)))
            rows = [row | of_law for row, of_law in zip(rows, found, strict=True)]
            flown += 1
    report(0.0)
    return rows


def _fly_law(name: str, law: Law, flight: Flight, report: Report) -> list[Row]:
    """Fly flights together with a law of the user's own; return one row per flight, with why it failed."""
    try:
        laws = OwnLaws(law, flight)
    except ArgumentError as error:
        raise ArgumentError(f"{name}: {error}") from error
    trace = fly(flight, laws, report)
    results = _evaluate(trace, method_of(Settings()).tilt_limit_rad, flight.vehicle.drone)
    rows: list[Row] = [
        {f"{name}_{key}": values[number] for key, values in results.items()}
        for number in range(flight.flights)
    ]
    for number, failure in laws.failures.items():
        rows[number][f"{name}_{FAILURE}"] = failure
    return rows


@cache
def _load(law: LawFile) -> Law:
    """Return a law; a worker reads its file once."""
    with _BUILDING:
        return law.load()


def _controller(entrant: Entrant, scenarios: Sequence[Scenario], flight: Flight) -> PositionController:
    if entrant.kind in PD_NAMES:
        return pd_controller(entrant.kind, flight)
    with _BUILDING:
        compiled = CompiledController(entrant.settings, flight.flights)
    return fenced(compiled, entrant.settings, scenarios, flight)


def _evaluate(trace: Trace, limit_rad: float, drone: VehicleFile) -> dict[str, list[Any]]:
    """Return the results of n flights of a drone by key, each a list of n."""
    results = evaluate(trace, limit_rad, drone)
    found: dict[str, list[Any]] = {
        CRASHED: results.crashed.astype(int).tolist(),
        REFUSED: results.refused.tolist(),
        SATURATED: results.saturated_share.tolist(),
    }
    for prefix, names, metrics in (("", INDICES, results.metrics), (SEEN, SEEN_INDICES, results.seen)):
        if metrics is not None:
            found |= {prefix + name: getattr(metrics, name).tolist() for name in names}
    return found | {DIGEST: [trace.digest(flight) for flight in range(trace.flights)]}


def _evaluate_limits(trace: Trace, entrant: Entrant, scenarios: Sequence[Scenario]) -> dict[str, list[Any]]:
    """Return how n flights keep within the limits, by key, each a list of n; nothing without limits.

    Without sensors the estimates are the true state.
    """
    found: dict[str, list[Any]] = {}
    if entrant.kind == "nmpc" and method_of(entrant.settings).limiting is not None:
        seen = trace.as_seen() if isinstance(trace, SensedTrace) else trace
        for prefix, view in (("", trace), (SEEN, seen)):
            metrics = measure_limits(view, entrant.settings, scenarios)
            found |= {prefix + name: getattr(metrics, name).tolist() for name in LIMIT_METRICS}
    return found
