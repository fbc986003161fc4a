"""What is flown, and the one number by which each flight is judged."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from mambo_nmpc.curves import Bernoulli, Circle, CurvePoint, Hover, PositionStep, Trajectory, sample
from mambo_sil.api.heading import HEADING_RATE_RAD_S
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.trajectories import STEP_TIME_S

STEP_S: Final = 0.01
HEIGHT_M: Final = 1.0
AWAY_S: Final = 5.0
"""Time from which a flight on a curve is judged, and at which something happens to a drone."""
START_S: Final = 4.0
"""Time in which a planned flight on a curve gets from rest to the rate of the curve."""
PUSH_S: Final = 5.0
SETTLED_M: Final = 0.05
LEAST_HEIGHT_M: Final = 0.05
LARGEST_TILT: Final = float(np.cos(1.4))
PUSH_M_S2: Final = 1.0
PAYLOAD_SHARE: Final = 0.15
YAW_STEP_RAD: Final = 2.0

Score = float | None
"""None: the drone crashed, or never arrived."""


@dataclass(frozen=True, eq=False)
class Flight3d:
    """A flight at k times of w drones: true positions (k, w, 3) in NWU, cosines of the tilt (k, w)."""

    position_m: FloatArray
    level: FloatArray


@dataclass(frozen=True, eq=False)
class Mission:
    """A flight that every controller flies.

    title:       the head of a column, which ends with the unit of the score.
    heading_rad: step of the heading at `AWAY_S`.
    push_m_s2:   force along x over the mass, from `AWAY_S` on for `PUSH_S`.
    weight_m_s2: force downwards over the mass, from `AWAY_S` on.
    score:       of distances from the target (k,), heights (k,) and times (k,).
    planned_s:   duration of the step as a polynomial, for controllers that get a planned one; 0 for curves.
    """

    title: str
    trajectory: Trajectory
    duration_s: float
    score: Callable[[FloatArray, FloatArray, FloatArray], float]
    heading_rad: float = 0.0
    push_m_s2: float = 0.0
    weight_m_s2: float = 0.0
    planned_s: float = 0.0

    @property
    def times_s(self) -> FloatArray:
        """The times of the commands (k,)."""
        return np.asarray(STEP_S * np.arange(round(self.duration_s / STEP_S) + 1), np.float64)

    def targets(self, *, planned: bool = False) -> FloatArray:
        """Return position, velocity, acceleration and heading (k, 10) in NWU.

        planned: steps are polynomials, curves begin at rest, and the heading turns at a limited rate.
        """
        times_s = self.times_s
        heading_rad = np.where(times_s >= AWAY_S, self.heading_rad, 0.0)
        if not planned:
            parts = sample(self.trajectory, times_s, "NWU", height_m=HEIGHT_M)
        else:
            parts = self._planned_step(times_s) if self.planned_s else self._planned_start(times_s)
            turned_rad = HEADING_RATE_RAD_S * np.maximum(times_s - AWAY_S, 0.0)
            heading_rad = np.minimum(turned_rad, heading_rad)
        return np.concatenate([*parts, heading_rad[:, np.newaxis]], axis=1)

    def _planned_step(self, times_s: FloatArray) -> CurvePoint:
        """Return the step as the polynomial of 7th order in time that is at rest at both ends."""
        goal_m = sample(self.trajectory, times_s[-1], "NWU", height_m=HEIGHT_M).position_m
        tau = np.clip((times_s - STEP_TIME_S) / self.planned_s, 0.0, 1.0)[:, np.newaxis]
        course = np.polynomial.Polynomial([0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0])
        way_m = goal_m * [1.0, 1.0, 0.0]
        return CurvePoint(
            way_m * course(tau) + goal_m * [0.0, 0.0, 1.0],
            way_m * course.deriv(1)(tau) / self.planned_s,
            way_m * course.deriv(2)(tau) / self.planned_s**2,
        )

    def _planned_start(self, times_s: FloatArray) -> CurvePoint:
        """Return the curve, which begins at rest where it is after half of `START_S`, and catches up."""
        share = np.minimum(times_s / START_S, 1.0)[:, np.newaxis]
        rate, rate_1_s = share**2 * (3.0 - 2.0 * share), 6.0 * share * (1.0 - share) / START_S
        warped_s = START_S * (0.5 + share[:, 0] ** 3 - 0.5 * share[:, 0] ** 4)
        now = sample(self.trajectory, np.maximum(warped_s, times_s), "NWU", height_m=HEIGHT_M)
        return CurvePoint(
            now.position_m,
            now.velocity_m_s * rate,
            now.acceleration_m_s2 * rate**2 + now.velocity_m_s * rate_1_s,
        )

    def force_m_s2(self, time_s: float) -> FloatArray:
        """Return the force over the mass (3,)."""
        pushed = AWAY_S <= time_s < AWAY_S + PUSH_S
        return np.array([self.push_m_s2 * pushed, 0.0, -self.weight_m_s2 * (time_s >= AWAY_S)])

    def scores(self, flown: Flight3d) -> list[Score]:
        """Return the score of each drone."""
        target = self.targets()[:, np.newaxis, :2]
        distances_m = np.linalg.norm(flown.position_m[..., :2] - target, axis=-1)
        heights_m = flown.position_m[..., 2]
        alive = np.all((heights_m > LEAST_HEIGHT_M) & (flown.level > LARGEST_TILT), axis=0)
        found = (self.score(*pair, self.times_s) for pair in zip(distances_m.T, heights_m.T, strict=True))
        return [
            score if lives and np.isfinite(score) else None for score, lives in zip(found, alive, strict=True)
        ]


def rms_mm(distances_m: FloatArray, heights_m: FloatArray, times_s: FloatArray) -> float:  # noqa: ARG001 - a score
    """Return the root mean square of the horizontal distance from `AWAY_S` on, in mm."""
    late_m = distances_m[times_s >= AWAY_S]
    return float(1e3 * np.sqrt(np.mean(late_m * late_m)))


def largest_mm(distances_m: FloatArray, heights_m: FloatArray, times_s: FloatArray) -> float:  # noqa: ARG001 - a score
    """Return the largest horizontal distance from `AWAY_S` on, in mm."""
    return float(1e3 * distances_m[times_s >= AWAY_S].max())


def settled_s(distances_m: FloatArray, heights_m: FloatArray, times_s: FloatArray) -> float:  # noqa: ARG001 - a score
    """Return the time from the step until the distance stays within 5 cm; infinity if it never does."""
    outside = np.flatnonzero(~(distances_m <= SETTLED_M))
    last = int(outside[-1])
    return float("inf") if last == len(times_s) - 1 else float(times_s[last + 1]) - STEP_TIME_S


def least_height_m(distances_m: FloatArray, heights_m: FloatArray, times_s: FloatArray) -> float:  # noqa: ARG001 - a score
    """Return the least height from `AWAY_S` on, in m."""
    return float(heights_m[times_s >= AWAY_S].min())


EIGHT: Final = Bernoulli(2.0, 0.5)
MISSIONS: Final = {
    "eight": Mission("eight, mm", EIGHT, 20.0, rms_mm),
    "circle": Mission("circle, mm", Circle(1.0, 1.5), 12.0, rms_mm),
    "fast eight": Mission("fast eight, mm", Bernoulli(2.0, 1.0), 14.0, rms_mm),
    "step": Mission("step 1 m, s", PositionStep(1.0, 0.0), 6.0, settled_s, planned_s=1.5),
    "far step": Mission("step 5 m, s", PositionStep(5.0, 0.0), 9.0, settled_s, planned_s=4.0),
    "push": Mission("push, mm", Hover(), 12.0, largest_mm, push_m_s2=PUSH_M_S2),
    "heading": Mission("turn, m", EIGHT, 10.0, least_height_m, heading_rad=YAW_STEP_RAD),
    "payload": Mission("payload, m", EIGHT, 10.0, least_height_m, weight_m_s2=PAYLOAD_SHARE * 9.81),
}
