"""The frame in which the controller flies when the estimator of the autopilot moves its own by a jump.

An estimator that learns that it was wrong moves position, velocity or heading at once; the drone has not
moved. The controller would answer with a jump of its command, and its observer would take the jump for a
gust. So the controller gets the estimate less an offset, which begins as the jump and then fades,

    offset'' = -2 w offset' - w^2 offset,

with position and velocity less `offset` and `offset'`, so that they agree: the drone glides to where the new
frame has its target. While it does, a fence of the controller is off by the offset.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from mambo_sil.api.frames import wrapped
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.link.records import EstimatedState

JUMP_M, JUMP_RAD = 0.1, 0.1
"""Smallest changes that are taken for a jump where the estimator does not count its resets."""
ERROR_M_S, RATE_RAD_S = 0.5, 6.0
"""And how much larger they must be for each second between two estimates."""
LONGEST_S: Final = 0.25
"""Time between two estimates from which on a jump cannot be seen."""
NOISE_M_S: Final = 0.1
"""Change of the velocity that may be noise and motion: where resets are not counted, none is seen in it."""
FADING_1_S: Final = 0.8
"""w: after 0.2 m the drone glides with 0.06 m/s at most, and needs 6 s for 95 % of it."""


class SteadyFrame:
    """Follows the jumps of an estimator; call `hold` once for each estimate."""

    def __init__(self) -> None:
        self.jumps = 0
        """Jumps so far."""
        self.heading_change_rad = 0.0
        """What the heading has jumped by so far."""
        self._last: EstimatedState | None = None
        self._offset_m: FloatArray = np.zeros(3)
        self._offset_m_s: FloatArray = np.zeros(3)

    @property
    def offset_m(self) -> FloatArray:
        """What remains of the jumps of the position (3,)."""
        return self._offset_m

    def begin(self, estimate: EstimatedState) -> None:
        """Take an estimate as it is, and forget what was before."""
        self._last = estimate
        self._offset_m, self._offset_m_s = np.zeros(3), np.zeros(3)

    def hold(self, estimate: EstimatedState) -> EstimatedState:
        """Return an estimate less the rest of the jumps; its heading is the new one."""
        last, self._last = self._last, estimate
        if last is None or (passed_s := estimate.time_s - last.time_s) > LONGEST_S:
            self.begin(estimate)
            return estimate
        self._fade(passed_s)
        moved_m, moved_m_s, turned_rad = _changes(last, estimate, passed_s)
        if _has_jumped(last, estimate, passed_s):
            self.jumps += 1
            self._offset_m = self._offset_m + moved_m
            if estimate.resets is not None or float(np.abs(moved_m_s).max()) > NOISE_M_S:
                self._offset_m_s = self._offset_m_s + moved_m_s
            self.heading_change_rad += turned_rad
        return replace(
            estimate,
            position_m=estimate.position_m - self._offset_m,
            velocity_m_s=estimate.velocity_m_s - self._offset_m_s,
        )

    def _fade(self, passed_s: float) -> None:
        """Let time pass for the offset, which solves its differential equation."""
        left = math.exp(-FADING_1_S * passed_s)
        pull_m_s = self._offset_m_s + FADING_1_S * self._offset_m
        self._offset_m = left * (self._offset_m + passed_s * pull_m_s)
        self._offset_m_s = left * (self._offset_m_s - FADING_1_S * passed_s * pull_m_s)


def _changes(
    last: EstimatedState, estimate: EstimatedState, passed_s: float
) -> tuple[FloatArray, FloatArray, float]:
    """Return by what position and velocity (3,) and heading differ from the expected ones."""
    expected_m = last.position_m + passed_s * last.velocity_m_s
    turned_rad = float(wrapped(estimate.attitude_rad[2] - last.attitude_rad[2]))
    return estimate.position_m - expected_m, estimate.velocity_m_s - last.velocity_m_s, turned_rad


def _has_jumped(last: EstimatedState, estimate: EstimatedState, passed_s: float) -> bool:
    """Return whether the frame has moved: by the count of the estimator, else by the size of the change."""
    if last.resets is not None and estimate.resets is not None:
        return last.resets != estimate.resets
    moved_m, _, turned_rad = _changes(last, estimate, passed_s)
    is_moved = float(np.abs(moved_m).max()) > JUMP_M + ERROR_M_S * passed_s
    return is_moved or abs(turned_rad) > JUMP_RAD + RATE_RAD_S * passed_s
