"""What the controllers of n flights see: instruments and estimators one after the other."""

from collections.abc import Sequence

from mambo_nmpc.sil.plant.vehicle import Seen
from mambo_nmpc.sil.sensors.estimators import Estimators
from mambo_nmpc.sil.sensors.instruments import Instruments, Sensors


class Suite:
    """Instruments and estimators of n flights, which remember; one `look` for each tick of 5 ms."""

    def __init__(self, sensors: Sensors, seeds: Sequence[int], start: Seen) -> None:
        self._instruments = Instruments(sensors, seeds, start)
        self._estimators = Estimators(start, derotated=sensors.derotated)

    def look(self, true: Seen) -> Seen:
        """Return the estimates at this tick."""
        return self._estimators.update(self._instruments.read(true))
