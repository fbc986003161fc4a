"""Vary one or two settings: footprint on a board, tracking of the Table II case, margins."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, Final

from mambo_codegen.boards import Board
from mambo_codegen.errors import InvalidSettingsError
from mambo_codegen.settings.controller_toml import validate, with_value
from mambo_codegen.settings.model import Settings
from mambo_sil.board.footprint.measure import measure_footprint
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.errors import FlightError, WorkerError
from mambo_sil.experiment.margins.margin_reserve import MarginReference, Reserve, reserve
from mambo_sil.experiment.table2.table2 import CASES
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.metrics import measure
from mambo_sil.results.summary import Number

COUNTED_TICKS: Final = 60

Run = Callable[[Callable[..., Any], Iterable[tuple[Any, ...]]], Iterator[tuple[int, Any]]]
"""Calls a function with the arguments of each task, elsewhere; yields number and result as they come."""


@dataclass(frozen=True)
class Axis:
    """A key of the settings, such as cost.effort_weight, and the values that it takes."""

    key: str
    values: tuple[Number, ...]


@dataclass(frozen=True)
class Point:
    """One controller on the board; NaN where not measured, and then `fits` is False."""

    values: dict[str, Number]
    """The varied keys."""
    flash_bytes: Number = math.nan
    ram_bytes: Number = math.nan
    stack_bytes: Number = math.nan
    instructions: Number = math.nan
    time_ms: Number = math.nan
    iae_m_s: Number = math.nan
    fits: bool = False
    refusal: str | None = None
    """Why these settings are no controller, or cannot fly."""
    gain_margin: Number = math.nan
    delay_margin_s: Number = math.nan
    """The least of all loops at hover, and at the commands."""
    margin_share: Number = math.nan
    """The least share that a margin of a loop is of the reference's."""

    @property
    def reserve(self) -> Reserve:
        """What is left of the margins of the reference."""
        return Reserve(self.gain_margin, self.delay_margin_s, self.margin_share)


def grid(axes: Sequence[Axis]) -> list[dict[str, Number]]:
    """Return every combination of the values, the last key's varying fastest."""
    keys = [axis.key for axis in axes]
    return [dict(zip(keys, values, strict=True)) for values in product(*(axis.values for axis in axes))]


def measure_grid(
    settings: Settings,
    board: Board,
    axes: Sequence[Axis],
    run: Run,
    progress: Callable[[int], None],
    *,
    reference: MarginReference,
    drone: VehicleFile = NOMINAL,
) -> list[Point]:
    """Return the points of `grid` in order; `run` measures them, in any order.

    Calls `progress` with the number of measured points. Raises WorkerError if a worker fails.
    """
    documents = settings.model_dump(), board.model_dump(), drone.model_dump(), reference
    jobs = [(*documents, values) for values in grid(axes)]
    found: dict[int, Point] = {}
    progress(0)
    try:
        for number, point in run(_measure_point, jobs):
            found[number] = point
            progress(len(found))
    except WorkerError:
        raise WorkerError("a worker process has died; nothing was written, run the command again") from None
    return [found[number] for number in sorted(found)]


def budgets(board: Board, settings: Settings, axes: Sequence[Axis]) -> dict[str, float]:
    """Return the budget of the board by field of `Point`, if all points have the same."""
    budget = board.budget
    found: dict[str, float] = {"flash_bytes": budget.flash_bytes, "ram_bytes": budget.ram_bytes}
    if all(axis.key != "horizon.update_period_s" for axis in axes):
        found["time_ms"] = 1000.0 * settings.horizon.update_period_s * budget.period_share
    return found


def _measure_point(
    document: dict[str, Any],
    board: dict[str, Any],
    drone: dict[str, Any],
    reference: MarginReference,
    values: Mapping[str, Number],
) -> Point:
    """Measure one point in a worker process; the arguments are plain data: generic models do not pickle."""
    for key, value in values.items():
        document = with_value(document, key, value)
    try:
        chosen = validate(document, "")
        flown = VehicleFile.model_validate(drone)
        vehicle = Vehicle.of(flown)
        case = next(iter(CASES.values()))
        flight = Flight(case, vehicle=vehicle, update_period_s=chosen.horizon.update_period_s)
        controller = CompiledController(chosen)
    except InvalidSettingsError as error:
        return Point(dict(values), refusal="; ".join(fault.removeprefix(": ") for fault in error.faults))
    except FlightError as error:
        return Point(dict(values), refusal=f"horizon.{error}")
    footprint = measure_footprint(chosen, Board.model_validate(board), counted_ticks=COUNTED_TICKS)
    metrics = measure(fly(flight, controller))
    margins = reserve(chosen, flown, reference)
    return Point(
        dict(values),
        flash_bytes=footprint.added.flash.total,
        ram_bytes=footprint.added.ram.total,
        stack_bytes=math.nan if footprint.stack is None else footprint.stack.bytes,
        instructions=math.nan if footprint.counts is None else footprint.counts.most_met,
        time_ms=math.nan if footprint.time_s is None else 1000 * footprint.time_s[1],
        iae_m_s=float(metrics.iae_m_s[0]),
        fits=footprint.fits and footprint.complete,
        gain_margin=margins.gain,
        delay_margin_s=margins.delay_s,
        margin_share=margins.share,
    )
