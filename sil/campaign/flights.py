"""Fly a batch of drawn flights with every controller, and say what became of each: what a worker does.

Everything that comes in and goes out is plain values, so that it travels to other processes and machines.
"""

import threading
from collections.abc import Sequence
from dataclasses import fields
from typing import Any, Final

import numpy as np

from mambo_nmpc.codegen import __version__
from mambo_nmpc.sil.campaign.file import Entrant, scenario
from mambo_nmpc.sil.campaign.parameters import Draw
from mambo_nmpc.sil.controllers.compiled import CompiledController
from mambo_nmpc.sil.controllers.pd import PdController
from mambo_nmpc.sil.errors import WorkerError
from mambo_nmpc.sil.faults.flights import CRASH_TILT_RAD
from mambo_nmpc.sil.flight.loop import PositionController, fly
from mambo_nmpc.sil.flight.metrics import Metrics, measure
from mambo_nmpc.sil.flight.scenario import flight_of
from mambo_nmpc.sil.flight.traces import SensedTrace, Trace
from mambo_nmpc.sil.plant.arrays import FloatArray
from mambo_nmpc.sil.plant.link import NOT_CALLED

INDICES: Final = tuple(field.name for field in fields(Metrics))
"""Of the true flight."""

SEEN: Final = "seen_"
SEEN_INDICES: Final = tuple(name for name in INDICES if "rad" not in name)
"""Also of the flight as sensors and estimators show it: those that are about the error."""

CRASHED, REFUSED, DIGEST = "crashed", "refused_updates", "trace_sha256"

Row = dict[str, float | str]
"""What became of one flight: `<controller>_<index>`."""

_BUILDING: Final = threading.Lock()
"""Threads of one worker build the C one after the other: the second finds it built."""


def columns(names: Sequence[str], *, sensed: bool) -> tuple[str, ...]:
    """Return the keys of a row, for controllers of these names."""
    seen = tuple(SEEN + name for name in SEEN_INDICES) if sensed else ()
    return tuple(f"{name}_{key}" for name in names for key in (CRASHED, REFUSED, *INDICES, *seen, DIGEST))


def fly_batch(
    version: str, entrants: Sequence[dict[str, Any]], flight: dict[str, Any], drawn: Sequence[Draw]
) -> list[Row]:
    """Fly the flights `drawn` with every controller; return a row for each, in order.

    `flight` is the section [flight], `version` that of the program that asks. Raises WorkerError if this is
    another version, BuildError if there is no compiler here.
    """
    if version != __version__:
        raise WorkerError(
            f"a worker has mambo-nmpc {__version__} and this is {version}; install the same there"
        )
    scenarios = [scenario(flight, one) for one in drawn]
    rows: list[Row] = [{} for _ in drawn]
    for document in entrants:
        entrant = Entrant.from_document(document)
        trace = fly(
            flight_of(scenarios, entrant.settings.horizon.update_period_s), _controller(entrant, len(drawn))
        )
        for key, values in _found(trace).items():
            for row, value in zip(rows, values, strict=True):
                row[f"{entrant.name}_{key}"] = value
    return rows


def _controller(entrant: Entrant, n: int) -> PositionController:
    if entrant.kind == "pd":
        return PdController()
    with _BUILDING:
        return CompiledController(entrant.settings, n)


def _found(trace: Trace) -> dict[str, list[Any]]:
    """Return what became of n flights, each value a list of n."""
    refused = (trace.status != 0) & (trace.status != NOT_CALLED)
    found: dict[str, list[Any]] = {
        CRASHED: crashed(trace).astype(int).tolist(),
        REFUSED: refused.sum(axis=0).tolist(),
    }
    views = [("", INDICES, trace)]
    if isinstance(trace, SensedTrace):
        views.append((SEEN, SEEN_INDICES, trace.as_seen()))
    for prefix, names, view in views:
        metrics = measure(view)
        found |= {prefix + name: getattr(metrics, name).tolist() for name in names}
    return found | {DIGEST: [trace.digest(flight) for flight in range(trace.flights)]}


def crashed(trace: Trace) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Tell which flights were lost, tilted too far to carry the weight, or touched the ground (n,)."""
    flown = trace.time_s >= 0.0
    angles_rad: FloatArray = trace.euler_rad[flown]
    level = np.cos(angles_rad[..., 0]) * np.cos(angles_rad[..., 1])
    aloft = (level > np.cos(CRASH_TILT_RAD)) & (trace.position_m[flown][..., 2] < 0.0)
    return np.asarray(~aloft.all(axis=0))
