"""Plans for programs: from points to a course that a drone flies."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mambo_extensions.plan import LEAST_RATE, MOST_DRONES
from mambo_extensions.plan.plan_plots import draw_plan
from mambo_extensions.plan.plan_report import PlanSummary, csv_text, summary_of
from mambo_extensions.plan.planning import Planned, Progress, make_plan
from mambo_extensions.plan.points import PlanPoint, check_points, read_points
from mambo_extensions.plan.solver import silent
from mambo_sil.api.api_controller import Controller
from mambo_sil.arguments import as_numbers, is_whole, require, require_kind, require_number
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.errors import ArgumentError
from mambo_sil.flight.polynomials import PiecesInSpace
from mambo_sil.results.terminal import result_text


@dataclass(frozen=True, eq=False, repr=False)
class Plan:
    """A course through points, and how drones have flown it; `print` shows that.

    curve:   polynomial pieces, without headings, and the points at their ends; `fly` and adapters fly them.
    summary: time, distances, limits and flights.
    """

    curve: PiecesInSpace
    summary: PlanSummary
    _planned: Planned

    def __repr__(self) -> str:
        """Return what the command prints."""
        return result_text(self.summary.result())

    @property
    def text(self) -> str:
        """The CSV file of the pieces."""
        return csv_text(self._planned)

    def draw(self, stem: Path) -> tuple[Path, Path]:
        """Draw path, height and shares of the limits; writes stem.png and stem.svg."""
        return draw_plan(self._planned, self.summary.title, stem)


def plan(
    points: str | Path | Sequence[PlanPoint | tuple[float, float, float]] | FloatArray,
    vehicle: Vehicle,
    controller: Controller | None = None,
    *,
    closed: bool = False,
    rate: float = 1.0,
    drones: int = 20,
    seed: int = 0,
    progress: Progress = silent,
) -> Plan:
    """Plan the quickest course through points that a drone and others like it fly, and fly it with them.

    points:     a CSV file or a mission of QGroundControl, or points or an array (n, 3) in m, x ahead, y to
                the left, z up. If they have times, the course of least snap at these times.
    controller: its settings fly; None for those that `design` derives.
    closed:     return to the first point, in a lap that repeats.
    rate:       speed over that of the quickest plan, at most 1.
    drones:     how many are drawn as by `draw_vehicles` with `seed`.
    progress:   called with what is being done, and the share that is done.

    Raises ArgumentError, TrajectoryError for points that cannot be planned, PlanError if no plan keeps the
    limits or is flown, BuildError, CacheError.
    """
    require_kind("vehicle", vehicle, Vehicle, "a Vehicle")
    require_kind("controller", controller, (Controller, type(None)), "a Controller")
    require_number("rate", rate, LEAST_RATE, 1.0)
    require(is_whole(drones, 1, MOST_DRONES), "drones", drones, f"be a whole number in 1..{MOST_DRONES}")
    planned = make_plan(
        _points(points, closed=closed),
        vehicle,
        None if controller is None else controller.settings,
        closed=closed,
        rate=rate,
        drones=drones,
        seed=seed,
        progress=progress,
    )
    return Plan(planned.curve, summary_of(planned, vehicle.drone), planned)


def _points(points: object, *, closed: bool) -> tuple[PlanPoint, ...]:
    if isinstance(points, str | Path):
        return read_points(Path(points), closed=closed)
    if not isinstance(points, Sequence) and not (isinstance(points, np.ndarray) and points.ndim):
        raise ArgumentError(f"points: {type(points).__name__} must be a file, or a sequence of points")
    found = []
    for number, point in enumerate(points, start=1):
        if isinstance(point, PlanPoint):
            found.append(point)
            continue
        name = f"point {number}"
        place = as_numbers(name, point)
        require(place.shape == (3,), name, point, "be a PlanPoint, or x, y and z in m")
        found.append(PlanPoint(*place.tolist()))
    check_points(found, closed=closed)
    return tuple(found)
