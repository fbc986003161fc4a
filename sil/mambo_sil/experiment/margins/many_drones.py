"""The margins of a controller on many drones, of a campaign or of the intervals of a log."""

import csv
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.campaign.campaign_file import Campaign, scenario
from mambo_sil.experiment.margins.axis_margins import HeightMargins, Margins, PlaceName, measure_loops
from mambo_sil.experiment.margins.corners import at_ends, corners, in_words, uncertain
from mambo_sil.experiment.margins.hover_loop import hover_loops
from mambo_sil.experiment.margins.margins_record import ManyDrones, MarginSpread
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.names import SensorsName
from mambo_sil.flight.scenario import choose_sensors, flight_of
from mambo_sil.flight.trajectories import Hover

FREQUENCIES: Final = 150
_BATCH: Final = 10
_LARGER_IS_WORSE: Final = ("largest sensitivity",)

Axes = tuple[Margins, ...]


@dataclass(frozen=True)
class MeasuredDrone:
    """The margins of one of many drones, and what distinguishes it."""

    values: dict[str, float | str]
    axes: Axes


def hovering_flight(drone: VehicleFile, sensors: SensorsName, update_period_s: float) -> Flight:
    """Return a flight in which a drone hovers; raises FlightError if it has not these sensors."""
    return Flight(
        Hover(),
        vehicle=Vehicle.of(drone),
        update_period_s=update_period_s,
        sensors=choose_sensors(sensors, drone),
    )


def campaign_drones(
    settings: Settings,
    campaign: Campaign,
    drones: int,
    progress: Callable[[int], None] = lambda _: None,
) -> Iterator[MeasuredDrone]:
    """Yield the first drones that a campaign draws; call `progress` with how many are done.

    What moves a drone, such as wind, has no part in its margins; neither have dropped updates and biases.
    """
    for first in range(0, drones, _BATCH):
        drawn = [campaign.draw(number) for number in range(first, min(first + _BATCH, drones))]
        scenarios = [scenario(campaign.flight, one) for one in drawn]
        flight = flight_of(scenarios, settings.horizon.update_period_s)
        for values, loops in zip(drawn, hover_loops(settings, flight), strict=True):
            yield MeasuredDrone(_of_a_drone(values), measure_loops(loops, flight, count=FREQUENCIES))
        progress(first + len(drawn))


def _of_a_drone(drawn: dict[str, Any]) -> dict[str, float | str]:
    """Return the draws that margins depend on."""
    names = ("mass_kg", "inertia_scale_x", "inertia_scale_y", "thrust_scale", "motor_lag_s", "drag_1_s")
    return {name: drawn[name] for name in (*names, "command_delay_ticks", "noise_scale")}


def corner_drones(settings: Settings, drone: VehicleFile, sensors: SensorsName) -> Iterator[MeasuredDrone]:
    """Yield a drone at every corner of the intervals in its section [uncertainty].

    Raises InvalidSettingsError for a drone without that section.
    """
    drone = uncertain(drone, height=settings.height is not None)
    for ends in corners(drone):
        measured = measure_drone(settings, at_ends(drone, ends), sensors)
        yield MeasuredDrone(in_words(ends), measured)


def measure_drone(settings: Settings, drone: VehicleFile, sensors: SensorsName) -> Axes:
    """Return the margins of all axes of a controller, whose law is linear, on one drone."""
    flight = hovering_flight(drone, sensors, settings.horizon.update_period_s)
    (loops,) = hover_loops(settings, flight)
    return measure_loops(loops, flight, count=FREQUENCIES)


def summarise_drones(drones: Sequence[MeasuredDrone], origin: str) -> ManyDrones:
    """Return worst and median of every margin of many drones."""
    found = []
    for axis, name in enumerate(one.axis for one in drones[0].axes):
        for figure, place, value_of in _FIGURES:
            values = np.array([_value(drone.axes[axis], figure, place, value_of) for drone in drones])
            if np.isnan(values).all():
                continue
            worst = int(np.nanargmax(values) if figure in _LARGER_IS_WORSE else np.nanargmin(values))
            found.append(
                MarginSpread(
                    axis=name,
                    place=place,
                    figure=figure,
                    worst=values[worst],
                    median=float(np.nanmedian(values)),
                    drone=worst,
                )
            )
    worst = int(np.argmax([max(map(_sensitivity, drone.axes)) for drone in drones]))
    return ManyDrones(
        origin=origin,
        drones=len(drones),
        unstable=sum(not all(axis.stable for axis in drone.axes) for drone in drones),
        spreads=found,
        worst_drone=worst,
        worst_values=drones[worst].values,
    )


_FIGURES: Final[tuple[tuple[str, PlaceName | None, str], ...]] = (
    *(
        (figure, place, key)
        for place in ("command", "motors")
        for figure, key in (
            ("gain margin", "gain_up"),
            ("phase margin", "phase_deg"),
            ("delay margin", "delay_s"),
            ("largest sensitivity", "sensitivity"),
        )
    ),
    ("least damping", None, "least_damping"),
)


def _value(axis: Margins, figure: str, place: PlaceName | None, key: str) -> float:
    """Return a figure of an axis; NaN if its drone has no such place, the worst value if it is unstable."""
    if place is None:
        return float(getattr(axis.poles, key))
    if place == "motors" and isinstance(axis, HeightMargins):
        return math.nan
    if not axis.stable:
        return math.inf if figure in _LARGER_IS_WORSE else 0.0
    loop = axis.loops.get(place)
    return math.nan if loop is None else float(getattr(loop, key))


def _sensitivity(axis: Margins) -> float:
    """Return the largest sensitivity of an axis, wherever its loop is broken; infinity if it is unstable."""
    return max((loop.sensitivity for loop in axis.loops.values()), default=math.inf)


def write_drones(drones: Sequence[MeasuredDrone], path: Path) -> None:
    """Write a CSV file with one row for each drone: what distinguishes it, and its margins."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        names = [axis.axis for axis in drones[0].axes]
        keys = [f"{axis}_{place or 'pole'}_{key}" for axis in names for _, place, key in _FIGURES]
        writer.writerow(["drone", *drones[0].values, *(f"{axis}_stable" for axis in names), *keys])
        for number, drone in enumerate(drones):
            stable = [int(axis.stable) for axis in drone.axes]
            values = [
                _value(axis, figure, place, key) for axis in drone.axes for figure, place, key in _FIGURES
            ]
            writer.writerow([number, *drone.values.values(), *stable, *(f"{value:.6g}" for value in values)])
