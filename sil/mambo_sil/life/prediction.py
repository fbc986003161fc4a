"""The state in which a command finds the drone: later than its estimate by the delay of the link, both ways.

An estimate shows the drone as it was a delay ago, and the answer to it acts a delay later. What the drone
does until then follows from the commands that are on their way. So the controller gets the state of that
time, by its own model of angles, thrust and drag, and by what it has learnt of the wind: its loop has no
delay of the link, and its settings need not know one.
"""

import bisect
import math
from dataclasses import replace
from typing import Final

import numpy as np

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.optional_sections import Height
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.life.records import EstimatedState

SHORT_S: Final = 0.01
"""A delay each way up to which states stay as they came: settings bear it."""
STEP_S: Final = 0.01
LIFT_S: Final = 3.0
"""Time constant of the mean lift, which carries the drone."""
KEPT: Final = 1000
"""How many commands are kept."""


class DelayPrediction:
    """Carries states ahead; call `begin` at a take-over, and `sent` for each command."""

    def __init__(self, settings: Settings, height: Height, hover_m_s2: float) -> None:
        model = settings.model
        self.delay_s = 0.0
        """The delay of the link in each direction."""
        self._gain = np.array([model.roll_gain, model.pitch_gain])
        self._lag_s = np.array([model.roll_lag_s, model.pitch_lag_s])
        self._dead_s = model.roll_delay_s, model.pitch_delay_s
        self._trim_rad = np.array([model.roll_trim_rad, model.pitch_trim_rad])
        self._slope, self._drag_1_s = model.acceleration_per_tilt, model.drag_1_s
        self._thrust_dead_s, self._hover_m_s2 = height.delay_s + height.lag_s, hover_m_s2
        self.begin(np.zeros(2))

    def begin(self, tilt_rad: FloatArray) -> None:
        """Begin with a command (2,) that was sent for long, at the thrust of hover."""
        self._times_s, self._tilts_rad = [-math.inf], [tilt_rad]
        self._thrusts_m_s2, self._lift_m_s2 = [self._hover_m_s2], self._hover_m_s2

    def sent(self, time_s: float, tilt_rad: FloatArray, thrust_m_s2: float, passed_s: float) -> None:
        """Keep the command that answers the estimate of a time, and its share of the mean lift."""
        self._times_s.append(time_s)
        self._tilts_rad.append(tilt_rad)
        self._thrusts_m_s2.append(thrust_m_s2)
        for kept in (self._times_s, self._tilts_rad, self._thrusts_m_s2):
            del kept[:-KEPT]
        lift_m_s2 = thrust_m_s2 * float(np.prod(np.cos(tilt_rad)))
        self._lift_m_s2 += (lift_m_s2 - self._lift_m_s2) * min(passed_s / LIFT_S, 1.0)

    def ahead(self, estimate: EstimatedState, push_m_s2: FloatArray) -> EstimatedState:
        """Return the state when the answer to an estimate acts, with a learnt push (2,) along x and y.

        The time stays that of the estimate.
        """
        if self.delay_s <= SHORT_S:
            return estimate
        trip_s = 2.0 * self.delay_s
        steps = math.ceil(trip_s / STEP_S)
        step_s = trip_s / steps
        keep = np.exp(-step_s / np.maximum(self._lag_s, 1e-9))
        position_m, velocity_m_s = estimate.position_m, estimate.velocity_m_s
        tilt_rad, yaw_rad = estimate.attitude_rad[:2], float(estimate.attitude_rad[2])
        for number in range(steps):
            acts_s = estimate.time_s - trip_s + number * step_s
            goal_rad = self._gain * self._tilt_at(acts_s)
            tilt_rad = goal_rad + keep * (tilt_rad - goal_rad)
            change_m_s2 = self._acceleration(tilt_rad - self._trim_rad, yaw_rad, acts_s)
            change_m_s2[:2] += push_m_s2 - self._drag_1_s * velocity_m_s[:2]
            position_m = position_m + step_s * (velocity_m_s + 0.5 * step_s * change_m_s2)
            velocity_m_s = velocity_m_s + step_s * change_m_s2
        attitude_rad = np.array([*tilt_rad, yaw_rad])
        return replace(estimate, position_m=position_m, velocity_m_s=velocity_m_s, attitude_rad=attitude_rad)

    def _tilt_at(self, acts_s: float) -> FloatArray:
        """Return roll and pitch (2,) that the loops of the angles begin to follow."""
        roll_rad, pitch_rad = (
            self._tilts_rad[self._place(acts_s - dead_s)][axis] for axis, dead_s in enumerate(self._dead_s)
        )
        return np.array([roll_rad, pitch_rad])

    def _place(self, time_s: float) -> int:
        """Return the place of the command that was the newest at a time."""
        return max(bisect.bisect_right(self._times_s, time_s + 1e-6) - 1, 0)

    def _acceleration(self, tilt_rad: FloatArray, yaw_rad: float, acts_s: float) -> FloatArray:
        """Return what thrust and weight give (3,), z down; the mean lift carries the weight."""
        thrust_m_s2 = self._thrusts_m_s2[self._place(acts_s - self._thrust_dead_s)]
        thrust_m_s2 *= GRAVITY_M_S2 / self._lift_m_s2
        (roll_rad, pitch_rad), s, c = tilt_rad.tolist(), math.sin(yaw_rad), math.cos(yaw_rad)
        ahead = -self._slope * thrust_m_s2 * math.cos(roll_rad) * math.sin(pitch_rad)
        right = self._slope * thrust_m_s2 * math.sin(roll_rad)
        down = GRAVITY_M_S2 - thrust_m_s2 * math.cos(roll_rad) * math.cos(pitch_rad)
        return np.array([c * ahead - s * right, s * ahead + c * right, down])
