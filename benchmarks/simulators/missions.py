"""What is flown, and the one number by which each flight is judged: a distance in space, or a time."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from mambo_nmpc.curves import Circle, CurvePoint, Gerono, Hover, PositionStep, Trajectory, curve, sample
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.trajectories import STEP_TIME_S

STEP_S: Final = 0.01
HEIGHT_M: Final = 1.0
START_S: Final = 3.0
"""Time in which a flight on a curve gets from rest to the rate of the curve."""
AWAY_S: Final = 5.0
"""Time at which something happens to a drone."""
JUDGED_S: Final = 6.0
"""Time from which a flight on a curve is judged."""
PUSH_S: Final = 5.0
SETTLED_M: Final = 0.05
LEAST_HEIGHT_M: Final = 0.05
LARGEST_TILT: Final = float(np.cos(1.4))

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
    score:       of distances from the target (k,) and times (k,).
    push_m_s2:   force along x over the mass, from `AWAY_S` on for `PUSH_S`.
    weight_m_s2: force downwards over the mass, from `AWAY_S` on.
    """

    title: str
    trajectory: Trajectory
    duration_s: float
    score: Callable[[FloatArray, FloatArray], float]
    push_m_s2: float = 0.0
    weight_m_s2: float = 0.0

    def times_s(self, period_s: float = STEP_S) -> FloatArray:
        """Return the times of the commands (k,)."""
        return np.asarray(period_s * np.arange(round(self.duration_s / period_s) + 1), np.float64)

    def targets(self, period_s: float = STEP_S) -> FloatArray:
        """Return position, velocity and acceleration (k, 9) in NWU; curves begin at rest, steps jump."""
        times_s = self.times_s(period_s)
        if isinstance(self.trajectory, PositionStep):
            return np.concatenate(sample(self.trajectory, times_s, "NWU", height_m=HEIGHT_M), axis=1)
        share = np.minimum(times_s / START_S, 1.0)[:, np.newaxis]
        rate, rate_1_s = share**2 * (3.0 - 2.0 * share), 6.0 * share * (1.0 - share) / START_S
        warped_s = START_S * (share**3 - 0.5 * share**4)[:, 0] + np.maximum(times_s - START_S, 0.0)
        now: CurvePoint = sample(self.trajectory, warped_s, "NWU", height_m=HEIGHT_M)
        acceleration_m_s2 = now.acceleration_m_s2 * rate**2 + now.velocity_m_s * rate_1_s
        return np.concatenate([now.position_m, now.velocity_m_s * rate, acceleration_m_s2], axis=1)

    def force_m_s2(self, time_s: float) -> FloatArray:
        """Return the force over the mass (3,)."""
        pushed = AWAY_S <= time_s < AWAY_S + PUSH_S
        return np.array([self.push_m_s2 * pushed, 0.0, -self.weight_m_s2 * (time_s >= AWAY_S)])

    def scores(self, flown: Flight3d, period_s: float = STEP_S) -> list[Score]:
        """Return the score of each drone."""
        target_m = self.targets(period_s)[:, np.newaxis, :3]
        distances_m = np.linalg.norm(flown.position_m - target_m, axis=-1)
        high = flown.position_m[..., 2] > LEAST_HEIGHT_M
        alive = np.all(high & (flown.level > LARGEST_TILT), axis=0)
        found = (self.score(each, self.times_s(period_s)) for each in distances_m.T)
        return [
            score if lives and np.isfinite(score) else None for score, lives in zip(found, alive, strict=True)
        ]


def rms_mm(distances_m: FloatArray, times_s: FloatArray) -> float:
    """Return the root mean square of the distance from `JUDGED_S` on, in mm."""
    late_m = distances_m[times_s >= JUDGED_S]
    return float(1e3 * np.sqrt(np.mean(late_m * late_m)))


def largest_mm(distances_m: FloatArray, times_s: FloatArray) -> float:
    """Return the largest distance from `AWAY_S` on, in mm."""
    return float(1e3 * distances_m[times_s >= AWAY_S].max())


def settled_s(distances_m: FloatArray, times_s: FloatArray) -> float:
    """Return the time from the step until the distance stays within 5 cm; infinity if it never does."""
    outside = np.flatnonzero(~(distances_m <= SETTLED_M))
    last = int(outside[-1])
    return float("inf") if last == len(times_s) - 1 else float(times_s[last + 1]) - STEP_TIME_S


EIGHT: Final = Gerono(2.0, 0.5)
MISSIONS: Final = {
    "eight": Mission("eight, mm", EIGHT, 20.0, rms_mm),
    "circle": Mission("circle, mm", Circle(1.0, 1.5), 12.0, rms_mm),
    "space": Mission("circle in space, mm", curve("tilted-circle", 1.0, 1.2), 14.0, rms_mm),
    "step": Mission("step 1 m, s", PositionStep(1.0, 0.0), 7.0, settled_s),
    "push": Mission("push, mm", Hover(), 11.0, largest_mm, push_m_s2=1.0),
    "mass": Mission("mass +20 %, mm", EIGHT, 16.0, rms_mm, weight_m_s2=0.2 * 9.81),
}
TUNED_ON: Final = {name: MISSIONS[name] for name in ("space", "step", "push")}
"""Missions on which opponents are tuned, with scores that count alike."""
DISTANCE_MM: Final = 30.0
SCALES: Final = {"step": 1.0, "push": 80.0}
"""Of those that are not distances from a curve."""
LOST: Final = 20.0
"""Cost of a flight that was lost, and the most that another may cost."""


def cost_of(scores: dict[str, Score]) -> float:
    """Return what a search for gains makes small."""
    parts = (
        LOST if score is None else score / SCALES.get(name, DISTANCE_MM) for name, score in scores.items()
    )
    return float(sum(min(part, LOST) for part in parts))
