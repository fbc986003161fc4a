"""Flights with faults: the figure of eight of Table II and hover, every fault at four moments, and a verdict.

Fault-free flights beside them say how close a healthy controller stays: their largest error after the
transient, and a half more, is the band into which a flight must come back for good.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

import numpy as np

from mambo_nmpc.codegen.reference import Status
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.controllers.compiled import CompiledController
from mambo_nmpc.sil.errors import FlightError
from mambo_nmpc.sil.faults.injection import (
    Fault,
    FaultyController,
    LevellingCaller,
    ReweightedController,
    WeightChange,
)
from mambo_nmpc.sil.faults.scenarios import TO_THE_END, FaultScenario, scenarios
from mambo_nmpc.sil.files.summary import Number, Summary
from mambo_nmpc.sil.flight.loop import Flight, fly
from mambo_nmpc.sil.flight.metrics import TRANSIENT_S, horizontal_error_m
from mambo_nmpc.sil.flight.traces import Trace
from mambo_nmpc.sil.flight.trajectories import Hover, Trajectories, Trajectory
from mambo_nmpc.sil.paper.table2 import CASES
from mambo_nmpc.sil.plant.arrays import FloatArray
from mambo_nmpc.sil.plant.link import NOT_CALLED
from mambo_nmpc.sil.plant.loops import THRUST_LIMIT_N, WEIGHT_N
from mambo_nmpc.sil.plant.vehicle import Vehicle

DURATION_S: Final = 100.0
ONSETS_S: Final = (20.0, 23.1, 26.3, 29.4)
"""When the fault begins, in flights of their own: a quarter of the figure of eight apart."""

CRASH_TILT_RAD: Final = math.acos(WEIGHT_N / THRUST_LIMIT_N)
"""Tilt at which the most thrust that the altitude loop asks for no longer carries the weight: 59 degrees."""

STRAY_M: Final = 10.0
"""Distance at which the stock code of the Mambo shuts the motors down."""

BAND_FACTOR: Final = 1.5
PATIENCE: Final = 5
"""Refused steps in a row at which a levelling caller levels out: 0.05 s at 100 Hz."""

TURN_RATE_RAD_S: Final = 1.0
HOVER_WIND_M_S2: Final = (0.5, 0.3)
"""Push on the hovering flights: in still air they would hold their place whatever the controller does."""
NEVER: Final = 2**31
"""The patience of a caller who never levels out."""


STATUS_NAMES: Final = {NOT_CALLED: "not called", **{int(status): status.name for status in Status}}
"""What a step came to, by status, in ascending order."""


class End(StrEnum):
    """How a flight ended."""

    BACK = "back"
    """Within the band for good."""
    AWAY = "away"
    """In the air, and not back within the band by the end."""
    CRASHED = "crashed"
    """Tilted beyond CRASH_TILT_RAD, or on the ground."""


ORDER: Final = (End.BACK, End.AWAY, End.CRASHED)


@dataclass(frozen=True)
class Verdict:
    """What became of a scenario: the worst over its moments.

    turning:     whether the drone turned throughout: then it has a band of its own.
    statuses:    names of those seen while it lasted, in the order of their numbers.
    expected:    whether these are the statuses that the scenario demands.
    largest_...: from its begin on; the error is the distance to the true target.
    band_m:      how close to its target a flight must be to be back.
    recovery_s:  from its end (from its begin if it has none) until the flight is back for good; NaN if never.
    """

    course: str
    fault: str
    turning: bool
    statuses: tuple[str, ...]
    expected: bool
    largest_command_rad: Number
    largest_tilt_rad: Number
    largest_error_m: Number
    band_m: Number
    recovery_s: Number
    end: End


class FaultsSummary(Summary):
    """Flights with faults."""

    command = "faults"

    source: str
    settings: str
    flights: list[Verdict]


@dataclass(frozen=True, eq=False)
class _Sortie:
    """One flight: a scenario at one moment; None flies without fault."""

    course: str
    turning: bool
    scenario: FaultScenario | None
    begin: int = 0
    end: int = 0


EIGHT: Final = "eight"
HOVER: Final = "hover"
COURSES: Final[dict[str, Trajectory]] = {EIGHT: next(iter(CASES.values())), HOVER: Hover()}


def fly_faults(
    settings: Settings,
    controller: Callable[[int], CompiledController],
    progress: Callable[[float], None] | None = None,
    chosen: Sequence[FaultScenario] | None = None,
) -> tuple[Verdict, ...]:
    """Fly every scenario, or those `chosen`, on every course at every moment; course by course, in order.

    `controller` makes n controllers of `settings`. Raises FlightError for settings that cannot be flown.
    """
    period_s = settings.horizon.update_period_s
    sorties = _sorties(scenarios(settings) if chosen is None else chosen, period_s)
    flight = _flight(sorties, period_s)
    compiled = controller(len(sorties))
    reweighted = ReweightedController(compiled, len(sorties), _weight_changes(sorties, settings))
    patience = np.array([PATIENCE if _levelled(sortie) else NEVER for sortie in sorties])
    caller = LevellingCaller(reweighted, compiled.reset, patience)
    trace = fly(flight, FaultyController(caller, [_fault(sortie) for sortie in sorties]), progress)
    healthy = [sortie.scenario is None for sortie in sorties]
    if (trace.status[:, healthy] == Status.BAD_TARGET).any():
        raise FlightError(
            f"ranges.position_m = {settings.ranges.position_m:g}, ranges.velocity_m_s = "
            f"{settings.ranges.velocity_m_s:g}: the figure of eight of Table II lies beyond, to 2 m and 1 m/s"
        )
    return _judged(trace, sorties, reweighted.answers)


def _flight(sorties: Sequence[_Sortie], period_s: float) -> Flight:
    hovering = np.array([sortie.course == HOVER for sortie in sorties], np.float64)
    try:
        return Flight(
            Trajectories(tuple(COURSES[sortie.course] for sortie in sorties)),
            duration_s=DURATION_S,
            flights=len(sorties),
            yaw_rate_rad_s=TURN_RATE_RAD_S * np.array([sortie.turning for sortie in sorties]),
            vehicle=Vehicle(wind_m_s2=(HOVER_WIND_M_S2[0] * hovering, HOVER_WIND_M_S2[1] * hovering)),
            update_period_s=period_s,
        )
    except FlightError as error:
        raise FlightError(f"horizon.{error}") from error


def _sorties(chosen: Sequence[FaultScenario], period_s: float) -> list[_Sortie]:
    sorties = [_Sortie(course, turning, None) for course in COURSES for turning in (False, True)]
    last = round(DURATION_S / period_s) + 1
    for course in COURSES:
        for scenario in chosen:
            for onset_s in ONSETS_S:
                begin = round(onset_s / period_s)
                lasts = (
                    math.inf if scenario.duration_s == TO_THE_END else round(scenario.duration_s / period_s)
                )
                end = int(min(last, begin + max(1, lasts)))
                sorties.append(_Sortie(course, scenario.turning, scenario, begin, end))
    return sorties


def _weight_changes(sorties: Sequence[_Sortie], settings: Settings) -> list[WeightChange]:
    right = (settings.cost.tracking_weight, settings.cost.effort_weight)
    changes = []
    for row, sortie in enumerate(sorties):
        if sortie.scenario is not None and sortie.scenario.weights is not None:
            changes.append(WeightChange(row, sortie.begin, sortie.scenario.weights))
            changes.append(WeightChange(row, sortie.end, right))
    return changes


def _levelled(sortie: _Sortie) -> bool:
    return sortie.scenario is not None and sortie.scenario.levelled


def _fault(sortie: _Sortie) -> Fault | None:
    scenario = sortie.scenario
    if scenario is None:
        return None
    return Fault(sortie.begin, sortie.end, scenario.alter, scenario.drop, scenario.late_updates)


def _judged(
    trace: Trace, sorties: Sequence[_Sortie], answers: Sequence[tuple[int, int]]
) -> tuple[Verdict, ...]:
    """Judge every scenario by the worst of its moments."""
    error_m = horizontal_error_m(_with_moved_targets(trace, sorties))
    settled = trace.time_s >= TRANSIENT_S
    bands_m = {
        (sortie.course, sortie.turning): BAND_FACTOR * float(error_m[settled, row].max())
        for row, sortie in enumerate(sorties)
        if sortie.scenario is None
    }
    flown: dict[tuple[str, str], list[int]] = {}
    for row, sortie in enumerate(sorties):
        if sortie.scenario is not None:
            flown.setdefault((sortie.course, sortie.scenario.name), []).append(row)
    verdicts = []
    for rows in flown.values():
        each = []
        for row in rows:
            sortie = sorties[row]
            refused = {status for answered, status in answers if answered == row and status != Status.OK}
            band_m = bands_m[sortie.course, sortie.turning]
            each.append(_verdict(trace, row, sortie, error_m=error_m[:, row], band_m=band_m, refused=refused))
        verdicts.append(_worst(each))
    return tuple(verdicts)


def _with_moved_targets(trace: Trace, sorties: Sequence[_Sortie]) -> Trace:
    target = trace.target.copy()
    for row, sortie in enumerate(sorties):
        if sortie.scenario is not None:
            target[sortie.begin :, row, 0] += sortie.scenario.moved_m
    return replace(trace, target=target)


def _verdict(
    trace: Trace, row: int, sortie: _Sortie, *, error_m: FloatArray, band_m: float, refused: set[int]
) -> Verdict:
    """Judge flight `row`; `refused` are the statuses with which new weights were refused."""
    scenario = sortie.scenario
    assert scenario is not None  # whoever flies without fault is not judged
    flown = slice(sortie.begin, None)
    seen = refused | set(trace.status[sortie.begin : sortie.end, row].tolist())
    outside = np.flatnonzero(~(error_m[flown] <= band_m))
    back = not len(outside) or outside[-1] < len(error_m[flown]) - 1
    lasts = 0 if scenario.duration_s == TO_THE_END else sortie.end - sortie.begin
    late = int(outside[-1]) + 1 - lasts if len(outside) else 0
    angles_rad = trace.euler_rad[flown, row]
    tilt_rad = np.arccos(np.cos(angles_rad[:, 0]) * np.cos(angles_rad[:, 1]))
    crashed = not (tilt_rad.max() < CRASH_TILT_RAD and trace.position_m[flown, row, 2].max() < 0.0)
    return Verdict(
        course=sortie.course,
        fault=scenario.name,
        turning=sortie.turning,
        statuses=tuple(STATUS_NAMES[status] for status in sorted(seen)),
        expected=scenario.answers is None or seen == scenario.answers,
        largest_command_rad=float(np.abs(trace.command_rad[flown, row]).max()),
        largest_tilt_rad=float(tilt_rad.max()),
        largest_error_m=float(error_m[flown].max()),
        band_m=band_m,
        recovery_s=max(0, late) * float(trace.time_s[1] - trace.time_s[0]) if back else math.nan,
        end=End.CRASHED if crashed else End.BACK if back else End.AWAY,
    )


def _worst(verdicts: Sequence[Verdict]) -> Verdict:
    """Return the worst in every respect."""
    return replace(
        verdicts[0],
        statuses=all_statuses(verdicts),
        expected=all(verdict.expected for verdict in verdicts),
        largest_command_rad=_largest(verdicts, "largest_command_rad"),
        largest_tilt_rad=_largest(verdicts, "largest_tilt_rad"),
        largest_error_m=_largest(verdicts, "largest_error_m"),
        recovery_s=_largest(verdicts, "recovery_s"),
        end=max((verdict.end for verdict in verdicts), key=ORDER.index),
    )


def all_statuses(verdicts: Sequence[Verdict]) -> tuple[str, ...]:
    """Return the names of all statuses seen, in the order of their numbers."""
    seen = {status for verdict in verdicts for status in verdict.statuses}
    return tuple(name for name in STATUS_NAMES.values() if name in seen)


def _largest(verdicts: Sequence[Verdict], name: str) -> float:
    return float(np.max([getattr(verdict, name) for verdict in verdicts]))
