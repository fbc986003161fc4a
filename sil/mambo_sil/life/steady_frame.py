"""What a flight does when the estimator of the autopilot moves its frame by a jump.

An estimator that learns that it was wrong moves position, velocity or heading at once; the drone has not
moved. So the controller is told of the jump (`nmpc_frame_jumped`), and the target moves with the frame, by an
offset that begins as the jump and then fades,

    offset''' = -3 w offset'' - 3 w^2 offset' - w^3 offset,

with its velocity and acceleration, which changes gradually: the command does not jump, and the drone glides
to where the new frame has its target. Limits stay in the frame.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.frames import wrapped
from mambo_sil.flight.states import TargetState
from mambo_sil.life.records import EstimatedState

JUMP_M, JUMP_RAD = 0.03, 0.1
"""Smallest changes that are taken for a jump where the estimator does not count its resets."""
ERROR_M_S, RATE_RAD_S = 0.5, 6.0
"""And how much larger they must be for each second between two estimates."""
CLOCK_S: Final = 0.005
"""Error of the time of an estimate, in which a drone flies as far as its velocity says."""
LONGEST_S: Final = 0.25
"""Time between two estimates from which on a jump cannot be seen."""
NOISE_M_S: Final = 0.1
"""Change of the velocity that may be noise and motion: where resets are not counted, none is seen in it."""
SETTLES_S, SETTLING_M = 1.0, 0.005
"""ArduCopter's estimator moves its position within half a second, by less in each step: for a time after a
jump smaller changes of the position are taken for its rest."""
LEAP_M, LEAP_M_S = 0.5, 4.0
"""Change of the position beyond the motion, and more for each second between two estimates, that an estimator
makes only in a reset; one that does not count its resets moves its position by less in each step."""
_HALF: Final = 128
"""Half the range of the counter of resets."""
FADING_1_S: Final = 1.05
"""w: after 0.2 m the drone glides with 0.06 m/s at most, and needs 6 s for 95 % of it."""


@dataclass(frozen=True, eq=False)
class FrameJump:
    """By what position and velocity (3,), z down, and heading have jumped."""

    position_m: FloatArray
    velocity_m_s: FloatArray
    heading_rad: float


class SteadyFrame:
    """Follows the jumps of an estimator; call `follow` once for each estimate."""

    def __init__(self) -> None:
        self.jumps = 0
        """Jumps so far."""
        self.heading_change_rad = 0.0
        """What the heading has jumped by so far."""
        self._last: EstimatedState | None = None
        self._jumped_s = -math.inf
        self._offset_m: FloatArray = np.zeros(3)
        self._offset_m_s: FloatArray = np.zeros(3)
        self._offset_m_s2: FloatArray = np.zeros(3)

    def begin(self, estimate: EstimatedState) -> None:
        """Take an estimate as it is, and forget what was before."""
        self._last, self._jumped_s = estimate, -math.inf
        self._offset_m, self._offset_m_s, self._offset_m_s2 = np.zeros((3, 3))

    def follow(self, estimate: EstimatedState) -> FrameJump | None:
        """Take the next estimate; return the jump that the frame has made before it, if there was one."""
        last, self._last = self._last, estimate
        if last is None or (passed_s := estimate.time_s - last.time_s) > LONGEST_S:
            self.begin(estimate)
            return None
        self._fade(passed_s)
        jump = self._jump(last, estimate, passed_s)
        if jump is not None:
            self.jumps += 1
            self._offset_m = self._offset_m + jump.position_m
            self._offset_m_s = self._offset_m_s + jump.velocity_m_s
            self.heading_change_rad += jump.heading_rad
        return jump

    def _jump(self, last: EstimatedState, estimate: EstimatedState, passed_s: float) -> FrameJump | None:
        """Return by what the frame has moved: where resets are not counted, what motion and noise are not."""
        moved_m, moved_m_s, turned_rad = _changes(last, estimate, passed_s)
        if last.resets is not None and estimate.resets is not None:
            return None if last.resets == estimate.resets else FrameJump(moved_m, moved_m_s, turned_rad)
        far_m = float(np.abs(moved_m).max()) - CLOCK_S * float(np.abs(estimate.velocity_m_s).max())
        has_turned = abs(turned_rad) > JUMP_RAD + RATE_RAD_S * passed_s
        if far_m > JUMP_M + ERROR_M_S * passed_s or has_turned:
            self._jumped_s = estimate.time_s
        elif far_m <= SETTLING_M or estimate.time_s > self._jumped_s + SETTLES_S:
            return None
        if float(np.abs(moved_m_s).max()) <= NOISE_M_S:
            moved_m_s = np.zeros(3)
        return FrameJump(moved_m, moved_m_s, turned_rad if has_turned else 0.0)

    def moved(self, target: TargetState) -> TargetState:
        """Return a target as far off as the rest of the jumps; its heading is its own."""
        now_m_s2, ahead_m_s2 = (
            None if one is None else one + self._offset_m_s2
            for one in (target.acceleration_m_s2, target.ahead_m_s2)
        )
        return TargetState(
            target.position_m + self._offset_m,
            target.velocity_m_s + self._offset_m_s,
            now_m_s2,
            target.yaw_rad,
            ahead_m_s2=ahead_m_s2,
        )

    def _fade(self, passed_s: float) -> None:
        """Let time pass for the offset, which solves its differential equation."""
        left, w = math.exp(-FADING_1_S * passed_s), FADING_1_S
        first_m_s = self._offset_m_s + w * self._offset_m
        second_m_s2 = self._offset_m_s2 + w * (2.0 * self._offset_m_s + w * self._offset_m)
        later_m_s = left * (first_m_s + passed_s * second_m_s2)
        self._offset_m = left * (self._offset_m + passed_s * (first_m_s + passed_s / 2.0 * second_m_s2))
        self._offset_m_s = later_m_s - w * self._offset_m
        self._offset_m_s2 = left * second_m_s2 - w * (2.0 * self._offset_m_s + w * self._offset_m)


def doubt(last: EstimatedState, estimate: EstimatedState) -> str | None:
    """Return why an estimate cannot follow the last one, in a sentence; None if it can."""
    passed_s = estimate.time_s - last.time_s
    if passed_s > LONGEST_S:
        return None
    if last.resets is not None and estimate.resets is not None and estimate.resets != last.resets:
        if (estimate.resets - last.resets) % (2 * _HALF) < _HALF:
            return None
        return f"the count of the estimator's resets has gone back from {last.resets} to {estimate.resets}"
    moved_m = float(np.abs(_changes(last, estimate, passed_s)[0]).max())
    if moved_m <= LEAP_M + LEAP_M_S * passed_s:
        return None
    within = f"within {1e3 * passed_s:.0f} ms"
    return f"the estimate has jumped by {moved_m:.1f} m {within} without a reset of the estimator"


def _changes(
    last: EstimatedState, estimate: EstimatedState, passed_s: float
) -> tuple[FloatArray, FloatArray, float]:
    """Return by what position and velocity (3,) and heading differ from the expected ones."""
    expected_m = last.position_m + passed_s * 0.5 * (last.velocity_m_s + estimate.velocity_m_s)
    turned_rad = float(wrapped(estimate.attitude_rad[2] - last.attitude_rad[2]))
    return estimate.position_m - expected_m, estimate.velocity_m_s - last.velocity_m_s, turned_rad
