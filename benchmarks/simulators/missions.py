"""What is flown, and the one number by which each flight is judged."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from mambo_nmpc.curves import Bernoulli, Circle, Hover, PositionStep, Trajectory, sample
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.trajectories import STEP_TIME_S

STEP_S: Final = 0.01
HEIGHT_M: Final = 1.0
AWAY_S: Final = 5.0
"""Time from which a flight on a curve is judged, and at which something happens to a drone."""
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

    title:       with size and rate, the head of a column, which ends with the unit of the score.
    heading_rad: step of the heading at `AWAY_S`.
    push_m_s2:   force along x over the mass, from `AWAY_S` on for `PUSH_S`.
    weight_m_s2: force downwards over the mass, from `AWAY_S` on.
    score:       of distances from the target (k,), heights (k,) and times (k,).
    planned_s:   duration of the step as a polynomial, for controllers that need one.
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
        return STEP_S * np.arange(round(self.duration_s / STEP_S) + 1)

    def targets(self, *, planned: bool = False) -> FloatArray:
        """Return position, velocity, acceleration and heading (k, 10) in NWU; a step may be a polynomial."""
        times_s = self.times_s
        parts = sample(self.trajectory, times_s, "NWU", height_m=HEIGHT_M)
        if planned and self.planned_s:
            parts = _planned(parts.position_m[-1], times_s - STEP_TIME_S, self.planned_s)
        heading_rad = np.where(times_s >= AWAY_S, self.heading_rad, 0.0)
        return np.concatenate([*parts, heading_rad[:, np.newaxis]], axis=1)

    def force_m_s2(self, time_s: float) -> FloatArray:
        """Return the force over the mass (3,)."""
        pushed = AWAY_S <= time_s < AWAY_S + PUSH_S
        return np.array([self.push_m_s2 * pushed, 0.0, -self.weight_m_s2 * (time_s >= AWAY_S)])

    def scores(self, flown: Flight3d) -> list[Score]:
        """Return the score of each drone."""
        target = self.targets()[:, np.newaxis, :2]
        distances_m = np.linalg.norm(flown.position_m[..., :2] - target, axis=-1)
        heights_m = flown.position_m[..., 2]
        alive = ((heights_m > LEAST_HEIGHT_M) & (flown.level > LARGEST_TILT)).all(axis=0)
        found = (self.score(*pair, self.times_s) for pair in zip(distances_m.T, heights_m.T, strict=True))
        return [
            score if lives and np.isfinite(score) else None for score, lives in zip(found, alive, strict=True)
        ]


def _planned(goal_m: FloatArray, since_s: FloatArray, planned_s: float) -> tuple[FloatArray, ...]:
    """Return a course from the origin to `goal_m` (3,) at rest: the polynomial of 7th order in time."""
    tau = np.clip(since_s / planned_s, 0.0, 1.0)
    shape = np.polynomial.Polynomial([0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0])
    way_m = goal_m * [1.0, 1.0, 0.0]
    rates = (shape.deriv(order)(tau) / planned_s**order if order else shape(tau) for order in range(3))
    course = [rate[:, np.newaxis] * way_m for rate in rates]
    return course[0] + goal_m * [0.0, 0.0, 1.0], course[1], course[2]


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
    "eight": Mission("eight, 2 m, 0.5 rad/s: RMSE, mm", EIGHT, 20.0, rms_mm),
    "circle": Mission("circle, 1 m, 1.5 rad/s: RMSE, mm", Circle(1.0, 1.5), 12.0, rms_mm),
    "fast eight": Mission("eight, 2 m, 1 rad/s: RMSE, mm", Bernoulli(2.0, 1.0), 14.0, rms_mm),
    "step": Mission("step of 1 m: within 5 cm, s", PositionStep(1.0, 0.0), 6.0, settled_s, planned_s=1.5),
    "far step": Mission("step of 5 m: within 5 cm, s", PositionStep(5.0, 0.0), 9.0, settled_s, planned_s=4.0),
    "push": Mission("push of 1 m/s2: largest, mm", Hover(), 12.0, largest_mm, push_m_s2=PUSH_M_S2),
    "heading": Mission(
        "eight, heading by 2 rad: least height, m", EIGHT, 10.0, least_height_m, heading_rad=YAW_STEP_RAD
    ),
    "payload": Mission(
        "payload of 15 %: least height, m", EIGHT, 10.0, least_height_m, weight_m_s2=PAYLOAD_SHARE * 9.81
    ),
}
