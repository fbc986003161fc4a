"""Measure the margins of a controller on one drone, on many besides, and write the results."""

import contextlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.first_order import FirstOrderDrone
from mambo_sil.drone.plant.vehicle import LEVER_ERRORS_M
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import PlacedSensors
from mambo_sil.experiment.margins.axis_margins import Margins, measure_loops
from mambo_sil.experiment.margins.controller_jacobian import has_linear_law
from mambo_sil.experiment.margins.hover_loop import hover_loops
from mambo_sil.experiment.margins.many_drones import (
    FREQUENCIES,
    MeasuredDrone,
    hovering_flight,
    summarise_drones,
    write_drones,
)
from mambo_sil.experiment.margins.margins_record import (
    DRONES,
    PICTURES,
    RESPONSES,
    LeverMargins,
    MarginsSummary,
)
from mambo_sil.experiment.margins.response_file import responses, write_responses
from mambo_sil.flight.names import SensorsName, kind_of
from mambo_sil.results.folders import new_results

NOT_SMOOTH: Final = (
    "the law of a 1-norm follows the signs of slopes: its command is no smooth function of the state. "
    "No linear margin describes it, and a describing function would hold for one amplitude and one kind of "
    "motion only, so none is given"
)
"""Why a controller without a linear law has no margins."""


@dataclass(frozen=True)
class MarginSubject:
    """A controller, the name of its source, and the drone that it flies."""

    source: str
    settings: Settings
    drone: VehicleFile
    sensors: SensorsName = "true"


@dataclass(frozen=True)
class Many:
    """Many drones to measure, and where they come from, in words."""

    origin: str
    measure: Callable[[], Iterable[MeasuredDrone]]


def axes_on(subject: MarginSubject) -> list[Margins] | None:
    """Return the margins of all axes; None if no linear margin applies.

    Raises FlightError, and the errors of building the C.
    """
    period_s = subject.settings.horizon.update_period_s
    flight = hovering_flight(subject.drone, subject.sensors, period_s)
    if not has_linear_law(subject.settings):
        return None
    (loops,) = hover_loops(subject.settings, flight)
    return list(measure_loops(loops, flight))


def beside(subject: MarginSubject) -> list[LeverMargins]:
    """Return what is left of the margins on a drone that is seen below or above the place told."""
    found = []
    for below_m in LEVER_ERRORS_M:
        flight = hovering_flight(subject.drone, subject.sensors, subject.settings.horizon.update_period_s)
        seen = replace(flight.vehicle, lever_error_m=(0.0, 0.0, below_m))
        (loops,) = hover_loops(subject.settings, replace(flight, vehicle=seen))
        axes = measure_loops(loops, flight, count=FREQUENCIES)
        found.append(LeverMargins.of(below_m, axes))
    return found


def measure(subject: MarginSubject, many: Many | None, folder: Path | None) -> MarginsSummary:
    """Return the margins of a controller; write them and their pictures to `folder`.

    Raises as `axes_on`, and the errors of writing.
    """
    period_s = subject.settings.horizon.update_period_s
    measures = subject.drone.with_sensors(kind_of(subject.sensors)).sensors
    summary = MarginsSummary(
        source=subject.source,
        settings=subject.settings.digest,
        vehicle=subject.drone.name,
        sensors=subject.sensors,
        update_period_s=period_s,
        reason=NOT_SMOOTH,
    )
    flight = hovering_flight(subject.drone, subject.sensors, period_s)
    with contextlib.ExitStack() as stack:
        place = folder and stack.enter_context(
            new_results(folder, MarginsSummary.command, (*PICTURES, RESPONSES, DRONES))
        )
        if has_linear_law(subject.settings):
            (loops,) = hover_loops(subject.settings, flight)
            found: Sequence[MeasuredDrone] = list(many.measure()) if many else []
            summary = summary.model_copy(
                update={
                    "axes": list(measure_loops(loops, flight)),
                    "reason": None,
                    "levers": beside(subject) if isinstance(measures, PlacedSensors) else [],
                    "many": summarise_drones(found, many.origin) if many else None,
                }
            )
            if place is not None:
                from mambo_sil.experiment.margins.margins_plots import draw_margins  # noqa: PLC0415 - slow

                motors = not isinstance(flight.vehicle.loop, FirstOrderDrone)
                curves = responses(loops, period_s, motors=motors)
                write_responses(curves, place / RESPONSES)
                draw_margins(curves, summary.headline, place)
                if found:
                    write_drones(found, place / DRONES)
        if place is not None:
            summary.write(place)
    return summary
