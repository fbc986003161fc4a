"""Motion capture of n flights: late, noisy positions at a fixed rate, and the drone's own attitude.

The commands run its equal in C, `flight/engine/mocap.h`, which has the same bits.

The velocity is the difference quotient of successive positions behind a first-order low-pass. Position and
velocity are held between positions; attitude, with noise, and body rates are new at every tick. What is
measured lies `lever_m` from the centre of mass: the attitude of now moves a position that arrives back to it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_sil.drone.plant.arrays import FloatArray, PerFlight
from mambo_sil.drone.plant.elementary import exponential
from mambo_sil.drone.plant.randomness import Draws, Purpose
from mambo_sil.drone.plant.vehicle import Seen, arm_in_world
from mambo_sil.drone.vehicles.vehicle_sections import MocapSensors

NOISES: Final = 6
"""Random numbers of a tick: position x, y, z, roll, pitch, yaw."""


@dataclass(frozen=True, eq=False)
class MotionCapture:
    """Parameters of the motion capture of n flights."""

    figures: MocapSensors
    noise_scale: PerFlight = 1.0
    """Factor on the standard deviation of all noise, one value for all or an array (n,); 0 is noise-free."""


@dataclass(frozen=True)
class Sampling:
    """How positions are sampled and filtered, in ticks."""

    period_ticks: int
    delay_ticks: int
    period_s: float
    share: float
    """Share of the difference between quotient and velocity by which a new position changes the velocity."""


def sampling(figures: MocapSensors, step_s: float) -> Sampling:
    """Return how positions are sampled with ticks of `step_s`; the delay is the nearest number of ticks."""
    period_s = 1.0 / figures.position_rate_hz
    filter_s = figures.velocity_filter_s
    share = 1.0 - float(exponential(-period_s / filter_s)) if filter_s > 0.0 else 1.0
    return Sampling(round(period_s / step_s), round(figures.position_delay_s / step_s), period_s, share)


def mocap_deviations(capture: MotionCapture, flights: int) -> FloatArray:
    """Return the standard deviations of the noise (6, n), in the order of `NOISES`."""
    figures = capture.figures
    deviations = np.array([[figures.position_noise_m]] * 3 + [[figures.attitude_noise_rad]] * 3)
    return np.asarray(deviations * np.broadcast_to(np.asarray(capture.noise_scale, np.float64), flights))


class MocapSuite:
    """The motion capture of n flights; call `estimate` once per tick. It starts from the true state."""

    def __init__(self, capture: MotionCapture, seeds: Sequence[int], start: Seen, step_s: float) -> None:
        self._sampling = sampling(capture.figures, step_s)
        self._noise = mocap_deviations(capture, len(seeds))
        self._draws = Draws(seeds, Purpose.SENSORS, NOISES)
        self._lever_m = capture.figures.lever_m
        self._late_m = [self._at_lever(start)] * self._sampling.delay_ticks
        self._position_m = start.position_m
        self._velocity_m_s = start.velocity_m_s
        self._tick = 0

    def place(self, start: Seen, put: NDArray[np.bool_]) -> None:
        """Start again with the drones that are `put` (n,) elsewhere, at their true state."""
        self._late_m = [np.where(put, self._at_lever(start), late_m) for late_m in self._late_m]
        self._position_m = np.where(put, start.position_m, self._position_m)
        self._velocity_m_s = np.where(put, start.velocity_m_s, self._velocity_m_s)

    def estimate(self, true: Seen) -> Seen:
        """Return what the controllers receive at this tick."""
        noise = self._noise * self._draws.next()
        self._late_m.append(self._at_lever(true))
        arriving_m, euler_rad = self._late_m.pop(0), true.euler_rad + noise[3:]
        if self._tick % self._sampling.period_ticks == 0:
            position_m = arriving_m + noise[:3]
            if any(self._lever_m):
                position_m = position_m - arm_in_world(euler_rad, self._lever_m)
            if self._tick > 0:
                quotient = (position_m - self._position_m) / self._sampling.period_s
                change = self._sampling.share * (quotient - self._velocity_m_s)
                self._velocity_m_s = self._velocity_m_s + change
            self._position_m = position_m
        self._tick += 1
        return Seen(self._position_m, self._velocity_m_s, euler_rad, true.rates_rad_s)

    def _at_lever(self, true: Seen) -> FloatArray:
        """Return the places (3, n) that are measured."""
        if not any(self._lever_m):
            return true.position_m
        return true.position_m + arm_in_world(true.euler_rad, self._lever_m)
