"""Compare the margins of settings with those of others: whether a loop is closer to instability."""

import math
from dataclasses import dataclass
from typing import Final

from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.errors import FlightError
from mambo_sil.experiment.margins.axis_margins import Margins, PlaceName
from mambo_sil.experiment.margins.controller_jacobian import has_linear_law
from mambo_sil.experiment.margins.many_drones import measure_drone
from mambo_sil.experiment.margins.margin_figures import number
from mambo_sil.flight.names import DEFAULT_SENSORS, SensorsName
from mambo_sil.results.summary import Number

LEAST_SHARE: Final = 0.8
"""A loop is worse than that of a reference if one of its margins is a smaller share of the other's."""
WORSE: Final = f"a loop more than {100.0 * (1.0 - LEAST_SHARE):.0f} % worse"
_ENOUGH_GAIN, _ENOUGH_DELAY_S = 10.0, 1.0
"""Larger margins count as these: a loop that tolerates so much is not what fails first."""
HEADS: Final = ("gain margin", "delay margin, ms")
_COMMAND: Final[PlaceName] = "command"
NOT_LINEAR: Final = "the law of a 1-norm is not linear"


@dataclass(frozen=True)
class MarginReference:
    """Gain margin and delay margin in s of each stable loop of settings on a drone, by axis and place.

    whose:   the settings, in words.
    missing: why there are no margins; None if there are.
    """

    whose: str
    sensors: SensorsName
    loops: dict[str, tuple[Number, Number]]
    missing: str | None = None


@dataclass(frozen=True)
class Reserve:
    """Least gain margin of all loops, least delay margin at a command, least share of a reference's margin.

    They are NaN where there are no margins, and 0 for an unstable loop.
    """

    gain: Number = math.nan
    delay_s: Number = math.nan
    share: Number = math.nan

    @property
    def enough(self) -> bool:
        """Whether no loop is worse than that of the reference, as far as is known."""
        return not self.share < LEAST_SHARE

    @property
    def cells(self) -> tuple[str, str]:
        """Gain and delay margin under `HEADS`."""
        return number(self.gain), number(1e3 * self.delay_s)


def sensors_of(drone: VehicleFile) -> SensorsName:
    """Return the sensors through which a drone's loops are measured: its own."""
    return DEFAULT_SENSORS[drone.sensors.kind]


def margins_of(settings: Settings, drone: VehicleFile, whose: str) -> MarginReference:
    """Return the margins of settings on a drone; raises BuildError, CacheError."""
    sensors, missing = sensors_of(drone), NOT_LINEAR
    if has_linear_law(settings):
        try:
            return MarginReference(whose, sensors, _loops(measure_drone(settings, drone, sensors)))
        except FlightError as error:
            missing = str(error)
    return MarginReference(whose, sensors, {}, missing)


def reserve(settings: Settings, drone: VehicleFile, reference: MarginReference) -> Reserve:
    """Return what is left of the margins of a reference; raises BuildError, CacheError."""
    if reference.missing is not None or not has_linear_law(settings):
        return Reserve()
    try:
        axes = measure_drone(settings, drone, reference.sensors)
    except FlightError:
        return Reserve(0.0, 0.0, 0.0)
    if not all(axis.stable for axis in axes):
        return Reserve(0.0, 0.0, 0.0)
    loops = _loops(axes)
    common = [(loops[name], reference.loops[name]) for name in loops if name in reference.loops]
    return Reserve(
        min(gain for gain, _ in loops.values()),
        min(delay_s for name, (_, delay_s) in loops.items() if name.endswith(_COMMAND)),
        min((_share(*pair) for pair in common), default=math.nan),
    )


def _loops(axes: tuple[Margins, ...]) -> dict[str, tuple[float, float]]:
    return {
        f"{axis.axis}: {place}": (loop.gain_up, loop.delay_s)
        for axis in axes
        for place, loop in axis.loops.items()
    }


def _share(found: tuple[float, float], reference: tuple[float, float]) -> float:
    """Return the least share that a margin of a loop is of the reference's."""
    most = (_ENOUGH_GAIN, _ENOUGH_DELAY_S)
    return min(min(a, top) / min(b, top) for a, b, top in zip(found, reference, most, strict=True))
