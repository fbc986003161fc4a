"""Sensors and estimators in series: from the true state to the estimate that the controllers receive."""

from collections.abc import Sequence

from mambo_nmpc.sil.plant.vehicle import Seen
from mambo_nmpc.sil.sensors.estimators import Estimators
from mambo_nmpc.sil.sensors.instruments import Instruments, Sensors


class Suite:
    """Instruments and estimators of n flights; call `estimate` once per tick of 5 ms."""

    def __init__(self, sensors: Sensors, seeds: Sequence[int], start: Seen) -> None:
        self._instruments = Instruments(sensors, seeds, start)
        self._estimators = Estimators(start, derotated=sensors.derotated)

    def estimate(self, true: Seen) -> Seen:
        """Return the estimate at this tick."""
        return self._estimators.update(self._instruments.read(true))
