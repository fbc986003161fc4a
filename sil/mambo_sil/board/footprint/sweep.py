"""Sweep horizons and iterations: footprint on a board, and tracking of the Table II case."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any, Final

from mambo_codegen.boards import Board
from mambo_codegen.settings.model import Settings
from mambo_sil.board.footprint.measure import measure_footprint
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.errors import WorkerError
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
class Grid:
    """Values to sweep: prediction horizons, control horizons, iterations."""

    prediction: tuple[int, ...]
    control: tuple[int, ...]
    iterations: tuple[int, ...]

    def points(self) -> list[tuple[int, int, int]]:
        """Return every combination whose control horizon is at most its prediction horizon."""
        return [
            (prediction, control, iterations)
            for prediction, control, iterations in product(self.prediction, self.control, self.iterations)
            if control <= prediction
        ]


@dataclass(frozen=True)
class Point:
    """One controller of the grid on the board; NaN where not measured, and then `fits` is False."""

    prediction: int
    control: int
    iterations: int
    flash_bytes: int
    ram_bytes: int
    stack_bytes: Number
    instructions: Number
    time_ms: Number
    iae_m_s: Number
    fits: bool


def measure_grid(
    settings: Settings,
    board: Board,
    grid: Grid,
    run: Run,
    progress: Callable[[int], None],
    *,
    drone: VehicleFile = NOMINAL,
) -> list[Point]:
    """Return the points of the grid in order; `run` measures them, in any order.

    Calls `progress` with the number of measured points. Raises WorkerError if a worker fails.
    """
    documents = settings.model_dump(), board.model_dump(), drone.model_dump()
    jobs = [((*documents, *point),) for point in grid.points()]
    found: dict[int, Point] = {}
    progress(0)
    try:
        for number, point in run(_measure_point, jobs):
            found[number] = point
            progress(len(found))
    except WorkerError:
        raise WorkerError("a worker process has died; nothing was written, run the command again") from None
    return [found[number] for number in sorted(found)]


def budgets(board: Board, update_period_s: float) -> dict[str, float]:
    """Return the budget of the board by field of `Point`."""
    budget = board.budget
    return {
        "flash_bytes": budget.flash_bytes,
        "ram_bytes": budget.ram_bytes,
        "time_ms": 1000.0 * update_period_s * budget.period_share,
    }


def _measure_point(job: tuple[dict[str, Any], dict[str, Any], dict[str, Any], int, int, int]) -> Point:
    """Measure one point in a worker process; `job` is plain data, since generic models do not pickle."""
    document, board_document, drone, prediction, control, iterations = job
    board = Board.model_validate(board_document)
    document["horizon"] |= {"prediction": prediction, "control": control}
    document["optimizer"] |= {"iterations": iterations}
    chosen = Settings.model_validate(document)
    footprint = measure_footprint(chosen, board, counted_ticks=COUNTED_TICKS)
    case = next(iter(CASES.values()))
    vehicle = Vehicle.of(VehicleFile.model_validate(drone))
    flight = Flight(case, vehicle=vehicle, update_period_s=chosen.horizon.update_period_s)
    metrics = measure(fly(flight, CompiledController(chosen)))
    return Point(
        prediction=prediction,
        control=control,
        iterations=iterations,
        flash_bytes=footprint.added.flash.total,
        ram_bytes=footprint.added.ram.total,
        stack_bytes=math.nan if footprint.stack is None else footprint.stack.bytes,
        instructions=math.nan if footprint.counts is None else footprint.counts.most_met,
        time_ms=math.nan if footprint.time_s is None else 1000 * footprint.time_s[1],
        iae_m_s=float(metrics.iae_m_s[0]),
        fits=footprint.fits and footprint.complete,
    )
