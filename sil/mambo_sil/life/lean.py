"""The lean against wind at a take-over, until the controller has learnt the wind.

A controller that begins has learnt nothing: it would level a drone that leans against the wind. So what
pushes the drone is watched before, and the controller flies a drone that is upright: it gets the tilt less
the lean, which is added to its commands. The lean fades, while the controller learns the wind.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.elementary import sine_cosine
from mambo_sil.drone.plant.rigid_body import to_world
from mambo_sil.life.records import EstimatedState

WATCH_S: Final = 1.0
"""Time over which the push is averaged; without as much it is not known."""
LONGEST_GAP_S: Final = 0.5
UPRIGHT: Final = 0.5
"""Least share of the thrust that points up, a tilt of 60 degrees, for a push to be seen."""
FADES_S: Final = 10.0
"""Time constant with which the lean fades."""


class Lean:
    """Watches the push (2,) on a drone, and leans against it; along x and y of the world."""

    def __init__(self, drag_1_s: float, most_m_s2: float) -> None:
        self.against_m_s2: FloatArray = np.zeros(2)
        """The acceleration that the lean would give in still air."""
        self._drag_1_s, self._most_m_s2 = drag_1_s, most_m_s2
        self._last: EstimatedState | None = None
        self._watched_s, self._push_m_s2 = 0.0, np.zeros(2)

    def watch(self, estimate: EstimatedState) -> None:
        """Take an estimate of a flight that is not the controller's; leave out one that shows no push."""
        if not np.isfinite([estimate.velocity_m_s, estimate.attitude_rad]).all():
            return
        down = to_world(*sine_cosine(estimate.attitude_rad), np.array([0.0, 0.0, 1.0]))
        if down[2] < UPRIGHT:
            return
        last, self._last = self._last, estimate
        if last is None or last.resets != estimate.resets or estimate.time_s - last.time_s > LONGEST_GAP_S:
            self._watched_s = 0.0
        elif (passed_s := estimate.time_s - last.time_s) > 0.0:
            change_m_s2 = (estimate.velocity_m_s - last.velocity_m_s)[:2] / passed_s
            drag_m_s2 = self._drag_1_s * estimate.velocity_m_s[:2]
            push_m_s2 = change_m_s2 + GRAVITY_M_S2 * down[:2] / down[2] + drag_m_s2
            self._watched_s += passed_s
            share = passed_s / min(self._watched_s, WATCH_S)
            self._push_m_s2 = self._push_m_s2 + share * (push_m_s2 - self._push_m_s2)

    def begin(self, learnt_m_s2: FloatArray) -> None:
        """Lean against the push that was watched, or else as now and against what was learnt besides (2,)."""
        against_m_s2 = self.against_m_s2 - learnt_m_s2
        if self._watched_s > WATCH_S:
            against_m_s2 = -self._push_m_s2
        self.against_m_s2 = np.clip(against_m_s2, -self._most_m_s2, self._most_m_s2)
        self._watched_s, self._last = 0.0, None

    def fade(self, passed_s: float) -> None:
        """Lean less."""
        self.against_m_s2 = math.exp(-passed_s / FADES_S) * self.against_m_s2

    def turn(self, heading_rad: float) -> None:
        """Turn with the frame, whose heading has jumped: the drone leans as before."""
        (north, east), s, c = self.against_m_s2.tolist(), math.sin(heading_rad), math.cos(heading_rad)
        self.against_m_s2 = np.array([c * north - s * east, s * north + c * east])

    def tilt_rad(self, heading_rad: float) -> FloatArray:
        """Return roll and pitch (2,) of the lean at a heading."""
        north, east = (self.against_m_s2 / GRAVITY_M_S2).tolist()
        s, c = math.sin(heading_rad), math.cos(heading_rad)
        pitch_rad = -math.atan(c * north + s * east)
        return np.array([math.atan((c * east - s * north) * math.cos(pitch_rad)), pitch_rad])

    def upright(self, estimate: EstimatedState) -> EstimatedState:
        """Return an estimate without the lean."""
        tilt_rad = self.tilt_rad(float(estimate.attitude_rad[2]))
        return replace(estimate, attitude_rad=estimate.attitude_rad - np.array([*tilt_rad, 0.0]))
