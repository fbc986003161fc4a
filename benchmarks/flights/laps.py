"""Laps through nine gates 40 cm wide: a smooth spline, limits without and with lag and dead time, and `plan`.

A crazyflie-brushless, three courses of our own. A lap counts if all of 24 drawn drones pass all gates; they
are others than the 20 by which `plan` decides. Splines and limits are tried from slow to quick, until one is
missed. Prints a table in Markdown.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from benchmarks.markdown import table
from mambo_codegen.settings import controller_toml
from mambo_extensions.plan.course import PlannedCourse, course_of
from mambo_extensions.plan.limits import Figures, figures_of, limits_of
from mambo_extensions.plan.plan_flight import Drones
from mambo_extensions.plan.planning import make_plan, reach_of, shares_of, slowed
from mambo_extensions.plan.points import PlanPoint
from mambo_extensions.plan.solver import first_course, solve
from mambo_sil.api.campaigns import draw_vehicles
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.model.derive.derived_flight import chosen_text

VEHICLE: Final = Vehicle.from_preset("crazyflie-brushless")
WIDTH_M, GATES, COURSES = 0.4, 9, 3
OTHERS: Final = 24
SEED: Final = 99
SPLINES_S: Final = np.arange(14.0, 4.0, -0.1)
SHARES: Final = 0.5 * 1.12 ** np.arange(20)
LEAST_LEG_M: Final = 1.0


def course(seed: int) -> list[PlanPoint]:
    """Return a start, nine gates along a smooth curve through them, and the last one as the place to stop."""
    random, places = np.random.default_rng(seed), [np.array([0.0, 0.0, 1.0])]
    while len(places) <= GATES:
        place = np.array([*random.uniform(-2.0, 2.0, 2), random.uniform(0.8, 1.4)])
        if all(np.linalg.norm(place - other) > LEAST_LEG_M for other in places[-2:]):
            places.append(place)
    smooth = spline(np.array(places), 9.0)
    first, *gates, last = zip(places, smooth.knots[:, 1], strict=True)
    return [
        _point(first[0]),
        *(replace(_point(place), normal=tuple(normal), width_m=WIDTH_M) for place, normal in gates),
        replace(_point(last[0]), tolerance_m=WIDTH_M / 2.0),
    ]


def _point(place_m: FloatArray) -> PlanPoint:
    x_m, y_m, z_m = place_m.tolist()
    return PlanPoint(x_m, y_m, z_m)


def spline(places_m: FloatArray, time_s: float) -> PlannedCourse:
    """Return the course of least snap whose times are as the roots of the distances."""
    plain = course_of([_point(place) for place in places_m], closed=False)
    root = np.sqrt(plain.choice.distance_m)
    return plain.smooth(time_s * root / root.sum())


class Judge:
    """Flies laps with drawn drones."""

    def __init__(self, points: list[PlanPoint]) -> None:
        settings = controller_toml.parse(chosen_text(VEHICLE.drone, VEHICLE.drone.name), "laps")
        self.figures = figures_of(VEHICLE.drone, settings, draw_vehicles(VEHICLE, 20, 0))
        self.alone = figures_of(VEHICLE.drone, settings, VEHICLE)
        self.points, self.first = points, course_of(points, closed=False)
        self._drones = Drones((draw_vehicles(VEHICLE, OTHERS, SEED),), settings)

    def passed(self, lap: PlannedCourse) -> int:
        """Return how many drones pass all gates."""
        flown = self._drones.fly(lap, self.points, 0.0)
        return int((~flown.misses(reach_of(self.points, lap))).sum())

    def quickest(self, laps: Iterable[PlannedCourse]) -> float:
        """Return the least time of laps, from slow to quick, before the first that a drone misses."""
        found = np.nan
        for lap in laps:
            if self.passed(lap) < OTHERS:
                break
            found = lap.time_s if np.isnan(found) else min(found, lap.time_s)
        return float(found)

    def within(self, figures: Figures, share: float = 1.0) -> PlannedCourse:
        """Return the quickest course within limits."""
        limits, first = limits_of(figures), self.first.within(np.full(self.first.choice.count, share))
        return slowed(solve(first_course(first, limits), limits), limits)


def without_lag(figures: Figures) -> Figures:
    """Return the figures of a drone that answers at once."""
    return replace(figures, tilt_lag_s=0.0, tilt_dead_time_s=0.0, thrust_lag_s=0.0, thrust_dead_time_s=0.0)


def rows() -> Iterator[tuple[str, ...]]:
    """Yield the laps of each course."""
    for number in range(1, COURSES + 1):
        judge = Judge(course(number))
        places_m = np.array([point.position_m for point in judge.points])
        whole = judge.within(without_lag(judge.alone))
        plan = make_plan(judge.points, VEHICLE)
        shares = shares_of(plan.course, plan.limits).max(axis=2)
        binding = [plan.limits[index].name for index in shares.argmax(axis=0)]
        yield (
            str(number),
            f"{judge.quickest(spline(places_m, time_s) for time_s in SPLINES_S):.2f}",
            f"{whole.time_s:.2f}, {judge.passed(whole)}",
            *(
                f"{judge.quickest(_at_shares(judge, figures)):.2f}"
                for figures in (without_lag(judge.figures), judge.figures)
            ),
            f"{plan.course.time_s:.2f}, {judge.passed(plan.course)}",
            ", ".join(f"{name} {binding.count(name)}" for name in dict.fromkeys(binding)),
        )


def _at_shares(judge: Judge, figures: Figures) -> Iterator[PlannedCourse]:
    within: Callable[[float], PlannedCourse] = lambda share: judge.within(figures, share)  # noqa: E731 - short
    yield from map(within, SHARES.tolist())


HEADS: Final = (
    "course",
    f"smooth spline, quickest that {OTHERS} fly",
    f"all tilt and thrust of the file's drone, no lag: lap, drones of {OTHERS}",
    f"tilt and thrust, the largest share that {OTHERS} fly",
    "the same with lag and dead time",
    f"`plan`: lap, drones of {OTHERS}",
    "what binds it, in how many pieces",
)


def main() -> None:
    """Print the table."""
    print(table([dict(zip(HEADS, row, strict=True)) for row in rows()]))


if __name__ == "__main__":
    main()
