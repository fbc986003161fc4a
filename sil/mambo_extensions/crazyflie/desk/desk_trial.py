"""Fly the app of settings on the desk, a hover and an eight, for a verdict on the settings."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from mambo_codegen.errors import InvalidSettingsError
from mambo_codegen.settings.model import Settings
from mambo_codegen.toolchain import host_toolchain
from mambo_extensions.crazyflie.desk import desk_library
from mambo_extensions.crazyflie.desk.desk_events import DeskTrace, fly_events
from mambo_extensions.crazyflie.desk.events_file import EventsFile, SensorsSection
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import MocapSensors
from mambo_sil.flight.flown_settings import FlownSettings

JUDGED_FROM_S: Final = 3.0
FLIGHTS: Final = {
    "hover": EventsFile(trajectory="hover", duration_s=6.0),
    "eight": EventsFile(trajectory="bernoulli", size_m=2.0, rate_rad_s=0.5, duration_s=13.0),
}
OFFSET_MS: Final = 0
"""Of the cameras' clock against the filter's: the one at which settings shake first."""
SHAKING_RAD: Final = 0.1
"""Rms of the commands of a hover, about their mean: 0.02 is the most of good settings, 0.3 of an orbit."""
FAR_M: Final = 0.25
"""Distance to the target: 0.08 is the most of good settings with cameras that are 60 ms late."""


@dataclass(frozen=True)
class _Judged:
    """A flight: how far it was from its target at most, and what is wrong with it, in words."""

    off_m: float
    fault: str | None


def fly_trial(settings: Settings, drone: VehicleFile) -> FlownSettings:
    """Fly an app on the desk's Crazyflie, seen by the sensors of a drone; cameras also with half their delay.

    Settings of which no app is made are not flown, and not refused. Raises BuildError, CacheError,
    FlightError.
    """
    try:
        library = desk_library.build(settings, host_toolchain())
    except InvalidSettingsError as error:
        return FlownSettings(good=True, words=f"not flown on the desk: {error}")
    farthest_m = 0.0
    seen = list(_sensors(drone))
    for sensors in seen:
        for name, flight in FLIGHTS.items():
            judged = _judge(library, flight.model_copy(update={"sensors": sensors}))
            if judged.fault is not None:
                words = f"flown on the desk{_late([sensors])}: {name} {judged.fault}"
                return FlownSettings(good=False, words=words)
            farthest_m = max(farthest_m, judged.off_m)
    names, off = " and ".join(FLIGHTS), "in height" if seen[0].kind == "flow-deck" else "off"
    words = f"flown on the desk{_late(seen)}: {names} are calm, at most {1e3 * farthest_m:.0f} mm {off}"
    return FlownSettings(good=True, words=words)


def _sensors(drone: VehicleFile) -> Iterator[SensorsSection]:
    """Yield what measures: a flow deck, or the cameras of a drone and such of half their delay."""
    sensors = drone.sensors
    if not isinstance(sensors, MocapSensors):
        yield SensorsSection(kind="flow-deck")
        return
    delays_ms = (round(1e3 * sensors.position_delay_s), round(5e2 * sensors.position_delay_s))
    for delay_ms in dict.fromkeys(delays_ms):
        yield SensorsSection(
            camera_period_ms=max(1, round(1e3 / sensors.position_rate_hz)),
            camera_delay_ms=delay_ms,
            camera_noise_m=min(sensors.position_noise_m, 1.0),
        )


def _late(seen: list[SensorsSection]) -> str:
    """Return the delays of cameras in words, nothing for a flow deck."""
    if seen[0].kind == "flow-deck":
        return " through a flow deck"
    return f", cameras {' and '.join(str(one.camera_delay_ms) for one in seen)} ms late"


def _judge(library: Path, flight: EventsFile) -> _Judged:
    """Fly and judge what comes after the take-off and the first seconds.

    A flow deck does not measure where the drone is; only its height is judged.
    """
    trace = fly_events(library, flight, offset_ms=OFFSET_MS)
    late = trace.time_s > JUDGED_FROM_S
    off_m = trace.position_m[late] - trace.target_m[late]
    if flight.sensors.kind == "flow-deck":
        off_m = off_m[:, 2:]
    farthest_m = float(np.linalg.norm(off_m, axis=1).max())
    return _Judged(farthest_m, _fault(trace, flight, farthest_m))


def _fault(trace: DeskTrace, flight: EventsFile, farthest_m: float) -> str | None:
    """Return what is wrong with a flight; numbers of a drone that was lost are none."""
    if flight.trajectory == "hover":
        late = trace.time_s > JUDGED_FROM_S
        shaking_rad = float(trace.command_rad[late].std(axis=0).max())
        if not shaking_rad < SHAKING_RAD:
            return f"SHAKES, by commands of {shaking_rad:.2g} rad (rms); raise cost.response_time_s"
    if not farthest_m < FAR_M:
        return f"is FAR OFF, by {farthest_m:.2g} m" if math.isfinite(farthest_m) else "is LOST"
    return None
