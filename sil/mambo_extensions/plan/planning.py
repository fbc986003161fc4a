"""Plan a course through points: limits from the drone, least time, and flights that decide how far to go.

The weakest of the drawn drones follows a plan of share 1 with all that its controller keeps in reserve.
Larger shares are quicker, and some drone then passes a point too far away: flights find each piece's share.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.model import Settings
from mambo_extensions.plan import COMMANDER_PIECES, LEAST_RATE
from mambo_extensions.plan.allowance import SURE, Allowance
from mambo_extensions.plan.course import PlannedCourse, course_of
from mambo_extensions.plan.heading import first_heading, headings_of
from mambo_extensions.plan.hermite import motion, pieces_of
from mambo_extensions.plan.limits import FlightLimit, figures_of, limits_of
from mambo_extensions.plan.plan_flight import Drones, FlownPlan, passed_points
from mambo_extensions.plan.points import PlanPoint
from mambo_extensions.plan.solver import HELD, first_course, passed_at_knots, silent, solve
from mambo_sil.api.campaigns import draw_vehicles
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.errors import PlanError
from mambo_sil.flight.polynomials import PiecesInSpace
from mambo_sil.model.derive.derived_flight import chosen_text

NO_QUICKER: Final = 0.997
"""Time of a plan over that of one with smaller shares, above which larger shares are of no use."""
TRIES: Final = 8
SLOWER: Final = np.concatenate([np.arange(0.99, 0.1, -0.01), 0.1 * 0.9 ** np.arange(40.0)])
"""Speeds of a plan at which it may keep the limits, over that at which it does not."""
DENSE: Final = (np.arange(65) / 64.0).astype(np.float64)
"""Times in a piece at which a plan is judged: others than those at which it was made."""

Progress = Callable[[str, float], None]
"""Called with what is being done, and the share that is done."""


@dataclass(frozen=True, eq=False)
class Planned:
    """A course and how it was flown.

    limits: what the course keeps.
    flown:  by the drone of the file, the drawn ones, and those at the ends of [uncertainty].
    """

    points: tuple[PlanPoint, ...]
    course: PlannedCourse
    limits: list[FlightLimit]
    flown: FlownPlan
    yaw: FloatArray
    height_judged: bool

    @property
    def curve(self) -> PiecesInSpace:
        """The pieces, and the points at the ends of those that have one."""
        pieces = pieces_of(self.course.knots, self.course.duration_s).pieces
        passed = passed_points(self.points, self.course)
        at_knots = dict(zip(self.course.choice.points[1:].tolist(), passed, strict=True))
        return PiecesInSpace(pieces, tuple(at_knots.get(piece + 1) for piece in range(len(pieces))))

    @property
    def reach_m(self) -> FloatArray:
        """How far from each judged point a drone may pass (p,)."""
        return reach_of(self.points, self.course)

    @property
    def good(self) -> bool:
        """Whether all drones passed all points."""
        return not self.flown.misses(self.reach_m).any()


def reach_of(points: Sequence[PlanPoint], course: PlannedCourse) -> FloatArray:
    """Return how far from each judged point a drone may pass (p,)."""
    return np.array([point.reach_m for point in passed_points(points, course)])


def shares_of(course: PlannedCourse, limits: Sequence[FlightLimit]) -> FloatArray:
    """Return what a course takes of each limit at the times DENSE of each piece (m, n, 65)."""
    moved = motion(course.knots, course.duration_s, DENSE)
    allowed = course.choice.allowed[:, np.newaxis]
    return np.stack([limit.of(moved, allowed)[0] for limit in limits]) + 1.0


def make_plan(
    points: Sequence[PlanPoint],
    vehicle: Vehicle,
    settings: Settings | None = None,
    *,
    closed: bool = False,
    rate: float = 1.0,
    drones: int = 20,
    seed: int = 0,
    progress: Progress = silent,
) -> Planned:
    """Plan a course through points for a drone and the settings of its controller, and fly it.

    settings: None for those that `design` derives from the drone.
    closed:   return to the first point, in a lap that repeats.
    rate:     speed of the plan over that of the quickest one.
    drones:   how many are drawn, as `draw_vehicles` does with `seed`.

    Raises PlanError if no plan keeps the limits, or none is flown; BuildError, CacheError.
    """
    drone = vehicle.drone
    if settings is None:
        settings = controller_toml.parse(chosen_text(drone, drone.name), f"settings for {drone.name}")
    drawn = draw_vehicles(vehicle, drones, seed)
    figures = figures_of(drone, settings, drawn)
    first = course_of(points, closed=closed)
    _require_speeds(first, figures.speed_m_s)
    search = _Search(tuple(points), first, Drones.of(vehicle, drawn, settings), rate, progress)
    limits = limits_of(figures)
    if points[0].time_s is not None:
        course = _timed(search, limits)
        flown = search.fly(course)
    else:
        course, flown = search.quickest(limits)
        if rate < 1.0:
            course = course.slower(rate)
            flown = search.fly(course)
    yaw = headings_of(points, course, rate)
    return Planned(tuple(points), course, limits, flown, yaw, settings.height is not None)


def _require_speeds(course: PlannedCourse, most_m_s: float) -> None:
    """Raise PlanError for a point whose speed in the plane is above the limit."""
    for knot, (x_m_s, y_m_s, _) in enumerate(course.knots[:, 1]):
        speed_m_s = math.hypot(x_m_s, y_m_s)
        if speed_m_s > most_m_s:
            raise PlanError(
                f"point {course.choice.point_of(knot)}: its speed in the plane, {speed_m_s:g} m/s, is above "
                f"limits.speed_m_s = {most_m_s:g}; {most_m_s:g} or less would do"
            )


@dataclass(frozen=True, eq=False)
class _Search:
    points: tuple[PlanPoint, ...]
    first: PlannedCourse
    drones: Drones
    rate: float
    progress: Progress

    def fly(self, course: PlannedCourse) -> FlownPlan:
        return self.drones.fly(course, self.points, first_heading(self.points, closed=course.choice.closed))

    def quickest(self, limits: Sequence[FlightLimit]) -> tuple[PlannedCourse, FlownPlan]:
        """Return the quickest course that all drones fly, and how it was flown."""
        reach_m = reach_of(self.points, self.first)
        found: tuple[PlannedCourse, FlownPlan] | None = None
        last = self._begin(1.0, limits)
        allowance = Allowance.of(last)
        for attempt in range(TRIES):
            course = self._plan(last.within(allowance.share), limits, attempt)
            if fault := _fault_of(course, limits):
                if found is None:
                    raise PlanError(fault)
                allowance = allowance.between(found[0])
                continue
            self.progress("flying", (attempt + 0.7) / TRIES)
            last, flown = course, self.fly(course)
            if not flown.misses(SURE * reach_m).any():
                settled = found is not None and _is_no_quicker(course, found[0])
                if found is None or course.time_s < found[0].time_s:
                    found = course, flown
                if settled:
                    break
                allowance = allowance.after(course, flown, reach_m)
            elif found is not None:
                allowance = allowance.between(found[0])
            elif allowance.is_least:
                break
            else:
                allowance = allowance.lowered()
                last = self._begin(float(allowance.share.min()), limits)
        if found is None:
            raise PlanError(_missed_words(self.points, reach_m, course, flown))
        return found

    def _begin(self, share: float, limits: Sequence[FlightLimit]) -> PlannedCourse:
        """Return a first course all of whose pieces take `share`, two to a leg if a Crazyflie holds them."""
        legs = self.first.choice.count
        course = first_course(self.first.within(np.full(legs, share)), limits)
        return solve(course, limits).halved if 2 * legs <= COMMANDER_PIECES else course

    def _plan(self, start: PlannedCourse, limits: Sequence[FlightLimit], attempt: int) -> PlannedCourse:
        """Return the quickest course within limits, from a first one."""

        def report(part: float) -> None:
            self.progress("planning", (attempt + 0.7 * part) / TRIES)

        return slowed(solve(start, limits, report), limits)


def _is_no_quicker(course: PlannedCourse, found: PlannedCourse) -> bool:
    """Return whether a course is no quicker than one all of whose shares are smaller."""
    larger = (course.choice.allowed >= found.choice.allowed).all()
    return bool(larger and course.time_s >= NO_QUICKER * found.time_s)


def _over(course: PlannedCourse, limits: Sequence[FlightLimit]) -> FloatArray:
    """Return by what share of each limit itself a course passes it, at the times DENSE (m, n, 65)."""
    scale = np.array([limit.scale for limit in limits])
    return np.asarray(scale[:, np.newaxis, np.newaxis] * (shares_of(course, limits) - 1.0))


def _fault_of(course: PlannedCourse, limits: Sequence[FlightLimit]) -> str:
    """Return which limit a course does not keep, where and by how much; nothing if it keeps all."""
    over = _over(course, limits)
    if over.max() > 3.0 * HELD:
        return f"{_passed_words(course, limits, over)}; move points, or change what limits it"
    passed = passed_at_knots(course).max(axis=0)
    if passed.max() > 3.0 * HELD:
        number = course.choice.point_of(int(passed.argmax()))
        return f"point {number}: is not reached within the limits; a wider tolerance would do"
    return ""


def slowed(course: PlannedCourse, limits: Sequence[FlightLimit]) -> PlannedCourse:
    """Return a course so much slower that it takes no more than all of each limit, at most by a tenth.

    Where jerk and acceleration take from each other a slower one may take more: then that which takes least.
    """
    tried = [course.slower(float(rate)) for rate in np.arange(1.0, 0.9, -0.0025)]
    taken = [float(shares_of(one, limits).max()) for one in tried]
    return next(
        (one for one, share in zip(tried, taken, strict=True) if share <= 1.0), tried[int(np.argmin(taken))]
    )


def _timed(search: _Search, limits: list[FlightLimit]) -> PlannedCourse:
    """Return the course of least snap at the times of the points; raises PlanError if a limit is passed."""
    times_s = np.array([point.time_s for point in search.points], np.float64)
    if search.first.choice.closed:
        raise PlanError("a closed lap cannot have times: leave out the column time, or --closed")
    search.progress("planning", 0.0)
    course = search.first.smooth(np.diff(times_s)).slower(search.rate)
    over = _over(course, limits)
    if over.max() > 1e-6:
        cure = _slower_words(course, limits, search.rate)
        raise PlanError(f"{_passed_words(course, limits, over)}; {cure}")
    search.progress("flying", 0.5)
    return course


def _slower_words(course: PlannedCourse, limits: Sequence[FlightLimit], rate: float) -> str:
    """Return at which rate a course flown at `rate` would keep the limits, or with which times."""
    keeps = (one for one in SLOWER if shares_of(course.slower(one), limits).max() <= 1.0)
    found = next(keeps, None)
    if found is None:
        return "no slower flight of this path would do"
    # the rate that is read is a hundredth at most below this one
    offered = math.floor(100.0 * rate * found + 1e-9) / 100.0
    if offered >= LEAST_RATE:
        return f"--rate {offered:.2f} would do"
    return f"times that are {math.ceil(1.0 / found)} times as long would do"


def _passed_words(course: PlannedCourse, limits: Sequence[FlightLimit], over: FloatArray) -> str:
    """Return which limit is passed most, where, and by how much."""
    limit, piece, sample = (int(one) for one in np.unravel_index(over.argmax(), over.shape))
    tau = DENSE[sample]
    time_s = course.duration_s[:piece].sum() + tau * course.duration_s[piece]
    name, choice = limits[limit].name, course.choice
    amount = f"{over.max():.2f} m" if name == "fence" else f"{100.0 * over.max():.0f} %"
    where = "between points {} and {}".format(*choice.near(piece))
    for knot, near in ((piece, tau < 0.1), (piece + 1, tau > 0.9)):
        if near and knot in choice.points:
            where = f"at point {choice.point_of(knot)}"
    return f"{where}, {time_s:.2f} s after the start: passes the limit of {name} by {amount}"


def _missed_words(
    points: Sequence[PlanPoint], reach_m: FloatArray, course: PlannedCourse, flown: FlownPlan
) -> str:
    """Return which point drones miss even at the slowest plan, by how much, and what would do."""
    off_m = np.where(np.isfinite(flown.off_m), flown.off_m, np.inf)
    over_m = (off_m - SURE * reach_m).max(axis=0)
    worst = int(over_m.argmax())
    missed = int(flown.misses(SURE * reach_m).sum())
    point = course.choice.point_of(course.choice.points[1 + worst])
    if flown.crashed.any():
        crashed = int(flown.crashed.sum())
        lowest = min(range(len(points)), key=lambda one: points[one].z_m)
        return (
            f"{crashed} of {len(flown.crashed)} drones crash on the slowest plan; a higher place for point "
            f"{lowest + 1}, z = {points[lowest].z_m:g}, the lowest, may do"
        )
    far_m = float(off_m[:, worst].max())
    kind = "width" if points[point - 1].normal is not None else "tolerance"
    wanted_m = far_m / SURE * (2.0 if kind == "width" else 1.0)
    return (
        f"point {point}: {missed} of {len(flown.crashed)} drones pass it up to {far_m:.3f} m away on a "
        f"plan of {course.time_s:.2f} s; {kind} = {wanted_m:.3f} would do"
    )
