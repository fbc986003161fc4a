"""Flights of a plan: with the drone of the file, with others like it, and where they pass the points."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.port.taken import MOST_KNOWN
from mambo_codegen.settings.model import Settings
from mambo_extensions.plan.course import PlannedCourse
from mambo_extensions.plan.hermite import pieces_of
from mambo_extensions.plan.points import PlanPoint
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.errors import FlightError
from mambo_sil.experiment.margins.corners import at_ends, corners
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.crashes import detect_crashes
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight, Offset
from mambo_sil.flight.names import DEFAULT_SENSORS
from mambo_sil.flight.passing import PassedPoint, distances_m
from mambo_sil.flight.polynomials import PiecesInSpace
from mambo_sil.flight.scenario import choose_sensors
from mambo_sil.flight.traces import Trace

RUN_IN_S, REST_S = 2.0, 1.0
"""Before the plan begins, in which controllers learn the weight; and at the last point behind its end."""


@dataclass(frozen=True)
class Waiting:
    """Pieces that begin after `wait_s`; before, the target comes at their first speed.

    It begins to climb so late that it comes from no lower than half of their first height.
    """

    pieces: PiecesInSpace
    wait_s: float
    known: ClassVar = MOST_KNOWN

    def _clock(self, time_s: ArrayLike) -> FloatArray:
        return np.asarray(np.asarray(time_s) - self.wait_s)

    def target(self, time_s: ArrayLike) -> FloatArray:
        """Return [x, y, vx, vy] (..., 4)."""
        x, y, vx, vy = self.pieces.target(0.0)
        before_s = np.minimum(np.asarray(time_s) - self.wait_s, 0.0)
        comes = np.stack(
            [x + vx * before_s, y + vy * before_s, *np.broadcast_arrays(vx, vy, before_s)[:2]], -1
        )
        return self._chosen(time_s, comes, self.pieces.target(self._clock(time_s)))

    def acceleration(self, time_s: ArrayLike) -> FloatArray:
        """Return [ax, ay] (..., 2)."""
        flown = self.pieces.acceleration(self._clock(time_s))
        return self._chosen(time_s, np.zeros_like(flown), flown)

    def vertical(self, time_s: ArrayLike) -> FloatArray:
        """Return [height, climb, vertical acceleration] (..., 3)."""
        height, climb, _ = self.pieces.vertical(0.0)
        climbs_s = self.wait_s if climb <= 0.0 else min(self.wait_s, 0.5 * max(height, 0.0) / climb)
        before_s = np.minimum(np.asarray(time_s) - self.wait_s, 0.0)
        comes = np.stack(
            np.broadcast_arrays(
                height + climb * np.maximum(before_s, -climbs_s),
                np.where(before_s < -climbs_s, 0.0, climb),
                0.0,
            ),
            -1,
        )
        return self._chosen(time_s, comes, self.pieces.vertical(self._clock(time_s)))

    def _chosen(self, time_s: ArrayLike, before: FloatArray, after: FloatArray) -> FloatArray:
        begun = np.asarray(time_s) >= self.wait_s
        return np.where(begun[..., np.newaxis], after, before)


@dataclass(frozen=True, eq=False)
class FlownPlan:
    """How m drones flew a plan.

    off_m:     (m, p) least distance from each point that is judged, of a gate where the drone crosses it; in
               the plane where the settings do not hold the height.
    crashed:   (m,).
    error_m:   largest distance of each from the plan in each of n pieces (m, n).
    tilt_rad, thrust_m_s2: largest of each on the plan (m,).
    """

    off_m: FloatArray
    crashed: NDArray[np.bool_]
    error_m: FloatArray
    tilt_rad: FloatArray
    thrust_m_s2: FloatArray

    def misses(self, reach_m: FloatArray) -> NDArray[np.bool_]:
        """Return which drones crash, or pass a point farther away than `reach_m` (p,)."""
        return np.asarray(self.crashed | ~(self.off_m <= reach_m).all(axis=1))


@dataclass(frozen=True, eq=False)
class Drones:
    """Drones that fly a plan with the same settings: groups, each of them flown together."""

    groups: Sequence[Vehicle]
    settings: Settings

    @classmethod
    def of(cls, drone: Vehicle, drawn: Vehicle, settings: Settings) -> "Drones":
        """Return the drone of the file, the drawn ones, and those at the ends of [uncertainty].

        An end at which the thrust does not lift it is left out: the limits of the plan count it.
        """
        groups = [drone, drawn]
        if drone.drone.uncertainty is not None:
            for ends in corners(drone.drone):
                try:
                    groups.append(Vehicle.of(at_ends(drone.drone, ends)))
                except FlightError:
                    continue
        return cls(groups, settings)

    def fly(self, course: PlannedCourse, points: Sequence[PlanPoint], yaw_rad: float) -> FlownPlan:
        """Return how they fly a course; raises BuildError, CacheError."""
        flown = [self._fly(group, course, points, yaw_rad) for group in self.groups]
        names = ("off_m", "crashed", "error_m", "tilt_rad", "thrust_m_s2")
        return FlownPlan(*(np.concatenate([getattr(one, name) for one in flown]) for name in names))

    def _fly(
        self, vehicle: Vehicle, course: PlannedCourse, points: Sequence[PlanPoint], yaw_rad: float
    ) -> FlownPlan:
        flights = int(np.size(vehicle.airframe.mass_kg))
        closed = course.choice.closed
        target = Waiting(pieces_of(course.knots, course.duration_s), RUN_IN_S)
        (_, _, x_m_s, y_m_s), (_, climb_m_s, _) = target.target(0.0), target.vertical(0.0)
        judged_s = RUN_IN_S + (course.time_s if closed else 0.0)
        period_s = self.settings.horizon.update_period_s
        lasts_s = judged_s + course.time_s + REST_S
        flight = Flight(
            target,
            duration_s=period_s * math.floor(lasts_s / period_s),
            flights=flights,
            vehicle=vehicle,
            yaw_rad=-yaw_rad,
            update_period_s=period_s,
            seeds=tuple(range(flights)),
            offset=Offset(velocity_m_s=(float(x_m_s), float(y_m_s), -float(climb_m_s))),
            sensors=choose_sensors(DEFAULT_SENSORS[vehicle.drone.sensors.kind], vehicle.drone),
        )
        trace = fly(flight, CompiledController(self.settings, flights))
        planned = trace.time_s >= judged_s
        tilt_rad = np.arccos(np.cos(trace.euler_rad[planned, :, 0]) * np.cos(trace.euler_rad[planned, :, 1]))
        axes = 2 if self.settings.height is None else 3
        at_knots_s = judged_s + np.concatenate([[0.0], np.cumsum(course.duration_s)])
        passed_s = at_knots_s[course.choice.points]
        path_m = (trace.position_m * [1.0, -1.0, -1.0])[..., :axes]
        return FlownPlan(
            distances_m(trace.time_s, path_m, passed_points(points, course), passed_s),
            detect_crashes(trace, vehicle.drone),
            _error_m(trace, at_knots_s, axes),
            tilt_rad.max(axis=0),
            trace.thrust_acceleration_m_s2[planned].max(axis=0),
        )


def _error_m(trace: Trace, at_knots_s: FloatArray, axes: int) -> FloatArray:
    """Return the largest distance (m, n) from the plan in each piece, along the first `axes` of x, y, z.

    at_knots_s: (n + 1,) when the pieces begin, and when the last one ends; the rest after it counts as a part
                of it.
    """
    target_m = np.concatenate([trace.target[..., :2], -trace.target_height_m[..., np.newaxis]], axis=-1)
    error_m = np.linalg.norm((trace.position_m - target_m)[..., :axes], axis=-1)
    begins = np.searchsorted(trace.time_s, at_knots_s[:-1])
    return np.asarray(np.maximum.reduceat(error_m, begins, axis=0).T)


def passed_points(points: Sequence[PlanPoint], course: PlannedCourse) -> tuple[PassedPoint, ...]:
    """Return the points that are judged: all but the first, where the drone begins.

    A gate at which the drone stops is not crossed.
    """
    found = []
    for knot in course.choice.points[1:]:
        number = course.choice.point_of(knot)
        point = points[number - 1]
        stops = knot == course.choice.count and not course.choice.closed
        normal = None if point.normal is None or stops else point.normal
        found.append(PassedPoint(number, point.position_m, point.reach_m, normal))
    return tuple(found)
