"""What a plan may take of tilt and spare thrust: flights say where drones fall behind it.

A weak drone follows a share of its thrust for a moment that it does not follow for a second. So each piece
has its own share: it grows while all drones keep near the plan there, and shrinks where they fall behind.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from mambo_extensions.plan.course import PlannedCourse
from mambo_extensions.plan.plan_flight import FlownPlan
from mambo_sil.drone.plant.arrays import FloatArray

SHARES: Final = (0.35, 4.0)
"""Least and largest share of tilt and spare thrust that a piece takes."""
LOWER: Final = 0.55
"""Factor between the shares of all pieces, until drones fly the plan."""
STEP: Final = 0.12
"""Largest change of the logarithm of a share; it is halved when drones do not fly the next plan."""
STEEP: Final = 8.0
"""Change of the logarithm of a drone's distance from the plan per change of that of the share, about."""
SURE: Final = 0.85
"""Of a tolerance, what the flown drones must not leave: others fly a little wider."""
ASTRAY: Final = 1.0
"""Largest distance from the plan within a piece, over the tolerance of the point at the end of its leg, with
which its share grows."""
BESIDE: Final = 0.2
"""The same at the point itself, beyond the distance at which the plan passes it."""


@dataclass(frozen=True, eq=False)
class Allowance:
    """What the n pieces of a plan may take.

    share: (n,) of tilt and spare thrust.
    step:  largest next change of the logarithm of a share.
    """

    share: FloatArray
    step: float = STEP

    @classmethod
    def of(cls, course: PlannedCourse) -> "Allowance":
        """Return that of a course that was not flown yet."""
        return cls(course.choice.allowed)

    @property
    def is_least(self) -> bool:
        """Whether no piece may take less."""
        return bool((self.share <= SHARES[0]).all())

    def lowered(self) -> "Allowance":
        """Return a smaller one, as long as drones fly none."""
        return replace(self, share=np.maximum(LOWER * self.share, SHARES[0]))

    def after(self, course: PlannedCourse, flown: FlownPlan, tolerance_m: FloatArray) -> "Allowance":
        """Return that of the next plan, after flights of one that all drones fly.

        tolerance_m: (p,) of the points at the ends of the legs.
        """
        choice = course.choice
        planned_m = np.linalg.norm(course.value[choice.points[1:], 0], axis=1)
        astray = _most(flown.error_m / tolerance_m[choice.leg])
        beside = _most((flown.off_m - planned_m) / tolerance_m)[choice.leg]
        taken = np.maximum(np.maximum(astray / ASTRAY, beside / BESIDE), 1e-3)
        change = np.clip(-np.log(taken) / STEEP, -self.step, self.step)
        return replace(self, share=np.clip(self.share * np.exp(change), *SHARES))

    def between(self, found: PlannedCourse) -> "Allowance":
        """Return one half-way between this, with which drones fly no plan, and that of a plan they fly."""
        return Allowance(np.sqrt(self.share * found.choice.allowed), self.step / 2.0)


def _most(of_drones: FloatArray) -> FloatArray:
    """Return the largest value (n,) of m drones (m, n), infinity if one is lost."""
    return np.asarray(np.where(np.isnan(of_drones), np.inf, of_drones).max(axis=0))
