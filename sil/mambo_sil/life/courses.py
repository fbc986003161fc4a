"""What a pilot lets the drone follow: a place, a curve, or the targets of a program."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Protocol

import numpy as np

from mambo_codegen.port.taken import AHEAD_S
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.states import TargetState
from mambo_sil.flight.trajectories import Trajectory, vertical_of

SOFT_S: Final = 4.0
"""Time in which a curve reaches its rate, and comes to rest at its end."""
RESTS_M_S: Final = 0.05
"""A curve that is not quicker than this at an end needs no soft one."""


class TargetCourse(Protocol):
    """Targets over time."""

    @property
    def duration_s(self) -> float:
        """When the course ends; from then on its last target holds."""
        ...

    def target(self, time_s: float) -> TargetState:
        """Return the target at a time since the beginning of the course."""
        ...


@dataclass(frozen=True, eq=False)
class Place:
    """A place (3,), z down, and the heading there, None for the present one."""

    position_m: FloatArray
    yaw_rad: float | None = None
    duration_s: float = math.inf

    def target(self, time_s: float) -> TargetState:  # noqa: ARG002 - it is the same at all times
        """Return the target."""
        return TargetState(self.position_m, np.zeros(3), np.zeros(3), self.yaw_rad)


@dataclass(frozen=True, eq=False)
class Along:
    """A curve whose beginning is moved to `start_m` (3,).

    Its clock starts softly if the curve begins in flight, and ends softly if it still moves then: a plan from
    rest to rest is flown in its own time.
    """

    curve: Trajectory
    start_m: FloatArray
    duration_s: float

    def target(self, time_s: float) -> TargetState:
        """Return the target."""
        position_m, velocity_m_s, acceleration_m_s2 = self._motion(time_s)
        *_, ahead_m_s2 = self._motion(time_s + AHEAD_S)
        return TargetState(position_m, velocity_m_s, acceleration_m_s2, ahead_m_s2=ahead_m_s2)

    def _motion(self, time_s: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return position, velocity and acceleration (3,) at a time, z down."""
        clock_s, rate, change_1_s = self._clock(min(max(time_s, 0.0), self.duration_s))
        first, now = self._curve(0.0), self._curve(clock_s)
        position_m = self.start_m + now[0] - first[0]
        return position_m, rate * now[1], rate * rate * now[2] + change_1_s * now[1]

    @cached_property
    def _soft_s(self) -> tuple[float, float]:
        """How long the soft start and the soft end last."""
        soft_s = min(SOFT_S, self.duration_s / 2.0)
        start_s = soft_s if self._moves(0.0) else 0.0
        return start_s, soft_s if self._moves(self.duration_s - start_s / 2.0) else 0.0

    def _moves(self, clock_s: float) -> bool:
        return float(np.linalg.norm(self._curve(clock_s)[1])) > RESTS_M_S

    def _clock(self, time_s: float) -> tuple[float, float, float]:
        """Return the time on the curve, its rate, and the change of that per second.

        The rate rises from 0 to 1 in the soft start, and falls to 0 in the soft end.
        """
        start_s, end_s = self._soft_s
        if time_s < start_s:
            return time_s * time_s / (2.0 * start_s), time_s / start_s, 1.0 / start_s
        left_s = self.duration_s - time_s
        if left_s < end_s:
            clock_s = self.duration_s - (start_s + end_s) / 2.0 - left_s * left_s / (2.0 * end_s)
            return clock_s, left_s / end_s, -1.0 / end_s
        return time_s - start_s / 2.0, 1.0, 0.0

    def _curve(self, clock_s: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return position, velocity and acceleration (3,), z down."""
        x, y, vx, vy = self.curve.target(clock_s).tolist()
        ax, ay = self.curve.acceleration(clock_s).tolist()
        height, climb, upwards = vertical_of(self.curve, clock_s).tolist()
        return np.array([x, y, -height]), np.array([vx, vy, -climb]), np.array([ax, ay, -upwards])


@dataclass(frozen=True, eq=False)
class TargetProgram:
    """The targets of a program."""

    function: Callable[[float], TargetState]
    duration_s: float

    def target(self, time_s: float) -> TargetState:
        """Return the target."""
        return self.function(min(time_s, self.duration_s))
