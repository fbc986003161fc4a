"""The sensors of n flights, whatever they are: motion capture, the Mambo's, or an estimate that drifts."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mambo_sil.drone.plant.vehicle import Seen
from mambo_sil.drone.sensors import drift, instruments, mocap
from mambo_sil.drone.sensors.drift import DriftingEstimate, DriftSuite
from mambo_sil.drone.sensors.estimators import Suite
from mambo_sil.drone.sensors.instruments import Sensors
from mambo_sil.drone.sensors.mocap import MocapSuite, MotionCapture

AnySensors = Sensors | MotionCapture | DriftingEstimate


class AnySuite(Protocol):
    """What measures in n flights, from the true state on."""

    def estimate(self, true: Seen) -> Seen:
        """Return what the controllers receive; to be called once in each tick."""
        ...

    def place(self, start: Seen, put: NDArray[np.bool_]) -> None:
        """Start again with the drones that are `put` (n,) elsewhere, at their true state."""
        ...


def noises_of(sensors: AnySensors | None) -> int:
    """Return how many random numbers the sensors of one drone use in a tick; 0 for the true state."""
    match sensors:
        case Sensors():
            return instruments.NOISES
        case MotionCapture():
            return mocap.NOISES
        case DriftingEstimate():
            return drift.NOISES
        case None:
            return 0


def suite_of(sensors: AnySensors | None, seeds: Sequence[int], start: Seen, step_s: float) -> AnySuite | None:
    """Return the sensors of n flights with ticks of `step_s`; None: the true state."""
    match sensors:
        case Sensors():
            return Suite(sensors, seeds, start)
        case MotionCapture():
            return MocapSuite(sensors, seeds, start, step_s)
        case DriftingEstimate():
            return DriftSuite(sensors, seeds, step_s)
        case None:
            return None
