"""Flights with faults: Table II's figure of eight and hover, each fault with four onsets, and a verdict.

A flight has recovered when its error stays within a band until the end. The band is 1.5 times the largest
error of the fault-free flight after the transient; of a drone that is seen elsewhere by so much wider.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, Final

import numpy as np

from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.disturbances import Disturbances
from mambo_sil.drone.plant.elementary import arc_cosine, sine_cosine
from mambo_sil.drone.plant.link import NOT_CALLED
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.errors import FlightError
from mambo_sil.experiment.faults.fault import Fault
from mambo_sil.experiment.faults.injection import FaultyController, LevellingCaller
from mambo_sil.experiment.faults.scenarios import TO_THE_END, FaultScenario, scenarios
from mambo_sil.experiment.table2.table2 import CASES
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.crashes import crash_tilt_rad
from mambo_sil.flight.engine.adjusted import AdjustedController, Adjustment
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.fences import with_limits
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.metrics import TRANSIENT_S, horizontal_error_m, saturated_share
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import Hover, Trajectories, Trajectory
from mambo_sil.results.summary import Number

DURATION_S: Final = 100.0
ONSETS_S: Final = (20.0, 23.1, 26.3, 29.4)
"""Times at which a fault begins, one flight each: a quarter of the figure of eight apart."""

STRAY_M: Final = 10.0
"""Distance at which the stock code of the Mambo shuts the motors down."""

BAND_FACTOR: Final = 1.5
PATIENCE: Final = 5
"""Consecutive rejected steps after which a levelling caller commands zero tilt: 0.05 s at 100 Hz."""

TURN_RATE_RAD_S: Final = 1.0
HOVER_PUSH_M_S2: Final = (0.5, 0.3)
"""Steady disturbance acceleration on the hovering flights: without it even a dead controller would hover."""
NEVER: Final = 2**31
"""`PATIENCE` of a caller that never levels."""

STATUS_NAMES: Final = {NOT_CALLED: "not called", **{int(status): status.name for status in Status}}
"""Name of each status, in ascending order of the statuses."""


class End(StrEnum):
    """How a flight ended."""

    RECOVERED = "recovered"
    """Recovered: within the band until the end."""
    NOT_RECOVERED = "not recovered"
    """Not recovered by the end, but in the air."""
    CRASHED = "crashed"
    """Tilted beyond `crash_tilt_rad`, or on the ground."""


ORDER: Final = (End.RECOVERED, End.NOT_RECOVERED, End.CRASHED)


@dataclass(frozen=True)
class Verdict:
    """Result of a fault on one course: the worst over its onsets.

    turning:     whether the heading turned throughout the flight; such flights have a band of their own.
    statuses:    names of the statuses during the fault, in the order of their numbers.
    expected:    whether these are exactly the statuses that the fault must cause.
    largest_...: largest value since the onset; the error is the horizontal distance to the true target.
    band_m:      largest error of a flight that has recovered.
    saturated_share: share of the time since the onset with a command at the tilt limit.
    recovery_s:  time from the end of the fault (from its onset if it has no end) to recovery; NaN if never.
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
    saturated_share: Number
    recovery_s: Number
    end: End


@dataclass(frozen=True, eq=False)
class _Sortie:
    """One flight: a course, a fault and the updates at which it begins and ends, both 0 without a fault."""

    course: str
    scenario: FaultScenario
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
    *,
    drone: VehicleFile = NOMINAL,
) -> tuple[Verdict, ...]:
    """Fly every fault, or those `chosen`, on every course with every onset; return verdicts course by course.

    `controller(n)` makes n controllers of `settings`. `progress` is called with the share done. Raises
    `FlightError` if the update period cannot be simulated, or if the ranges exclude the figure of eight.
    """
    period_s = settings.horizon.update_period_s
    sorties = _sorties(scenarios(settings) if chosen is None else chosen, period_s)
    flight = _flight(sorties, period_s, drone)
    compiled = controller(len(sorties))
    adjusted = AdjustedController(compiled, len(sorties), _adjustments(sorties, settings))
    patience = np.array([PATIENCE if sortie.scenario.levelled else NEVER for sortie in sorties])
    caller = LevellingCaller(adjusted, compiled, patience)
    faults = [
        Fault(s.begin, s.end, s.scenario.alter, s.scenario.drop_every, s.scenario.late_updates)
        for s in sorties
    ]
    trace = fly(flight, FaultyController(caller, faults, compiled.instances), progress)
    healthy = [not sortie.end for sortie in sorties]
    if (trace.status[:, healthy] == Status.BAD_TARGET).any():
        raise FlightError(
            f"ranges.position_m = {settings.ranges.position_m:g}, ranges.velocity_m_s = "
            f"{settings.ranges.velocity_m_s:g}: must include the figure of eight of Table II, 2 m and 1 m/s"
        )
    limits_rad = method_of(settings).tilt_limit_rad, crash_tilt_rad(drone)
    return _judge_faults(trace, sorties, adjusted.answers, *limits_rad)


def _flight(sorties: Sequence[_Sortie], period_s: float, drone: VehicleFile) -> Flight:
    hovering = np.array([sortie.course == HOVER for sortie in sorties], np.float64)
    below_m = np.array([sortie.scenario.below_m for sortie in sorties])
    try:
        return Flight(
            Trajectories(tuple(COURSES[sortie.course] for sortie in sorties)),
            duration_s=DURATION_S,
            flights=len(sorties),
            yaw_rate_rad_s=TURN_RATE_RAD_S * np.array([sortie.scenario.turning for sortie in sorties]),
            vehicle=replace(Vehicle.of(drone), lever_error_m=(0.0, 0.0, below_m)),
            update_period_s=period_s,
            disturbances=Disturbances(
                push_m_s2=(HOVER_PUSH_M_S2[0] * hovering, HOVER_PUSH_M_S2[1] * hovering)
            ),
        )
    except FlightError as error:
        raise FlightError(f"horizon.{error}") from error


def _sorties(chosen: Sequence[FaultScenario], period_s: float) -> list[_Sortie]:
    healthy = [FaultScenario("none", 0.0, turning=turning) for turning in (False, True)]
    sorties = [_Sortie(course, scenario) for course in COURSES for scenario in healthy]
    last = round(DURATION_S / period_s) + 1
    for course in COURSES:
        for scenario in chosen:
            for onset_s in ONSETS_S:
                begin = round(onset_s / period_s)
                end = last
                if scenario.duration_s != TO_THE_END:
                    end = min(last, begin + max(1, round(scenario.duration_s / period_s)))
                sorties.append(_Sortie(course, scenario, begin, end))
    return sorties


def _adjustments(sorties: Sequence[_Sortie], settings: Settings) -> list[Adjustment]:
    right = (settings.cost.tracking_weight, settings.cost.effort_weight)
    found = []
    for row, sortie in enumerate(sorties):
        if sortie.scenario.weights is not None:
            found.append(Adjustment(row, sortie.begin, "set_weights", sortie.scenario.weights))
            found.append(Adjustment(row, sortie.end, "set_weights", right))
        if sortie.scenario.limits is not None:
            found.append(Adjustment(row, sortie.begin, "set_limits", sortie.scenario.limits))
            found.append(Adjustment(row, sortie.end, "set_limits", with_limits(settings)))
    return found


def _judge_faults(
    trace: Trace,
    sorties: Sequence[_Sortie],
    answers: Sequence[tuple[int, int]],
    limit_rad: float,
    crash_rad: float,
) -> tuple[Verdict, ...]:
    """Return the verdict of every fault on every course; a drone crashes at the tilt `crash_rad`."""
    target = trace.target.copy()
    for row, sortie in enumerate(sorties):
        target[sortie.begin :, row, 0] += sortie.scenario.moved_m
    error_m = horizontal_error_m(replace(trace, target=target))
    settled = trace.time_s >= TRANSIENT_S
    bands_m: dict[tuple[str, bool], float] = {}
    flown: dict[tuple[str, str], list[Verdict]] = {}
    for row, sortie in enumerate(sorties):  # the flights without a fault come first
        kind = sortie.course, sortie.scenario.turning
        if not sortie.end:
            bands_m[kind] = BAND_FACTOR * float(error_m[settled, row].max())
            continue
        refused = {status for answered, status in answers if answered == row and status != Status.OK}
        share = float(saturated_share(trace.command_rad[sortie.begin :, [row]], limit_rad)[0])
        flown.setdefault((sortie.course, sortie.scenario.name), []).append(
            _judge_flight(
                trace,
                row,
                sortie,
                error_m=error_m[:, row],
                band_m=bands_m[kind] + abs(sortie.scenario.below_m),
                refused=refused,
                saturated=share,
                crash_rad=crash_rad,
            )
        )
    return tuple(_worst(verdicts) for verdicts in flown.values())


def _judge_flight(
    trace: Trace,
    row: int,
    sortie: _Sortie,
    *,
    error_m: FloatArray,
    band_m: float,
    refused: set[int],
    saturated: float,
    crash_rad: float,
) -> Verdict:
    """Judge flight `row`; `refused`: statuses of rejected weights and limits; `saturated`: a share."""
    scenario = sortie.scenario
    flown = slice(sortie.begin, None)
    seen = refused | set(trace.status[sortie.begin : sortie.end, row].tolist())
    outside = np.flatnonzero(~(error_m[flown] <= band_m))
    back = not len(outside) or outside[-1] < len(error_m[flown]) - 1
    lasts = 0 if scenario.duration_s == TO_THE_END else sortie.end - sortie.begin
    late = int(outside[-1]) + 1 - lasts if len(outside) else 0
    _, (cos_roll, cos_pitch) = sine_cosine(trace.euler_rad[flown, row, :2].T)
    tilt_rad = arc_cosine(cos_roll * cos_pitch)
    crashed = not (tilt_rad.max() < crash_rad and trace.position_m[flown, row, 2].max() < 0.0)
    return Verdict(
        course=sortie.course,
        fault=scenario.name,
        turning=scenario.turning,
        statuses=tuple(STATUS_NAMES[status] for status in sorted(seen)),
        expected=scenario.answers is None or seen == scenario.answers,
        largest_command_rad=float(np.abs(trace.command_rad[flown, row]).max()),
        largest_tilt_rad=float(tilt_rad.max()),
        largest_error_m=float(error_m[flown].max()),
        band_m=band_m,
        saturated_share=saturated,
        recovery_s=max(0, late) * float(trace.time_s[1] - trace.time_s[0]) if back else math.nan,
        end=End.CRASHED if crashed else End.RECOVERED if back else End.NOT_RECOVERED,
    )


def _worst(verdicts: Sequence[Verdict]) -> Verdict:
    """Return the worst value of every field."""
    names = ("largest_command_rad", "largest_tilt_rad", "largest_error_m", "saturated_share", "recovery_s")
    largest: Any = {name: float(np.max([getattr(verdict, name) for verdict in verdicts])) for name in names}
    return replace(
        verdicts[0],
        statuses=all_statuses(verdicts),
        expected=all(verdict.expected for verdict in verdicts),
        end=max((verdict.end for verdict in verdicts), key=ORDER.index),
        **largest,
    )


def all_statuses(verdicts: Sequence[Verdict]) -> tuple[str, ...]:
    """Return the names of all statuses in the verdicts, in the order of their numbers."""
    seen = {status for verdict in verdicts for status in verdict.statuses}
    return tuple(name for name in STATUS_NAMES.values() if name in seen)
